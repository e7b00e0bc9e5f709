"""Every operation of the function at every pressure difference and every corner of the command: is it in range?

Between corners of the command each value is straight in it, so none reaches further than at these. The compare values
that come of it are compared with the exact law, too: a reading of the text that needs no Octave.
"""

from fractions import Fraction

import numpy as np

from dzdesign.core.errors import InputError, and_more
from dzdesign.verify.exhaustive.exact_law import Betas, ExactLaw
from dzdesign.verify.exhaustive.test_vectors import OUTSIDE, PreparedInputs
from dzdesign.verify.matlab.evaluator import Evaluator, Value
from dzdesign.verify.matlab.parser import parse_body
from dzdesign.verify.matlab.subset import ReadFunction
from dzdesign.verify.requirements import MATLAB_RANGES, Check


def operations_check(function: ReadFunction, prepared: PreparedInputs) -> Check:
    """Tell whether an operation leaves its class, and whether the text as it is read here is the exact law."""
    source = f"{function.name}.m"
    name = f"{source}: {MATLAB_RANGES.title}"
    codes, expected = corner_inputs(prepared)
    try:
        evaluator = evaluated(function, codes)
        found = evaluator.values["compare"].data
    except (InputError, KeyError) as error:
        return MATLAB_RANGES.check(holds=False, text=f"{source} can't be evaluated: {error}", name=name)
    wrong = int(np.count_nonzero(np.broadcast_to(found, expected.shape) != expected))
    text = f"{evaluator.operations} operations, each at {len(codes)} inputs, {len(evaluator.faults)} beyond their class"
    if evaluator.faults:
        text += f" ({and_more(evaluator.faults, 1)})"
    text += f"; {wrong} compare values that are not the exact law's, as the text is read here"
    return MATLAB_RANGES.check(holds=not evaluator.faults and wrong == 0, text=text, name=name)


def evaluated(function: ReadFunction, codes: np.ndarray) -> Evaluator:
    """Return the run of a function over codes, (N, 3)."""
    columns = dict(zip(function.inputs, codes.T, strict=True))
    values = {name: Value("int32", column.astype(object)) for name, column in columns.items()}
    counts = {"nargin": 3, "nargout": 3}
    values |= {name: Value("double", np.array([count], dtype=object)) for name, count in counts.items()}
    evaluator = Evaluator(source=f"{function.name}.m", values=values)
    evaluator.run(parse_body(function, evaluator.source))
    return evaluator


def corner_inputs(prepared: PreparedInputs) -> tuple[np.ndarray, np.ndarray]:
    """Return codes, (N, 3), and the exact compare value of each, (N,).

    Commands are the corners of the law, their neighbours and the ends of 16 bits; pressures one pair for each
    difference, and some that are not valid.
    """
    exact, differences = prepared.exact, prepared.differences
    commands = np.array(_commands(exact))
    made = np.flatnonzero(differences.made)
    b = differences.b_first[made]
    pressures = np.stack([exact.turn * differences.values[made] + differences.slant[b], b], axis=1)
    betas = exact.beta_numerators(differences.values[made])
    failed = np.array(
        [(a, b) for a in (0, exact.a.valid_codes[1] + 1, OUTSIDE) for b in (0, exact.b.zero_code, OUTSIDE)]
    )
    failed = failed[[not _valid(exact, *pair) for pair in failed]]
    least = exact.beta_numerators(np.full(len(failed), -exact.reverse - 1))
    law, zero = (np.concatenate([getattr(each, key) for each in (betas, least)]) for key in ("law", "zero"))
    pairs = np.concatenate([pressures, failed])
    codes = np.column_stack([np.tile(commands, len(pairs)), np.repeat(pairs, len(commands), axis=0)])
    return codes, _expected(exact, commands, law, zero, betas.denominator)


def _commands(exact: ExactLaw) -> list[int]:
    """Return codes at and beside the corners of the law, the ends of what is valid, and those of 16 bits."""
    corners = {0, exact.zero_band, exact.transition_end, exact.span}
    ends = {exact.zero + exact.along * corner for corner in corners} | {
        exact.sound_commands[0],
        exact.sound_commands[-1],
    }
    near = {end + by for end in ends for by in (-1, 0, 1)} | {0, OUTSIDE}
    return sorted(code for code in near if 0 <= code <= OUTSIDE)


def _valid(exact: ExactLaw, a: int, b: int) -> bool:
    pairs = ((a, exact.a.valid_codes), (b, exact.b.valid_codes))
    return all(low <= code <= high for code, (low, high) in pairs)


def _expected(exact: ExactLaw, commands: np.ndarray, law: np.ndarray, zero: np.ndarray, denominator: int) -> np.ndarray:
    """Return the exact compare values, all commands of a pair of betas one after the other."""
    known: dict[tuple[int, int], list[int]] = {}
    for pair in set(zip(law.tolist(), zero.tolist(), strict=True)):
        corners = exact.corners(Betas(*(Fraction(numerator, denominator) for numerator in pair)))
        known[pair] = [
            exact.compare_value(code, corners) if code in exact.sound_commands else 0 for code in commands.tolist()
        ]
    return np.array([known[pair] for pair in zip(law.tolist(), zero.tolist(), strict=True)]).ravel()
