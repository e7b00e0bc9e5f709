"""The calibration block: layout and C struct, its files, and what is read of it in engineering units."""

import random
import shutil
import subprocess
import zlib
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import STRUCTS, block_core_files
from dzdesign.codegen.calibration.layout import LENGTH_WORDS, MAGIC, NODE_MASK, CalibrationBlock, members, words_of
from dzdesign.codegen.calibration.packing import (
    FORMATS,
    MOST_OCTETS,
    OCTETS,
    Place,
    image_of,
    pack,
    read_block_file,
    text_of,
    unpack,
)
from dzdesign.codegen.calibration.reading import counts_at, reading_of
from dzdesign.codegen.project import target_named
from dzdesign.core.errors import DzdesignError, InputError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from tests.support.block_reader import hex_memory, hex_text
from tests.support.core_texts import texts
from tests.support.core_variants import variant

DIGEST = "0123456789abcdef" * 4
#: Compiler to its flags: `int` of 32 bits, and of 16.
COMPILERS = {"gcc": (), "avr-gcc": ("-mmcu=atmega1280",)}


@pytest.fixture(scope="module")
def block() -> CalibrationBlock:
    return block_of(variant("bipolar, all options"), DIGEST, serial="V-7 №3", record="lot 12")


@pytest.mark.parametrize("name", ["default", "bipolar, play", "bipolar, all options"])
def test_a_block_comes_back_as_it_was(name):
    block = block_of(variant(name), DIGEST)
    octets = pack(block)
    assert replace(unpack(octets), crc32=0) == block
    assert pack(unpack(octets)) == octets


def test_a_block_is_what_the_layout_states(block):
    octets = pack(block)
    assert len(octets) == 2 * LENGTH_WORDS <= 3072 and octets.startswith(MAGIC)
    assert zlib.crc32(octets[:-4]) == int.from_bytes(octets[-4:], "little")
    assert octets[20:52].hex() == DIGEST and octets[52:64] == "V-7 №3".encode().ljust(12, b"\0")
    assert (text_of(block.serial), text_of(block.record)) == ("V-7 №3", "lot 12")


def test_no_compiler_pads_the_struct():
    end = 0
    for member in members():
        assert member.at == end and (member.entry.bits == 16 or member.at % 2 == 0), member
        end += member.entry.words
    assert end == LENGTH_WORDS and all(words_of(kind) % 2 == 0 for kind in STRUCTS)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_c_struct_is_the_layout(compiler, tmp_path):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} not found")
    header = texts(block_core_files(built_for(variant("default"))))
    (tmp_path / "dz_calibration.h").write_text(header["dz_calibration.h"])
    source = ["#include <stddef.h>", '#include "dz_calibration.h"', "static const struct dz_calibration block;"]
    for number, member in enumerate(members()):
        at, size = 2 * member.at, 2 * member.entry.words
        source.append(f"char at_{number}[offsetof(struct dz_calibration, {member.path}) == {at} ? 1 : -1];")
        source.append(f"char size_{number}[sizeof block.{member.path} == {size} ? 1 : -1];")
    source.append(f"char whole[sizeof block == {2 * LENGTH_WORDS} ? 1 : -1];")
    (tmp_path / "layout.c").write_text("\n".join(source) + "\n")
    command = [compiler, *COMPILERS[compiler], "-std=c99", "-c", "layout.c", "-o", "layout.o"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    # The test can fail: a member elsewhere does not compile.
    (tmp_path / "layout.c").write_text("\n".join(source).replace("== 8 ?", "== 10 ?", 1) + "\n")
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, check=False).returncode


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda octets: b"", "DZC1"),
        (lambda octets: b"XZC1" + octets[4:], "DZC1"),
        (lambda octets: octets[:-1], "cut"),
        (lambda octets: octets + b"\0", "follows"),
        (lambda octets: octets[:5], "cut"),
        (lambda octets: octets[:4] + b"\2\0" + octets[6:], "layout 2"),
        (lambda octets: octets[:6] + b"\0\0" + octets[8:], "0 words"),
        (lambda octets: octets[:100] + bytes([octets[100] ^ 1]) + octets[101:], "CRC-32"),
        (lambda octets: octets[:-1] + bytes([octets[-1] ^ 128]), "CRC-32"),
    ],
)
def test_what_is_no_block_is_refused(block, damage, named):
    with pytest.raises(InputError, match=r"valve\.bin") as refused:
        unpack(damage(pack(block)), "valve.bin")
    assert named in str(refused.value) and "dzdesign calibration" in str(refused.value)


