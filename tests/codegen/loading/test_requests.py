"""A drive's answers to single requests, rule by rule, and that faults seeded in its C are found."""

import random
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from dzdesign.codegen.loading.protocol import Frame, Request
from tests.support.loading.bench import HERE
from tests.support.loading.exchanges import any_frame
from tests.support.loading.files import COMPILER, drive_files
from tests.support.loading.request_checks import CHECKS
from tests.support.loading.seeded_faults import FAULTS, is_found

SMALL = HERE / "small"


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_rule(bench, check):
    check(bench.drive)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILER, reason="no C compiler (cc, gcc or clang) on the path")
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.file)
def test_a_seeded_fault_is_found(fault, tmp_path):
    assert is_found(fault, tmp_path, exchanges=3)


def stream() -> bytes:
    """Two loads of a small block with cut and doubled frames, and hostile ones around them: what a drive gets."""
    rng, words = random.Random(24), 80

    def hostile() -> bytes:
        return b"".join(any_frame(rng, words).octets() + rng.randbytes(rng.randrange(4)) for _ in range(4))

    def frame(request: int, number: int, payload: bytes) -> bytes:
        return Frame(type=request, sequence=number, payload=payload).octets()

    sent = hostile()
    for number in (1, 2):
        block = bytearray(rng.randbytes(2 * words))
        block[6:8], block[40:42] = words.to_bytes(2, "little"), number.to_bytes(2, "little")
        crc, origin = block[:-5:-1], block[8:12]
        sent += frame(Request.BEGIN, 7, words.to_bytes(2, "big") + crc + origin)
        for at, sequence in ((0, 8), (32, 9), (64, 10)):
            piece = frame(Request.DATA, sequence, at.to_bytes(2, "big") + block[2 * at : 2 * at + 64])
            sent += piece[:20] + piece + piece + piece  # the cut one takes the next one's octets
        sent += frame(Request.COMMIT, 11, bytes(crc)) + frame(Request.QUERY, 12, b"") + hostile()
    return sent


@pytest.mark.skipif(not (shutil.which("avr-gcc") and shutil.which("simavr")), reason="no avr-gcc or no simavr")
def test_it_does_the_same_where_int_has_16_bits(tmp_path):
    ours = {name: text for name, text in drive_files().items() if not name.startswith("dz_calibration")}
    ours["stream.h"] = f"""#include <stdint.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#else
#define PROGMEM
#endif
static const uint8_t stream[] PROGMEM = {{{", ".join(map(str, stream()))}}};
"""
    for name, text in ours.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    sources = [*sorted(map(str, tmp_path.glob("*.c"))), str(SMALL / "exchange.c")]
    found = {}
    for compiler, options in (
        (COMPILER, ["-Wno-unused-variable"]),
        ("avr-gcc", ["-mmcu=atmega1280", "-DF_CPU=16000000UL", "-Wno-format"]),
    ):
        program = tmp_path / f"{Path(compiler).name}.elf"
        command = [compiler, "-std=gnu99", "-Os", "-Wall", "-Wextra", "-Werror", *options]
        command += [f"-I{tmp_path}", f"-I{SMALL}", *sources, "-o", str(program)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        run = ["simavr", "-m", "atmega1280", "-f", "16000000", program] if compiler == "avr-gcc" else [program]
        done = subprocess.run(run, capture_output=True, text=True, check=True, timeout=60)
        printed = re.sub(r"\x1b\[\d+m", "", done.stdout + done.stderr)  # simavr colours what it echoes
        found[compiler] = re.findall(r"^(?:[0-9A-F]{8,}|use \d+|used .* end)", printed, re.MULTILINE)
    assert found["avr-gcc"] == found[COMPILER]
    assert [line for line in found[COMPILER] if line.startswith("use")] == ["use 1", "use 2", found[COMPILER][-1]]
    assert found[COMPILER][-1].startswith("used 1 ")
