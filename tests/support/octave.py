"""What tests of functions for MATLAB share: Octave, a golden compensator's folder, and the codes of a sample."""

import pytest

from dzdesign.codegen.other_targets import generate_output, write_output
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.matlab.asked_codes import asked_codes
from dzdesign.verify.matlab.octave import find_octave
from dzdesign.verify.toolchain.compiled_core import CompiledCore

OCTAVE = find_octave()
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="no octave-cli on the path: apt install octave")


def compensator_of(root):
    """Return a golden compensator."""
    return read_artefact((root / "compensator.json").read_bytes(), Compensator, "compensator.json")


def output_of(made):
    """Return the output for MATLAB of a compensator."""
    return generate_output(made, "matlab", {})


def written(made, folder):
    """Write the output for MATLAB of a compensator; return the folder."""
    write_output(output_of(made), folder)
    return folder


def sampled_codes(folder, made, sign=1):
    """Give the codes of a sample, as the check of every input does for all."""
    prepared = PreparedInputs(ExactLaw(made, sign))
    return asked_codes(CompiledCore(folder, sign), sign, prepared.sample(), prepared.exact.zero, sample=True)
