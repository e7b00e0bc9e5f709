"""Sections on the compensator: its law in exact numbers, the integers of the C code and what they cost."""

from collections.abc import Iterator
from fractions import Fraction

from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareConstant, FirmwareManifest
from dzdesign.design.offset.above_tests import above_in_words, below_in_words
from dzdesign.report.compensator_sides import laws_of
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.figures.law import law_figure
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, recorded, table_of

#: Rows of a constant's table that stand in the page; all of them stand in the CSV.
MOST_ROWS = 3
BELOW_DP0 = {"hold": "β = 1, as in the paper", "extend": "β as tested"}


def law_section(compensator: Compensator | None) -> Section:
    """Return the section on the law; its derivation is added by the page."""
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json.")
    laws, valve = laws_of(compensator), compensator.valve
    lines = [f"Up to dP0: {BELOW_DP0[compensator.below_dp0]}."]
    for name, side in laws.items():
        kappa, u_min0 = side.drive_range_over_u_max, side.u_min0_over_u_max
        lines.append(
            f"{name.capitalize()} commands: drive range of the law k x_max/u_max = {_exact(kappa)}, from "
            f"{side.start} to full output; the valve's, {valve.sides[name].k_x_max_over_u_max:.4f}, counts from the "
            f"knee; u_min0/u_max at dP0 = {_exact(u_min0)}, both as shares of full command; β is straight "
            f"between {len(side.beta)} nodes, {compensator.beta_step_codes} pressure codes apart, each a "
            f"whole number of 1/{compensator.beta_denominator}."
        )
        which = f"{name} commands: " if len(laws) > 1 else ""
        units = valve.recorded_units.of_side(name)
        lines.append(f"Beyond the tests, {which}{below_in_words(side.certificate, valve.sides[name], units)}.")
        beyond = above_in_words(compensator.above, side.certificate, valve.sides[name], units)
        lines.append(f"Beyond the tests, {which}{beyond}.")
    return Section(figures=tuple(law_figure(compensator, name, len(laws) > 1) for name in laws), lines=tuple(lines))


def _exact(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.5f}"


def integers_section(firmware: FirmwareManifest | None, compensator: Compensator | None) -> Section:
    """Return the section on the integers of the C code."""
    tables = (rounding_table(compensator),) if compensator else ()
    if firmware is None:
        return Section(tables=tables, missing="No firmware is here: `dzdesign codegen` makes it, and its constants.")
    return Section(tables=(*tables, constants_table(firmware)))


def constants_table(firmware: FirmwareManifest) -> Table:
    """Return every number in the C code: what it stands for, how it was rounded and where it comes from."""
    return table_of(
        "Every number in the core, in the order of the files",
        firmware.constants,
        ("symbol", lambda one: Cell(text=one.symbol, kind="symbol", more=one.file)),
        ("value", _value),
        ("in engineering units", lambda one: Cell(text=one.engineering, more=f"rounding: {one.rounding}")),
        ("what it is", lambda one: one.equation),
        ("where it comes from", lambda one: Cell(text="", more=_origin(one))),
        csv=csv_text(
            ("file", "symbol", "row", "value", "engineering", "rounding"),
            (
                (each.file, each.symbol, place, item, each.engineering, each.rounding)
                for each in firmware.constants
                for place, item in _rows(each)
            ),
        ),
        name="constants",
    )


def _value(constant: FirmwareConstant) -> str:
    if isinstance(constant.value, int):
        return str(constant.value)
    rows = ", ".join(str(list(row)) for row in constant.value[:MOST_ROWS])
    return f"{len(constant.value)} rows: {rows}{', ...' if len(constant.value) > MOST_ROWS else ''}"


def _rows(constant: FirmwareConstant) -> Iterator[tuple[int | None, str]]:
    if isinstance(constant.value, int):
        yield None, str(constant.value)
        return
    for place, row in enumerate(constant.value):
        yield place, " ".join(map(str, row))


def _origin(constant: FirmwareConstant) -> str:
    if constant.valve_json:
        return f"valve: {', '.join(constant.valve_json)}"
    options = ", ".join(constant.compensator_json)
    return f"option of design: {options}" if options else "the generator's own"


def rounding_table(compensator: Compensator) -> Table:
    """Return what turning the law into integers costs."""
    u_max, units = compensator.u_max_V, compensator.valve.recorded_units
    rows: list[tuple[str, str, str, float]] = []
    for name, side in laws_of(compensator).items():
        certificate = side.certificate
        offset = side.u_min0_over_u_max * u_max
        node = offset / compensator.beta_denominator
        of = f" ({name})" if len(laws_of(compensator)) > 1 else ""
        if not compensator.transition_codes:  # which counts from the opening threshold, the valve's curve does not
            wanted = Fraction(repr(compensator.valve.sides[name].certified[certificate.guard].u_min0_V))
            in_c, exact = (units.of_side(name).text(float(value), ".6f V") for value in (offset, wanted))
            rows.append(("u_min0" + of, in_c, exact, 1e3 * float(offset - wanted)))
        rows += [
            ("one step of a node of β" + of, f"1/{compensator.beta_denominator}", "rounded down", -1e3 * float(node)),
            (
                "offset under the certified curve, mean" + of, "few nodes, rounding to codes and to counts",
                f"largest {units.text(1e3 * certificate.largest_loss_V, '.2f mV')}", -1e3 * certificate.mean_loss_V,
            ),
        ]  # fmt: skip
    half_count = u_max / compensator.signals.compare_max / 2
    rows.append(("compare value", "a whole count", "half a count", 1e3 * float(half_count)))
    return table_of(
        "What the integers cost",
        rows,
        ("number", lambda row: row[0]),
        ("in the C code", lambda row: row[1]),
        ("exact, or what is done", lambda row: row[2]),
        (f"difference, at most ({units.label('mV')})", lambda row: recorded(row[3], "+.3f mV", units)),
    )
