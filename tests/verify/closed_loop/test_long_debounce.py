"""A debounce that outlasts the start of a ramp: the closed loop waits with the interlock, and then opens."""

import numpy as np
import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import RampSequence
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


@pytest.mark.parametrize(("debounce", "waited"), [("5 samples", 0), ("0.2 s", 240), ("2 s", 2490)])
def test_scenarios_open_after_a_long_debounce(example_valve, debounce, waited, tmp_path):
    options = options_of({"fault_debounce": debounce}, target_named("f28335").inputs())
    compensator = design(example_valve, options)
    made = generate(compensator, "host")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    scene = scenes_of(tmp_path / "fw", compensator, None)[0]
    samples = compensator.drive_functions.fault_samples
    assert scene.waited().size == pytest.approx(waited, abs=5) and scene.loop.waits_s == samples / 1250
    run = scene.run(scene.opened_and_closed())
    assert run.q_mean_L_min.max() > 5.0, "it opens"
    sequence = RampSequence(rest=0.5, ramp=2.0, top=0.5).for_drive(scene.loop)
    assert sequence.rest == max(0.5, samples / 1250)
    # Seeded: without the wait the drive never follows.
    if waited:
        early = scene.run(np.concatenate([np.linspace(0, 1, 2500), scene.held(1)]))
        assert early.q_mean_L_min.max() == 0.0
