"""Every input of the compiled core against the exactly rounded law, and the properties that make it safe.

At zero command also what it does above the tested pressure drops, against what the certificate says of it there, and of
a lot setting against every valve of its lot: the integers that the core gives are the same, one a difference of codes.
Both are argued from valve.json again; nothing is taken of how the table was made.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from fractions import Fraction
from math import ceil, floor
from pathlib import Path

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_setting import NAMED
from dzdesign.design.lot_valves import LotSide
from dzdesign.identify.valve.guard_curve import AboveTests
from dzdesign.verify import requirements
from dzdesign.verify.closed_loop.ramps import Curves, zero_command_name
from dzdesign.verify.evidence import AboveCheck, InputCheck, InputCounts, LotCheck, OutputChecks, TriedInputs
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences, PreparedInputs
from dzdesign.verify.exhaustive.zero_command import (
    bounds_at,
    counted_dither,
    guarded_bounds,
    margins_of_drives,
    pressure_drops,
    zero_command_margins,
)
from dzdesign.verify.folder import read_compensator
from dzdesign.verify.requirements import ABOVE_TESTS, LOT, Check
from dzdesign.verify.toolchain.compiled_core import CompiledCore, Findings

#: Place of the requirement on what lies above the tests.
AFTER_ZERO_COMMAND = 3


def check_all_inputs(folder: Path, sign: int = 1, compensator: Compensator | None = None) -> InputCheck:
    """Compare one side of the compiled core with the exact law on every pair of command and pressure difference.

    The core has three inputs, 2^36 triples of 12 bits; it may depend on the two pressures by their difference only.
    That is itself checked. At each difference the commands take the pairs of pressures that make it in turn, so that
    every input is tried once, and with it every pair of sound pressure codes of which there are no more than commands;
    at zero command, where it matters most, all pairs that the law follows are tried, and all that are not sound.

    A core that does not compile, crashes or hangs is a `RequirementError`.
    """
    return every_input(folder, sign, compensator or read_compensator(folder))[0]


def every_input(folder: Path, sign: int, compensator: Compensator) -> tuple[InputCheck, dict[str, Curves]]:
    """Return what the comparison of every input found, and its numbers to be drawn; see `check_all_inputs`."""
    prepared = PreparedInputs(ExactLaw(compensator, sign))
    core = CompiledCore(folder, sign)
    found = core.check(prepared.everything())
    return input_check(prepared, core.sha256, found), drives_at_zero(prepared, found.at_zero)


def input_check(prepared: PreparedInputs, core_sha256: str, found: Findings) -> InputCheck:
    """Return what was found of a core, with the bound at zero command."""
    exact, differences = prepared.exact, prepared.differences
    (margin,) = zero_command_margins(exact, differences, found.at_zero, [guarded_bounds(exact.compensator, exact.sign)])
    if margin is None:
        raise RequirementError("no pair of valid pressure codes makes a tested pressure drop, so no bound is known")
    return InputCheck(
        sign=1 if exact.sign > 0 else -1,
        side=exact.side,
        over_compensated=margin.exceeded,
        smallest_margin_V=float(margin.margin_V),
        core_sha256=core_sha256,
        object_sha256=found.object_sha256,
        outputs_hash=found.outputs_hash,
        pressure_pairs=differences.pairs,
        first_wrong=first_wrong(prepared, found),
        above=check_above(exact, differences, found.at_zero),
        lot=check_lot(exact, differences, found.at_zero),
        **{field.name: getattr(found, field.name) for field in fields(InputCounts)},
    )


def first_wrong(prepared: PreparedInputs, found: Findings) -> str | None:
    """Return the first wrong value in words, or None."""
    if not found.wrong:
        return None
    what = f"compare value {found.first_found}, expected {found.first_expected}"
    if found.first_found == found.first_expected:
        what = f"the drive's outputs or status, or dz_comp(), do not agree with compare value {found.first_found}"
    return (
        f"command code {prepared.code_at(found.first_place)}, pressure-difference code "
        f"{prepared.differences.values[found.first_row]}: {what}"
    )


def input_checks(inputs: InputCheck, units: RecordedUnits, *, both_signs: bool) -> list[Check]:
    """Return one requirement for each property that was compared; where there are two sides each says which."""
    margin = units.text(1e3 * inputs.smallest_margin_V, ".3f mV")
    found = (
        (
            requirements.EXACT_LAW,
            inputs.wrong,
            f"{inputs.inputs} inputs checked, {inputs.wrong} wrong"
            + (f" ({inputs.first_wrong})" if inputs.first_wrong else "")
            + f"; hash of all compare values {inputs.outputs_hash}, object {inputs.object_sha256}",
        ),
        (
            requirements.MONOTONE,
            inputs.out_of_range + inputs.not_monotone_in_u + inputs.not_monotone_in_dp,
            f"{inputs.out_of_range} values out of range, {inputs.not_monotone_in_u} falls with rising command, "
            f"{inputs.not_monotone_in_dp} steps in the wrong direction with dP",
        ),
        (
            requirements.ZERO_COMMAND,
            inputs.over_compensated,
            (
                "the output at zero command lies above the threshold's lower bound at "
                f"{inputs.over_compensated} pressure code{'s' if inputs.over_compensated > 1 else ''}"
                if inputs.over_compensated
                else "at every pressure code of the tests the output at zero command stays below the threshold's lower "
                "bound"
            )
            + f"; smallest margin of the C code's output {margin}",
        ),
        (
            requirements.PRESSURE_DIFFERENCE,
            inputs.odd_pairs,
            f"{inputs.odd_pairs} of {inputs.pressure_pairs} pairs of pressure codes differ (all at zero command; other "
            "commands take those of a difference in turn)",
        ),
        (
            requirements.FALLBACK,
            inputs.bad_fallbacks + inputs.bad_status + inputs.bad_betas,
            f"{inputs.bad_fallbacks} such codes without the safe value, {inputs.bad_status} wrong status "
            f"words, {inputs.bad_betas} wrong values of dz_beta()",
        ),
    )
    sign = f"{inputs.side} commands: " if both_signs else ""
    checks = [each.check(name=sign + each.title, holds=faults == 0, text=text) for each, faults, text in found]
    checks.insert(AFTER_ZERO_COMMAND, above_checked(inputs, units, sign))
    return checks


def core_checks(folder: Path, compensator: Compensator, sign: int) -> OutputChecks:
    """Try every input of one side of the C code that an output carries."""
    prepared, core = PreparedInputs(ExactLaw(compensator, sign)), CompiledCore(folder, sign)
    try:
        found = input_check(prepared, core.sha256, core.check(prepared.everything()))
    except RequirementError as error:
        return OutputChecks(checks=(requirements.EXACT_LAW.check(holds=False, text=str(error)),))
    both = len(compensator.signals.signs) > 1
    checks = input_checks(found, compensator.valve.recorded_units, both_signs=both)
    name, digest = f"core/{core.name}", found.outputs_hash
    tried = TriedInputs(
        name=f"{name}: codes, {found.side} commands", inputs=found.inputs, wrong=found.wrong, outputs_hash=digest
    )
    return OutputChecks(checks=tuple(replace(each, name=f"{name}: {each.name}") for each in checks), inputs=(tried,))


def check_above(exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> AboveCheck:
    """Compare the drive at zero command above the tests with its bound, with the last test's offset, and with none."""
    compensator, certificate = exact.compensator, exact.compensator.side(exact.sign).certificate
    last, unit_V = certificate.dp_MPa[1], exact.compensator.u_max_V / exact.compare_max
    continued = _continued(compensator, exact)
    ends = {last, certificate.holds_to_MPa} | {Fraction(repr(dp)) for dp in (continued.dp_MPa if continued else ())}
    drops = pressure_drops(exact, found, ends)
    # A code's middle is a whole number of steps: what it is compared with is brought to codes, exactly.
    codes, step_MPa = found.values, exact.ahead.per_code_MPa
    above = drops.made & (codes > floor(last / step_MPa))
    curve = compensator.valve.sides[exact.side].certified[certificate.guard]
    most = floor(Fraction(repr(curve.offset_V[-1])) / unit_V)
    margin, exceeded = None, 0
    if continued is not None and certificate.holds_to_MPa > last:
        held = above & (codes <= floor(certificate.holds_to_MPa / step_MPa)) & (at_zero > 0)
        at_peak = at_zero + counted_dither(compensator)
        (known,) = margins_of_drives(replace(drops, made=held), at_peak, unit_V, [_as_tests(continued)])
        margin, exceeded = (None, 0) if known is None else (float(known.margin_V), known.exceeded)
        # What lies behind the last node is under no bound, so only no drive at all holds there.
        exceeded += int(np.sum(held & (codes > floor(Fraction(repr(continued.dp_MPa[-1])) / step_MPa))))
    side = compensator.side(exact.sign)
    let_go = floor(side.u_min0_over_u_max * exact.compare_max / compensator.beta_denominator + Fraction(1, 2))
    released = certificate.released_from_MPa
    not_released = 0
    if released is not None:
        not_released = int(np.sum(above & (codes >= ceil(released / step_MPa)) & (at_zero > let_go)))
    return AboveCheck(
        choice=compensator.above,
        certified_to_MPa=float(certificate.holds_to_MPa) if certificate.holds_to_MPa > last else None,
        released_from_MPa=None if released is None else float(released),
        codes=int(above.sum()),
        over_compensated=exceeded,
        smallest_margin_V=margin,
        rising=int(np.sum(above & (at_zero > most))),
        not_released=not_released,
    )


