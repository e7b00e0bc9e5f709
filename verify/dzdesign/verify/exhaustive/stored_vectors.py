"""The test vectors beside a firmware against the exactly rounded law: every row of vectors.csv, of both signs.

What the generator has them from is not read here: the same law, from the rationals of compensator.json by other code.
"""

import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache
from math import floor
from pathlib import Path

import numpy as np

from dzdesign.core.errors import quoted
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import VECTORS_NAME, FirmwareManifest
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.requirements import VECTORS, Check

INPUTS = "u_adc,p_a_adc,p_b_adc"
OF_POSITIVE = "compare_counts,status_bits,beta_x_32768"
OF_NEGATIVE = "compare_negative_counts,status_negative_bits,beta_negative_x_32768"
#: Bits of the status.
COMMAND, PRESSURE_A, PRESSURE_B, DIFFERENCE, ABOVE = 1, 2, 4, 8, 16
#: A row: whole numbers of 16 bits as C reads them, without sign, blank or zero before.
ROW = re.compile(r"(?:0|[1-9]\d{0,4})(?:,(?:0|[1-9]\d{0,4}))*", re.ASCII)
Answer = Callable[[int, int, int], tuple[int, int, int]]


def vectors_follow(folder: Path, manifest: FirmwareManifest, compensator: Compensator) -> tuple[Check, ...]:
    """Tell whether every test vector is what the exact law gives; nothing where a firmware has none."""
    if VECTORS_NAME not in manifest.files and not manifest.vectors:
        return ()
    path = folder / VECTORS_NAME
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else []
    if fault := next(_faults(lines, manifest.vectors, compensator), ""):
        return (VECTORS.check(holds=False, text=f"{fault}; make the firmware again with `dzdesign codegen`"),)
    text = f"{len(lines) - 1} rows of {VECTORS_NAME}, every value equals the exactly rounded law"
    return (VECTORS.check(holds=True, text=text),)


def _faults(lines: list[str], count: int, compensator: Compensator) -> Iterator[str]:
    """Yield what is wrong with the table, line by line."""
    signs = compensator.signals.signs
    header = ",".join((INPUTS, OF_POSITIVE, OF_NEGATIVE)[: 1 + len(signs)])
    if not lines or lines[0] != header:
        yield f"{VECTORS_NAME}: line 1 is {quoted(lines[0] if lines else '')}, expected the columns {header}"
        return
    if len(lines) - 1 != count:
        yield f"{VECTORS_NAME} has {len(lines) - 1} rows, the manifest says {count}"
    answers = [exact_answer(ExactLaw(compensator, sign)) for sign in signs]
    for place, line in enumerate(lines[1:], start=2):
        values = tuple(map(int, line.split(","))) if ROW.fullmatch(line) else ()
        if len(values) != 3 + 3 * len(signs):
            yield f"{VECTORS_NAME}: line {place} is {quoted(line)}, expected {3 + 3 * len(signs)} whole numbers"
            return
        expected = tuple(value for answer in answers for value in answer(*values[:3]))
        if values[3:] != expected:
            yield f"{VECTORS_NAME}: line {place} has {values[3:]} for the codes {values[:3]}, expected {expected}"


def exact_answers(compensator: Compensator) -> Callable[[int, np.ndarray], np.ndarray]:
    """Return what the exact law gives for codes of one sign (N, 3): compare value and status (N, 2)."""

    def answers(sign: int, codes: np.ndarray) -> np.ndarray:
        answer = exact_answer(ExactLaw(compensator, sign))
        return np.array([answer(*map(int, row))[:2] for row in codes])

    return answers


def exact_answer(exact: ExactLaw) -> Answer:
    """Return the law of one sign: compare value, status and beta over 2^15 of any three codes."""
    (a_low, a_high), (b_low, b_high) = exact.a.valid_codes, exact.b.valid_codes

    @cache
    def at_drop(drop: int) -> tuple[list[tuple[int, Fraction]], int]:
        betas = exact.betas(drop)
        return exact.corners(betas), floor(betas.law * 2**15)

    def answer(u: int, a: int, b: int) -> tuple[int, int, int]:
        status = COMMAND * (u not in exact.sound_commands)
        status |= PRESSURE_A * (not a_low <= a <= a_high) | PRESSURE_B * (not b_low <= b <= b_high)
        drop = -exact.reverse - 1  # of pressures that can't be right
        if not status & (PRESSURE_A | PRESSURE_B):
            drop = int(exact.difference(np.array(a), np.array(b)))
            status |= DIFFERENCE * (drop < -exact.reverse) | ABOVE * (drop > exact.tested_to)
        corners, beta = at_drop(drop)
        return (0 if status & COMMAND else exact.compare_value(u, corners)), status, beta

    return answer
