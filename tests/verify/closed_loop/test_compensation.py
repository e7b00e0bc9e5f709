"""A compensator must compensate: three of no use, and one that is 2 % off, are seen; what is right holds."""

from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign.verify.closed_loop.compensation import compensates
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.ramps import compare_at_pressure
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.exhaustive.all_inputs import every_input
from tests.support.designs import MACHINES, designed, written
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def judged(compensator, folder, plant=None):
    """The check of a firmware, by a ramp at the lowest and the highest tested pressure drop of each side."""
    written(compensator, folder)
    scenes = scenes_of(folder, compensator, plant)
    ends = [scene for scene in scenes if scene.dp_MPa in (scenes[0].dp_MPa, scenes[-1].dp_MPa)]
    results = [compare_at_pressure(scene, RampSequence(ramp=40.0)).result for scene in ends]
    curves = {}
    for sign in compensator.signals.signs:
        curves |= every_input(folder, sign, compensator)[1]
    return compensates(results, curves, compensator, plant_given=plant is not None)


def law(compensator, *, offset=Fraction(1), drive_range=Fraction(1)):
    """The same compensator with another law, as a wrong `design` would make it."""
    right = compensator.positive
    side = replace(
        right,
        u_min0_over_u_max=right.u_min0_over_u_max * offset,
        drive_range_over_u_max=right.drive_range_over_u_max * drive_range,
    )
    return replace(compensator, sides=replace(compensator.sides, positive=side))


@pytest.mark.parametrize(
    ("wrong", "seen"),
    [
        ({"offset": Fraction(1, 2)}, "the offset lies at most"),
        ({"offset": Fraction(98, 100)}, "the offset lies at most"),
        ({"drive_range": Fraction(1, 2)}, "the largest flow is"),
        ({"drive_range": Fraction(2)}, "the output rises up to"),
    ],
    ids=["half the offset", "2 % less", "half the flow", "full at half the command"],
)
def test_a_useless_compensator_is_seen(wrong, seen, example_compensator, tmp_path):
    check = judged(law(example_compensator, **wrong), tmp_path / "fw")
    assert check.holds is False and check.text.startswith(seen)


def test_a_firmware_that_opens_late_is_seen(example_compensator, tmp_path, monkeypatch):
    """By the figures of a ramp: half a per cent of command beside what is stated."""
    from tests.verify.closed_loop import test_compensation as here

    right = here.compare_at_pressure

    def late(*given):
        loop = right(*given)
        return replace(loop, result=replace(loop.result, residual_opening=loop.result.residual_opening + 0.005))

    monkeypatch.setattr(here, "compare_at_pressure", late)
    check = judged(example_compensator, tmp_path / "fw")
    assert check.holds is False and check.text.startswith("the dead zone on opening is")


@pytest.mark.slow
@pytest.mark.parametrize(
    "texts",
    [
        {}, {"hysteresis": "play"}, {"transition": "off"}, {"output_max": "80 %"}, {"below_dp0": "extend"},
        {"above": "hold"}, {"ramp_up": "2 s"}, {"dither": "125 Hz 2 %"}, {"guard": "opening"},
        {"law": "target"}, *MACHINES.values(),
    ],
    ids=str,
)  # fmt: skip
def test_a_right_one_holds(texts, example_valve, tmp_path):
    check = judged(designed(example_valve, **texts), tmp_path / "fw")
    assert check.holds, check.text


def test_with_a_plant_of_equations(example_compensator, plant, tmp_path):
    check = judged(example_compensator, tmp_path / "fw", plant)
    assert check.holds, check.text