def _continued(compensator: Compensator, exact: ExactLaw) -> AboveTests | None:
    """Return the certified bound above the tests; None where there is none, and where the offset is held."""
    guard = compensator.side(exact.sign).certificate.guard
    continued = compensator.valve.sides[exact.side].certified[guard].above
    return continued if continued is not None and continued.certified and compensator.above != "hold" else None


def _as_tests(continued: AboveTests) -> LotSide:
    """Return the nodes of a continued bound as bounds at tests."""
    return LotSide(
        trend=None, confidence=1.0, tested_MPa=continued.dp_MPa, dp_MPa=continued.dp_MPa, u_lower_V=continued.u_lower_V
    )


def above_checked(inputs: InputCheck, units: RecordedUnits, sign: str) -> Check:
    """Tell whether the drive above the tests is what the certificate says; `sign` says whose where there are two."""
    above = inputs.above
    faults = above.over_compensated + above.rising + above.not_released
    parts = [f"--above {above.choice}: {above.codes} pressure codes lie above the tests"]
    if above.certified_to_MPa is None:
        parts.append("nothing is certified there")
    else:
        margin = "" if above.smallest_margin_V is None else (
            f" (smallest margin of the C code's compare values {units.text(1e3 * above.smallest_margin_V, '.3f mV')})"
        )
        parts.append(
            f"up to {units.text(above.certified_to_MPa, '.3g MPa')}, {above.over_compensated} exceed the bound that "
            f"the curve's premise continues{margin}"
        )
    parts.append(f"{above.rising} exceed the certified offset of the last test")
    if above.released_from_MPa is not None:
        at = units.text(above.released_from_MPa, ".3g MPa")
        parts.append(f"the offset is released from {at}, with {above.not_released} exceptions")
    return ABOVE_TESTS.check(name=sign + ABOVE_TESTS.title, holds=faults == 0, text="; ".join(parts))


