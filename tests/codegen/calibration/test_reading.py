"""A block in engineering units: against the compensator that it was made from, and hostile blocks of a right CRC."""

import random
import zlib
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.layout import CalibrationBlock
from dzdesign.codegen.calibration.packing import OCTETS, pack, unpack
from dzdesign.codegen.calibration.reading import counts_at, reading_of
from dzdesign.core.errors import InputError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from tests.support.core_variants import variant

DIGEST = "0123456789abcdef" * 4


def block_named(name: str) -> CalibrationBlock:
    return block_of(variant(name), DIGEST, serial="V-7 №3", record="lot 12")


@pytest.mark.parametrize("name", ["default", "target law, no transition", "bipolar, all options", "bipolar, play"])
def test_the_reading_is_what_the_compensator_says(name):
    compensator, block = variant(name), block_named(name)
    signals, functions = compensator.signals, compensator.drive_functions
    reading = reading_of(block, "block")
    full = float(compensator.u_max_V)
    assert (reading.serial, reading.record, reading.compensator_sha256) == ("V-7 №3", "lot 12", DIGEST)
    assert reading.u_max_V == full and reading.shape == (
        (*("two solenoids: a command of both signs",), *(("the pressure drop of negative commands is B less A",)
        if signals.swapped else ())) if compensator.negative else ()
    )  # fmt: skip
    for found, sensor in ((reading.pressure_a, signals.pressure_a), (reading.pressure_b, signals.pressure_b)):
        assert found.span_MPa == float(sensor.span_MPa) and found.valid_codes == sensor.valid_codes
        assert (found.zero_code, found.full_code) == (sensor.zero_code, sensor.full_code)
    assert reading.command.codes == {side: signals.command.span(sign) for side, sign in _sides(compensator)}
    drive = reading.drive
    assert drive.output_max_V == pytest.approx(full * functions.compare_limit / signals.compare_max)
    of_command = full / signals.command.span(1)
    assert drive.zero_band_V == pytest.approx(compensator.zero_band_codes * of_command)
    assert drive.transition_V == pytest.approx((compensator.transition_codes or 0) * of_command)
    assert drive.play_travel_V == pytest.approx(functions.play_codes * of_command if functions.has_play else 0)
    assert (drive.dither_Hz is None) == (functions.dither_counts == 0)


def test_ramps_and_dither_are_those_that_were_asked_for():
    reading = reading_of(block_named("bipolar, all options"), "block")
    positive, negative = reading.sides["positive"], reading.sides["negative"]
    assert (positive.ramp_up_s, negative.ramp_up_s) == pytest.approx((0.5, 0.8), rel=1e-4)
    assert positive.ramp_down_s == pytest.approx(0.3, rel=1e-4) and negative.ramp_down_s is None
    assert reading.drive.dither_Hz == pytest.approx(150, rel=0.1) and reading.drive.dither_V == pytest.approx(0.1)


@pytest.mark.parametrize("name", ["default", "no transition", "target law, no transition", "bipolar, all options"])
def test_the_law_at_the_nodes_is_the_exact_one(name):
    compensator, block = variant(name), block_named(name)
    reading = reading_of(block, "block")
    counts = compensator.signals.compare_max / float(compensator.u_max_V)
    for place, (side, sign) in enumerate(_sides(compensator)):
        law, nodes = ExactLaw(compensator, sign), reading.sides[side].nodes
        assert nodes[-1].dp_MPa == pytest.approx(law.a.per_code_MPa * compensator.beta_step_codes * (len(nodes) - 1))
        for number, node in enumerate(nodes):
            betas = law.betas(number * compensator.beta_step_codes)
            assert (node.beta, node.beta_at_zero) == pytest.approx((float(betas.law), float(betas.zero)), rel=1e-9)
            corners = law.corners(betas)
            for past in {0, 1, 40, block.sides[place].room}:
                code = law.zero + law.along * (law.zero_band + past)
                assert counts_at(block, block.sides[place], number, past) == law.compare_value(code, corners)
            assert round(node.offset_V * counts) == law.compare_value(law.zero, corners)
            assert round(node.full_V * counts) == law.compare_value(law.full, corners)
        tested = float(compensator.side(sign).certificate.dp_MPa[1])
        assert 0 <= tested - reading.sides[side].tested_to_MPa < law.a.per_code_MPa


def _sides(compensator):
    return [(name, sign) for name, sign in (("positive", 1), ("negative", -1)) if sign in compensator.signals.signs]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"shape": 1 << 5}, "shape"),
        ({"sample_Hz": 0}, "rates"),
        ({"compare_max": 0}, "rates"),
        ({"beta_step": 0}, "step of beta"),
        ({"beta_step": 48}, "step of beta"),
        ({"a_full": 0}, "span"),
        ({"reserved": 1}, "FORMAT"),
        ({"weight_b": 0}, "SIGNALS"),
        ({"compare_limit": 65535}, "LAW"),
        ({"dither_ticks": 0}, "DRIVE"),
    ],
)
def test_numbers_that_no_firmware_accepts_are_refused(change, named):
    block = unpack(pack(replace(block_named("default"), **change)))
    with pytest.raises(InputError, match=r"^valve\.bin: the CRC-32 is right") as refused:
        reading_of(block, "valve.bin")
    assert named in str(refused.value)


def test_a_hostile_block_is_read_or_refused():
    """Words at random places of a block whose CRC is right, and whole blocks of noise: nothing but `InputError`."""
    rng = random.Random(24)
    octets = pack(block_named("bipolar, all options"))
    refused = 0
    for trial in range(150):
        wrong = bytearray(octets)
        if trial % 3 == 0:
            wrong[8:] = rng.randbytes(OCTETS - 8)
        for _ in range(rng.choice((1, 1, 4, 40))):
            at = rng.randrange(8, OCTETS - 4)
            wrong[at] = rng.choice((0, 0xFF, rng.randrange(256)))
        wrong[-4:] = zlib.crc32(wrong[:-4]).to_bytes(4, "little")
        block = unpack(bytes(wrong))
        try:
            reading_of(block, "block")
        except InputError:
            refused += 1
    assert 50 < refused < 150