def test_what_a_block_has_no_room_for_is_refused():
    compensator = variant("default")
    nodes = (100,) * (compensator.signals.pair(1).largest_difference // 16 + 2)
    positive = replace(compensator.positive, beta=nodes, transition_beta=nodes)
    many = replace(compensator, beta_step_codes=16, sides=replace(compensator.sides, positive=positive))
    for refused, texts_given, named in (
        (many, {}, "nodes"),
        (compensator, {"serial": "x" * 25}, "25 octets"),
        (compensator, {"record": "a\nb"}, "printed"),
    ):
        with pytest.raises(InputError, match=named):
            block_of(refused, DIGEST, **texts_given)


def test_a_number_that_does_not_fit_is_no_block(block):
    for change in ({"code_max": 65536}, {"serial": (0,) * 11}, {"reverse": -1}):
        with pytest.raises(DzdesignError):
            pack(replace(block, **change))


def test_unlike_sensors_and_sides_stand_in_the_block(block):
    compensator = variant("bipolar, all options")
    signals = compensator.signals
    assert block.shape == 0b10101
    for place, sign in enumerate(signals.signs):
        assert block.sides[place].weight == signals.pair(sign).weight != 4096
        side, law, zero = block.sides[place], compensator.side(sign).law_beta, compensator.side(sign).beta
        unit = Fraction(1, side.beta_unit)
        for node, (of_law, at_zero) in enumerate(zip(law, zero, strict=True)):
            found = (side.nodes[2 * node] * unit, side.nodes[2 * node + 1] * unit)
            assert found == tuple(Fraction(beta, compensator.beta_denominator) for beta in (of_law, at_zero))
        assert side.node_count == len(law) and not any(side.nodes[2 * len(law) : 2 * NODE_MASK])
        fallback = [min(table) * side.beta_unit // compensator.beta_denominator for table in (law, zero)]
        assert side.nodes[2 * NODE_MASK :] == (*fallback, *fallback)
        assert (side.span, side.room) == (signals.command.span(sign), side.span - compensator.zero_band_codes)


CONTENT = bytes(range(256)) * 10 + b"last"
PLACES = {
    "f28335": target_named("f28335").block_place,
    "f280049c": target_named("f280049c").block_place,
    "octets from 0": target_named("host").block_place,
    "words over a segment's end": Place(address=0x31_FFFE, unit_octets=2),
    "octets over a segment's end": Place(address=0x0800_FFF4),
    "last words": Place(address=2**31 - len(CONTENT) // 2, unit_octets=2),
}


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("name", FORMATS)
def test_a_file_gives_the_octets_back(name, place, tmp_path):
    for file in (tmp_path / f"block.{name}", tmp_path / "block.other"):
        file.write_bytes(image_of(CONTENT, name, place))
        assert read_block_file(file, None if file.suffix == f".{name}" else name)[0] == CONTENT


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_each_octet_lies_at_its_address(place):
    expected = {place.address * place.unit_octets + at: octet for at, octet in enumerate(CONTENT)}
    assert hex_memory(image_of(CONTENT, "hex", place).decode(), of_words=place.unit_octets == 2) == expected


def test_a_c28x_has_words_of_which_the_high_octet_comes_first():
    """As `hex2000 --romwidth=16 --intel` writes 0x2211, 0x4433 at word 0x330000."""
    place = PLACES["f28335"]
    assert image_of(bytes.fromhex("11223344"), "hex", place).decode().split() == [
        ":020000040033C7", ":040000002211443352", ":00000001FF",
    ]  # fmt: skip
    second = image_of(bytes(64), "hex", place).decode().split()[2]
    assert second.startswith(":20001000"), "the second row of 32 octets is 16 words further"


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: [*rows[:3], rows[3][:-1] + ("1" if rows[3][-1] == "0" else "0"), *rows[4:]],
        lambda rows: [*rows[:3], *rows[4:]],
        lambda rows: [*rows[:3], rows[2], *rows[3:]],
        lambda rows: [*rows[:3], ":00000001FF", *rows[3:]],
        lambda rows: [*rows[:3], rows[3][:20], *rows[4:]],
        lambda rows: rows[:-1],
    ],
)
def test_a_hex_file_of_words_with_an_error_is_refused(change, tmp_path):
    rows = image_of(CONTENT, "hex", PLACES["f28335"]).decode().split()
    (tmp_path / "a.hex").write_text("\n".join(change(rows)) + "\n")
    with pytest.raises(InputError, match=r"a\.hex"):
        read_block_file(tmp_path / "a.hex")


def test_rows_may_come_in_any_order_and_lie_anywhere(tmp_path):
    (tmp_path / "b.HEX").write_bytes(hex_text((0x33_0000, CONTENT)).replace("\n", "\r\n").encode())
    assert read_block_file(tmp_path / "b.HEX")[0] == CONTENT
    first, *rows, end = image_of(CONTENT, "hex", PLACES["f28335"]).decode().split()
    (tmp_path / "a.hex").write_text("\n".join([first, *reversed(rows), end]) + "\n")
    assert read_block_file(tmp_path / "a.hex")[0] == CONTENT


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.s19", b"", "expected a calibration file, .hex, .bin"),
        ("a.bin", bytes(MOST_OCTETS + 1), "a few KiB"),
        ("a.hex", b":0100000001FF", "does not end with the record"),
        ("a.hex", hex_text((0, CONTENT)).replace(":10001000", ":10001001").encode(), "not Intel HEX"),
        ("a.hex", b"S1\n:00000001FF\n", "not Intel HEX"),
        ("a.hex", b"\xff\n:00000001FF\n", "no ASCII"),
        ("a.hex", b":00000001FF\n", "octets in none of its rows"),
        ("a.hex", hex_text((0, CONTENT), (5000, CONTENT)).encode(), "parts that do not follow each other"),
    ],
)
def test_a_file_with_an_error_is_refused(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_block_file(tmp_path / name)


@pytest.mark.parametrize(
    ("place", "address", "right"),
    [
        (Place(unit_octets=2), 2**31 - 4, False),
        (Place(unit_octets=2), 0x33_0001, False),
        (Place(unit_octets=2), 2**31 - 6, True),
        (Place(), 0x0800_0002, False),
        (Place(), -4, False),
        (Place(), 2**32 - 12, True),
        (Place(), 2**32 - 8, False),
    ],
)
def test_an_address_has_room_behind_it(place, address, right):
    if right:
        assert place.at(address, 12) == Place(address=address, unit_octets=place.unit_octets)
        return
    with pytest.raises(InputError, match="--address is"):
        place.at(address, 12)


def block_named(name: str) -> CalibrationBlock:
    return block_of(variant(name), DIGEST, serial="V-7 №3", record="lot 12")


#: What a block says of the pressure inputs of negative commands.
SAID_OF = {
    "AB": (),
    "BA": (
        "pressure B is ahead at negative commands, and not A", "pressure A is behind at negative commands, and not B"
    ),
    "AC": ("pressure C is behind at negative commands, and not B",),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", ["default", "target law, no transition", "bipolar, all options", "bipolar, play", "three pressures"]
)
def test_the_reading_is_what_the_compensator_says(name):
    compensator, block = variant(name), block_named(name)
    signals, functions = compensator.signals, compensator.drive_functions
    reading = reading_of(block, "block")
    full = float(compensator.u_max_V)
    assert (reading.serial, reading.record, reading.compensator_sha256) == ("V-7 №3", "lot 12", DIGEST)
    assert reading.u_max_V == full and reading.shape == (
        ("two solenoids: a command of both signs", *SAID_OF[signals.negative_pair]) if compensator.negative else ()
    )
    assert list(reading.pressures) == list(signals.pressures)
    for found, sensor in zip(reading.pressures.values(), signals.pressures.values(), strict=True):
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
        assert nodes[-1].dp_MPa == pytest.approx(
            law.ahead.per_code_MPa * compensator.beta_step_codes * (len(nodes) - 1)
        )
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
        assert 0 <= tested - reading.sides[side].tested_to_MPa < law.ahead.per_code_MPa


def _sides(compensator):
    return [(name, sign) for name, sign in (("positive", 1), ("negative", -1)) if sign in compensator.signals.signs]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"shape": 1 << 9}, "shape"),
        ({"sample_Hz": 0}, "rates"),
        ({"compare_max": 0}, "rates"),
        ({"beta_step": 0}, "step of beta"),
        ({"beta_step": 48}, "step of beta"),
        ({"reserved": 1}, "FORMAT"),
        ({"compare_limit": 65535}, "LAW"),
        ({"dither_ticks": 0}, "DRIVE"),
    ],
)
def test_numbers_that_no_firmware_accepts_are_refused(change, named):
    block = unpack(pack(replace(block_named("default"), **change)))
    with pytest.raises(InputError, match=r"^valve\.bin: the CRC-32 is right") as refused:
        reading_of(block, "valve.bin")
    assert named in str(refused.value)


@pytest.mark.parametrize(
    ("part", "change", "named"), [("sensors", {"full": 0}, "span"), ("sides", {"weight": 0}, "SIGNALS")]
)
def test_numbers_of_a_sensor_or_a_side_that_no_firmware_accepts_are_refused(part, change, named):
    block = block_named("default")
    first, *others = getattr(block, part)
    with pytest.raises(InputError) as refused:
        reading_of(replace(block, **{part: (replace(first, **change), *others)}), "valve.bin")
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
