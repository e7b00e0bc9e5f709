"""What tests of functions for MATLAB share: Octave, a golden compensator's folder, and its output."""

import pytest

from dzdesign.codegen.other_targets import generate_output
from dzdesign.codegen.writing import write_generated
from dzdesign.verify.outputs.texts import available_octave

OCTAVE = available_octave().path or None
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="no octave-cli on the path: apt install octave")


def output_of(made):
    """Return the output for MATLAB of a compensator."""
    return generate_output(made, "matlab", {})


def written(made, folder):
    """Write the output for MATLAB of a compensator; return the folder."""
    write_generated(output_of(made), folder)
    return folder
