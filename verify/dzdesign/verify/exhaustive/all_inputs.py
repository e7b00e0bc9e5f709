"""Every input of the compiled core against the exactly rounded law, and the properties that make it safe."""

from dataclasses import fields
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.verify import requirements
from dzdesign.verify.closed_loop.ramps import Curves
from dzdesign.verify.evidence import InputCheck, InputCounts
from dzdesign.verify.exhaustive.above_tests import above_checked, check_above
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.input_map import map_inputs
from dzdesign.verify.exhaustive.lot_check import check_lot
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.exhaustive.zero_command import guarded_bounds, zero_command_margins
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.requirements import Check
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
    return input_check(prepared, core.sha256, found), map_inputs(folder, prepared, found.at_zero)


def input_check(prepared: PreparedInputs, core_sha256: str, found: Findings) -> InputCheck:
    """Return what was found of a core, with the bound at zero command."""
    exact, differences = prepared.exact, prepared.differences
    (margin,) = zero_command_margins(exact, differences, found.at_zero, [guarded_bounds(exact.compensator, exact.sign)])
    if margin is None:
        raise RequirementError("no pair of valid pressure codes makes a tested pressure drop, so no bound is known")
    return InputCheck(
        sign=1 if exact.sign > 0 else -1,
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
    return (
        f"command code {prepared.code_at(found.first_place)}, pressure-difference code "
        f"{prepared.differences.values[found.first_row]}: compare value {found.first_found}, "
        f"expected {found.first_expected}"
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
            f"{inputs.odd_pairs} of {inputs.pressure_pairs} pairs of pressure codes differ (the commands of each "
            "difference use its pairs in turn; zero command uses all pairs that the law follows or that lie outside "
            "the sensors' valid range)",
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