def check_lot(exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> LotCheck | None:
    """Compare the drive at zero command with the bounds of every valve of the lot; None of a valve's own setting."""
    lot = exact.compensator.lot
    if not lot:
        return None
    bounds = []
    for valve in lot:
        side = valve.side(exact.sign)
        if side is None:
            raise InputError(
                f"'{valve.name}' of the lot has no bounds of the {exact.side} side; run `dzdesign batch` again"
            )
        bounds.append(side)
    margins = zero_command_margins(exact, found, at_zero, bounds)
    names = [valve.name for valve in lot]
    ordered = sorted(
        ((margin.margin_V, name, margin.dp_MPa) for name, margin in zip(names, margins, strict=True) if margin),
        key=lambda each: each[:2],
    )
    worst_V, worst, worst_dp_MPa = ordered[0]
    confidence = [side.confidence for side in bounds]
    return LotCheck(
        valves=len(ordered),
        over_compensated=tuple(name for margin, name, _ in ordered if margin < 0),
        worst=worst,
        worst_dp_MPa=worst_dp_MPa,
        smallest_margin_V=float(worst_V),
        confidence=(min(confidence), max(confidence)),
    )


def lot_checked(inputs: Sequence[InputCheck], compensator: Compensator) -> list[Check]:
    """Tell whether the core of a lot setting over-compensates any valve of its lot; nothing of a valve's own."""
    count, units = len(compensator.lot), compensator.valve.recorded_units
    found = [each.lot for each in inputs if each.lot is not None]
    if not found:
        return []
    worst = min(found, key=lambda each: each.smallest_margin_V)
    least, most = (f"{100 * ends:.6g}" for ends in worst.confidence)
    over = list(dict.fromkeys(name for each in found for name in each.over_compensated))
    text = (
        f"{min(each.valves for each in found)} of {count} valves, each at every difference of pressure codes that it "
        f"was tested over, against its own bounds ({least if least == most else f'{least} to {most}'} % for each): "
        f"{len(over)} over-compensated" + (f": {and_more(over, NAMED)}" if over else "") + "; smallest margin of the "
        f"C code's compare values {units.text(1e3 * worst.smallest_margin_V, '.3f mV')}: {worst.worst}, "
        f"{units.text(worst.worst_dp_MPa, '.2f MPa')}"
    )
    all_there = all(each.valves == count for each in found)
    return [LOT.check(holds=not over and all_there, text=text)]


def drives_at_zero(prepared: PreparedInputs, at_zero: np.ndarray) -> dict[str, Curves]:
    """Return what one side of the core gives at zero command, by the file's name, to be drawn.

    At every difference of the tested interval: its code, pressure drop, the drive with a dither's peak that the
    recordings lack, and the lower bound of the threshold. `at_zero` are the compare values that the check of all inputs
    found there.
    """
    exact, found = prepared.exact, prepared.differences
    compensator, bounds = exact.compensator, guarded_bounds(exact.compensator, exact.sign)
    known_V = bounds_at(pressure_drops(exact, found, (Fraction(repr(dp)) for dp in bounds.dp_MPa)), bounds)
    tested = np.flatnonzero(~np.isnan(known_V))
    a_MPa = float(exact.ahead.per_code_MPa)
    volt = float(compensator.u_max_V) / exact.compare_max
    return {
        zero_command_name(exact.side): {
            "dp_code": found.values[tested],
            "dp_MPa": (found.values[tested] * a_MPa).round(4),
            "drive_V": ((at_zero[tested] + counted_dither(compensator)) * volt).round(5),
            "bound_V": known_V[tested].round(5),
        },
    }
