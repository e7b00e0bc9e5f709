"""The calibration block: what it holds, how it is packed, and that the C struct is the same block."""

import shutil
import subprocess
import zlib
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import STRUCTS, block_core_files
from dzdesign.codegen.calibration.layout import LENGTH_WORDS, MAGIC, NODE_MASK, CalibrationBlock, members, words_of
from dzdesign.codegen.calibration.packing import pack, text_of, unpack
from dzdesign.core.errors import DzdesignError, InputError
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
    nodes = (100,) * (compensator.signals.largest_difference(1) // 16 + 2)
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
    assert block.weight_b == signals.weight_b != 4096 and block.shape == 0b101
    for place, sign in enumerate(signals.signs):
        side, law, zero = block.sides[place], compensator.side(sign).law_beta, compensator.side(sign).beta
        unit = Fraction(1, side.beta_unit)
        for node, (of_law, at_zero) in enumerate(zip(law, zero, strict=True)):
            found = (side.nodes[2 * node] * unit, side.nodes[2 * node + 1] * unit)
            assert found == tuple(Fraction(beta, compensator.beta_denominator) for beta in (of_law, at_zero))
        assert side.node_count == len(law) and not any(side.nodes[2 * len(law) : 2 * NODE_MASK])
        fallback = [min(table) * side.beta_unit // compensator.beta_denominator for table in (law, zero)]
        assert side.nodes[2 * NODE_MASK :] == (*fallback, *fallback)
        assert (side.span, side.room) == (signals.command.span(sign), side.span - compensator.zero_band_codes)
