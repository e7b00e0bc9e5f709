"""What stands in each section of the report of a lot: sentences, figures and tables."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import astuple, fields, replace

from dzdesign.core.errors import and_more
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.firmware_manifest import setting_words
from dzdesign.report.cells import (
    Cell,
    Table,
    counted,
    finding,
    from_to,
    in_number_font,
    number,
    recorded,
    table_of,
    whole,
)
from dzdesign.report.figure import ReportFigure, csv_text
from dzdesign.report.lot.folder import Lot, Row
from dzdesign.report.lot.spread import EXTRA, FAR, FEWEST, QUANTITIES, Quantity, Spread, short, spread_figure
from dzdesign.report.lot.summary import (
    DOES_NOT_HOLD,
    OK,
    VALVES,
    LotBudgetLine,
    LotOutput,
    LotSettingSummary,
    Quantiles,
    SettingOfOthers,
)
from dzdesign.report.lot.table import OUTPUT, OUTPUT_HASH, RECORD, TABLE, column_of, safe
from dzdesign.report.lot.words import checked_line, cost_lines, cost_text, span, untested_lines
from dzdesign.report.page import Section

#: Valves that a cell names, of an output fewer, and rows that a table has in the page; all of them stand in the CSV.
NAMED, OUTPUTS_NAMED, ROWS = 40, 20, 100
#: A lot of so many valves stands in the page with every row; of a larger one in which none lies far the first.
SMALL_LOT, FIRST = 50, 10
#: Characters of a table that the page holds: some 4000 valves.
EMBEDDED = 2_000_000
#: What differs between two reasons of one kind: names in quotes, and numbers; and what stands in its place.
PARTICULAR, GAP = re.compile(r"'[^']*'|\d+(?:\.\d+)?(?:e[+-]?\d+)?"), "…"
#: Figures of the spread and of what is left: name, columns of the quantities, caption, and whether on one scale.
FigureKind = tuple[str, tuple[str, ...], str, bool]
SPREAD_FIGURES: tuple[FigureKind, ...] = (
    (
        "thresholds",
        ("knee_opening_V", "knee_closing_V"),
        "Thresholds of the calibrated valves at dP0: the knee, where the straight part of the flow meets zero, on "
        "opening and on closing, on one scale; their distance is the hysteresis. Where names count up as the valves "
        "were measured, a slope or a step is a drift of the bench or of the production.",
        True,
    ),
    (
        "law",
        ("offset_V", "k_x_max_over_u_max", "beta_at_highest_dp"),
        "What the laws of the valves differ in: the offset at dP0, which lies under the threshold's bound; the drive "
        "range k x_max/u_max from the threshold to full flow; β at the highest tested pressure drop.",
        False,
    ),
)
LEFT_FIGURE: FigureKind = (
    "left",
    ("dead_zone_opening_percent", "dead_zone_closing_percent"),
    "Dead zone that each valve's own compensator leaves, in per cent of command: at the pressure drop of its tests "
    "where it is largest.",
    True,
)


def sections_of(lot: Lot, spreads: Sequence[Spread]) -> dict[str, Section]:
    """Return every section by its anchor."""
    far = {name for spread in spreads for name, _ in spread.far()}
    none = Section(missing="No valve is calibrated.")
    sections = {
        "failed": _failed_section(lot),
        "spread": _spread_section(lot, spreads),
        "far": _far_section(spreads),
        "left": Section(figures=_figures(lot, spreads, LEFT_FIGURE)) if spreads else none,
        "setting": _setting_section(lot, spreads),
        "valves": Section(tables=(_valves_table(lot, far),)),
        "recordings": _recordings_section(lot),
        "warnings": Section(),
        "provenance": _provenance_section(lot),
    }
    if lot.summary.outputs:
        sections["outputs"] = Section(tables=(_outputs_table(lot.summary.outputs, lot.summary.verified),))
    return sections


def _figures(lot: Lot, spreads: Sequence[Spread], *kinds: FigureKind) -> list[ReportFigure | None]:
    """Return figures of each side, of those of their quantities that some valve has."""
    found = []
    for side in lot.sides:
        of, words = (f"-{side}", f" {side.capitalize()} commands.") if side else ("", "")
        of_side = {spread.quantity.column: spread for spread in spreads if spread.side == side}
        for name, columns, caption, one_scale in kinds:
            shown = [of_side[column] for column in columns if column in of_side]
            found.append(spread_figure(name + of, shown, caption + words, one_scale=one_scale))
    return found


# --- valves that are not calibrated -------------------------------------------------------------------------


def _failed_section(lot: Lot) -> Section:
    failed = list(lot.failed.iter_rows(named=True))
    if not failed:
        return Section(lines=("Every valve that was tried is calibrated.",) if len(lot.frame) else ())
    kinds: dict[tuple[str, str], list[Row]] = {}
    for row in failed:
        kinds.setdefault((row["status"], PARTICULAR.sub(GAP, row["reason"])), []).append(row)
    groups = [_group(status, rows) for (status, _), rows in sorted(kinds.items(), key=lambda one: -len(one[1]))]
    table = table_of(
        "Why valves are not calibrated, by kind of reason",
        groups,
        ("status", lambda group: _failed(group[0])),
        ("valves", lambda group: in_number_font(whole(len(group[3])))),
        ("what is wrong", lambda group: finding(group[1])),
        ("what is expected, or to be done", lambda group: finding(group[2] or "–")),
        ("names", lambda group: and_more(group[3], NAMED)),
        csv=csv_text(
            ("name", "status", "reason"),
            ([safe(row[column]) for column in ("name", "status", "reason")] for row in failed),
        ),
        name="not-calibrated",
    )
    many, kind = counted(len(failed), "valve"), counted(len(groups), "kind")
    line = (f"{many}, {kind} of reason; what differs between the valves of a kind is … in the reason and stands behind "
            "the name.")  # fmt: skip
    return Section(lines=(line,), tables=(table,))


def _group(status: str, rows: Sequence[Row]) -> tuple[str, str, str, list[str]]:
    """Return valves with one kind of reason: status, what is wrong, what to do, and their names.

    A gap stands for what differs between the valves; what is particular to a valve stands behind its name.
    """
    reasons = [str(row["reason"]) for row in rows]
    found = [PARTICULAR.findall(reason) for reason in reasons]
    shared = [len(set(parts)) == 1 for parts in zip(*found, strict=True)]
    places = iter(shared)
    text = PARTICULAR.sub(lambda part: part[0] if next(places) else GAP, reasons[0])
    what, _, advice = text.rpartition("; ")
    if status == DOES_NOT_HOLD:
        what, advice = text, "see the report of the valve: a requirement of its verification is not met"
    elif text.startswith("unexpected "):
        what, advice = text, "a fault of dzdesign, not of the recordings: the next run tries the valve again"
    elif not what:  # nothing to be done is said, but what was expected
        what, expected, advice = text.partition(", expected ")
        advice = expected.removeprefix(", ") + advice
    names = []
    for row, parts in zip(rows, found, strict=True):
        own = dict.fromkeys(part.strip("'") for part, same in zip(parts, shared, strict=True) if not same)
        particular = ", ".join(part for part in own if part != row["name"])
        names.append(f"{row['name']} ({particular})" if particular else str(row["name"]))
    return status, what, advice, names


def _failed(status: str) -> Cell:
    return Cell(text=f"✗ {status}", kind="bad")


# --- how the calibrated ones scatter ------------------------------------------------------------------------


def _spread_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    if not spreads:
        return Section(missing="No valve is calibrated, so there is nothing to compare.")
    return Section(
        lines=tuple(_lot_lines(lot)),
        figures=_figures(lot, spreads, *SPREAD_FIGURES),
        tables=(_spread_table(spreads), _budget_table(lot)),
    )


def _lot_lines(lot: Lot) -> Iterator[str]:
    """Say at which pressure drops the numbers hold, and which way the thresholds move."""
    for side in lot.sides:
        of = f"{side.capitalize()} commands: " if side else ""
        columns = [column_of(side, column) for column in ("dp0_MPa", "highest_dp_MPa", "trend")]
        tested = lot.calibrated.select(columns).filter(lot.calibrated[columns[0]].is_not_null())
        if tested.is_empty():
            yield f"{of}no valve was tested."
            continue
        first, last, trends = (column.to_list() for column in tested)
        counts = Counter(trend or "not known" for trend in trends).most_common()
        words = ", ".join(f"{word} in {whole(count)}" for word, count in counts)
        dp0, highest = (
            from_to([None if one is None else lot.units.convert(one, "MPa") for one in known], ".3g")
            for known in (first, last)
        )
        unit = lot.units.label("MPa")
        yield (f"{of}dP0 is {dp0} {unit}, the highest tested pressure drop {highest} {unit}. Threshold over the "
               f"pressure drop: {words} valves.")  # fmt: skip


def _cell(quantity: Quantity, value: float | None, units: RecordedUnits) -> Cell:
    """Return a value of a quantity, in the unit of the recordings."""
    if quantity.unit == "V":
        return recorded(value, f".{quantity.digits}f V", units)
    return number(value, quantity.digits)


def _spread_table(spreads: Sequence[Spread]) -> Table:
    """Return quantiles of every quantity, with the names of the extreme valves."""

    def quantile(name: str, end: int | None = None) -> Callable[[Spread], Cell]:
        def cell(spread: Spread) -> Cell:
            value = _cell(spread.quantity, getattr(spread.at, name), spread.units)
            return value if end is None else replace(value, more=short(spread.ends[end]))

        return cell

    def deviation(spread: Spread) -> Cell:
        known, digits = spread.deviation if spread.limits else None, spread.quantity.digits + 1
        return recorded(known, f".{digits}f dV", spread.units) if spread.quantity.unit == "V" else number(known, digits)

    def csv_row(spread: Spread) -> list[object]:
        known = (round(spread.deviation, 7), len(spread.far())) if spread.limits else (None, None)
        return [spread.column, len(spread.values), *astuple(spread.at), *spread.ends, *known]

    names = [each.name for each in fields(Quantiles)]
    return table_of(
        "How the calibrated valves scatter",
        spreads,
        ("quantity", lambda spread: spread.heading),
        ("valves", lambda spread: in_number_font(whole(len(spread.values)))),
        ("least", quantile("least", 0)),
        ("5 %", quantile("q05")),
        ("median", quantile("median")),
        ("95 %", quantile("q95")),
        ("largest", quantile("largest", 1)),
        ("robust s.d.", deviation),
        ("far from the rest", lambda spread: in_number_font(whole(len(spread.far())) if spread.limits else "–")),
        csv=csv_text(
            ("quantity", "valves", *names, "least_is", "largest_is", "robust_sd", "far"), map(csv_row, spreads)
        ),
        name="spread",
    )


def _budget_table(lot: Lot) -> Table | None:
    """Return the components of all budgets; None where there are none."""
    lines = lot.summary.budget.lines if lot.summary.budget else ()
    if not lines:
        return None

    def price(place: int) -> Callable[[LotBudgetLine], Cell]:
        return lambda line: number(line.price_percent[place], 3)

    units = lot.units
    return table_of(
        "Uncertainty budgets of the valves: what each component takes at most, and what it costs",
        lines,
        ("component", lambda line: Cell(text=line.component, more=", ".join(line.origin))),
        *((("commands", lambda line: line.side),) if len({line.side for line in lines}) > 1 else ()),
        (f"largest contribution ({units.label('mV')})", lambda line: recorded(line.contribution_mV, ".2f mV", units)),
        *((f"price, {which} (% of command)", price(at)) for at, which in enumerate(("least", "median", "largest"))),
    )


def _far_section(spreads: Sequence[Spread]) -> Section:
    judged = [spread for spread in spreads if spread.limits]
    if not judged:
        return Section(
            lines=(f"Which valves lie far from the rest is said of lots of {FEWEST} calibrated valves or more.",)
        )
    rule = (
        f"The rule: further from the lot's median than {FAR:g} robust standard deviations, 1.4826 times the median "
        "absolute deviation, in one of the quantities. Of a normal lot one valve in 2000 lies there in each quantity "
        "by chance. No verdict: these valves are calibrated; look for a mix-up, a part, or the recording."
    )
    found = [(spread, name, value) for spread in judged for name, value in spread.far()]
    if not found:
        return Section(lines=(rule, "No valve lies there."))
    found.sort(key=lambda one: -abs(one[0].distance(one[2])))
    table = table_of(
        f"Far from the rest, the first {ROWS} of {len(found)}" if len(found) > ROWS else "Far from the rest",
        found[:ROWS],
        ("valve", lambda one: one[1]),
        ("quantity", lambda one: one[0].heading),
        ("value", lambda one: _cell(one[0].quantity, one[2], one[0].units)),
        ("median of the lot", lambda one: _cell(one[0].quantity, one[0].at.median, one[0].units)),
        ("robust s.d. from the median", lambda one: number(one[0].distance(one[2]), 1, "+")),
        csv=csv_text(
            ("valve", "quantity", "value", "median", "robust_sd_from_median"),
            ((name, of.column, value, of.at.median, round(of.distance(value), 2)) for of, name, value in found),
        ),
        name="far-from-the-rest",
    )
    return Section(lines=(rule,), tables=(table,))


# --- one setting for all ------------------------------------------------------------------------------------


def _setting_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    setting = lot.summary.lot_setting
    if setting is None:
        return Section(missing=f"There is no lot setting: {lot.summary.why_no_lot_setting}.", optional=True)
    costs = [spread for spread in spreads if spread.quantity.column == EXTRA]
    lines = (
        "The largest offset that over-compensates none of the valves, certified for each of them "
        f"{span(*setting.dp_MPa, lot.units)}, is in {setting.file}; its trend is that of {setting.carrier}.",
        f"{_sentence(checked_line(setting, lot.units))} The C code made of the file is compared with all bounds by "
        "dzdesign verify.",
        *(f"{line}." for line in untested_lines(setting, lot.units)),
        *map(_sentence, cost_lines(lot.summary)),
        f"It is held down by {and_more(setting.binding, NAMED)}.",
        *_without_lines(setting.without_binding, len(lot.calibrated)),
    )
    figure = spread_figure(
        "lot-setting", costs,
        "What one setting for all costs each valve: the dead zone that it leaves on opening less what the valve's own "
        "setting leaves, at the worst pressure drop of its tests. The valves that hold the setting down are the "
        "lowest.", one_scale=True,
    )  # fmt: skip
    return Section(lines=lines, figures=(figure,), tables=(_holding_table(lot, setting),))


def _sentence(line: str) -> str:
    return f"{line[0].upper()}{line[1:]}."


def _without_lines(without: SettingOfOthers | None, count: int) -> list[str]:
    """Say what the setting would cost without the valves that hold it down."""
    if without is None:
        return []
    if without.why_not is not None:
        return [f"Without them there is no lot setting of the others: {without.why_not}."]
    lines = []
    for column, at in without.quantiles.items():
        side = f" on the {column.partition('_')[0]} side" if column.startswith(("positive", "negative")) else ""
        lines.append(
            f"With settings of their own for {and_more(without.left_out, 5)}, the lot setting of the others would "
            f"cost{side} {cost_text(at, count - len(without.left_out))}."
        )
    return lines


def _holding_table(lot: Lot, setting: LotSettingSummary) -> Table:
    """Return the valves that hold the lot setting down."""
    rows = {row["name"]: row for row in lot.frame.iter_rows(named=True)}

    def margins(name: str) -> Cell:
        shown = [lot.units.number(1e3 * margin, ".3f mV") for margin in setting.smallest_margin_V.get(name, ())]
        return in_number_font(" and ".join(shown) or "–")

    def of_valve(side: str, column: str) -> Callable[[str], Cell]:
        cell = _number_of(side, QUANTITIES[column], lot)
        return lambda name: cell(rows.get(name, {}))

    caption = "Valves that hold the lot setting down"
    if len(setting.binding) > ROWS:
        caption += f", the first {ROWS} of {len(setting.binding)}"
    of = {side: f", {side}" if side else "" for side in lot.sides}
    volts = lot.units.label("V")
    return table_of(
        caption,
        setting.binding[:ROWS],
        ("valve", lambda name: name),
        (f"margin under its own ceiling ({lot.units.label('mV')})", margins),
        *((f"own offset at dP0{words} ({volts})", of_valve(side, "offset_V")) for side, words in of.items()),
        *((f"extra dead zone{words} (%)", of_valve(side, EXTRA)) for side, words in of.items()),
        notes=(
            "A valve's own ceiling, which its own offset may not exceed, runs straight between its tests, at its "
            "bounds or under them: this margin is no larger than that valve's margin under its bounds, which is said "
            "above of the nearest valve. Both are of the exact law, with half a count of rounding added; what dzdesign "
            "verify states is of the whole numbers that the C code gives.",
        ),
    )


def _number_of(side: str, quantity: Quantity, lot: Lot) -> Callable[[Row], Cell]:
    """Return what makes the cell of a quantity from a row of the table."""

    def cell(row: Row) -> Cell:
        value = row.get(column_of(side, quantity.column))
        return _cell(quantity, value if isinstance(value, float) else None, lot.units.of_side(side))

    return cell


# --- the valves, their outputs and recordings ---------------------------------------------------------------


def _valves_table(lot: Lot, far: Collection[str]) -> Table | None:
    """Return the table in short: of a small lot every row, of a large one the valves that lie far; all of it as CSV."""
    every = list(lot.frame.iter_rows(named=True))
    if not every:
        return None
    rows, caption = every, "All valves"
    if len(rows) > SMALL_LOT:
        rows, caption = [row for row in rows if row["name"] in far], "Calibrated valves far from the rest"
    if not rows:
        rows, caption = every[:FIRST], f"The first {FIRST} valves, since none lies far from the rest"
    if len(rows) > ROWS:
        rows, caption = rows[:ROWS], f"{caption}, the first {ROWS} of {len(rows)}"
    serial = next((name for name in lot.frame.columns if name.casefold() == f"{RECORD}serial"), None)
    embedded = len(lot.text) <= EMBEDDED
    return table_of(
        caption,
        rows,
        ("valve", lambda row: Cell(text=row["name"], more=_output_verdicts(row))),
        *((("serial", lambda row: row[serial] or "–"),) if serial else ()),
        ("status", lambda row: Cell(text="✓ ok", kind="good") if row["status"] == OK else _failed(row["status"])),
        *(
            (f"{side} {quantity.heading(lot.units, short=True)}".lstrip(), _number_of(side, quantity, lot))
            for side in lot.sides
            for quantity in QUANTITIES.values()
        ),
        ("warnings", lambda row: row["warnings"] or "–"),
        csv=lot.text if embedded else "",
        name="valves",
        notes=() if embedded else (f"The whole table is too large for a page; it is {TABLE} beside it.",),
    )


def _output_verdicts(row: Row) -> str:
    """Return the verdict on each output of a valve, for its row; empty of one without outputs."""
    return ", ".join(
        f"{name.removeprefix(OUTPUT)} {cell}"
        for name, cell in row.items()
        if name.startswith(OUTPUT) and not name.endswith(OUTPUT_HASH) and cell
    )


def _outputs_table(outputs: Mapping[str, LotOutput], verified: bool) -> Table:
    """Return a row for each kind of output: of how many valves it was made and holds, and the names of the others."""

    def names(of: Callable[[LotOutput], Sequence[str]]) -> Callable[[tuple[str, LotOutput]], Cell]:
        def cell(item: tuple[str, LotOutput]) -> Cell:
            return Cell(text=and_more(of(item[1]), OUTPUTS_NAMED), kind="bad") if of(item[1]) else Cell(text="–")

        return cell

    return table_of(
        "Outputs of the valves beside their firmware",
        outputs.items(),
        ("output", lambda item: item[0]),
        ("settings", lambda item: ", ".join(setting_words(item[1].settings)) or "–"),
        ("folder", lambda item: Cell(text=f"{VALVES}/NAME/{item[1].folder}", kind="symbol")),
        ("made", lambda item: in_number_font(whole(item[1].made))),
        ("verified, holds", lambda item: in_number_font(whole(len(item[1].holds)) if verified else "–")),
        ("does not hold", names(lambda output: output.does_not_hold)),
        ("not verified", names(lambda output: output.not_verified) if verified else lambda _: "–"),
        ("not made", names(lambda output: output.not_made)),
    )


def _recordings_section(lot: Lot) -> Section:
    """Return the section on warnings of the calibrated valves by code, and on what is odd across valves."""
    by_code: dict[str, list[str]] = {}
    for name, codes in lot.calibrated.select("name", "warnings").iter_rows():
        for code in codes.split():
            by_code.setdefault(code, []).append(name)
    odd = tuple(f"Odd: {text}." for text in lot.summary.anomalies)
    count = len(lot.calibrated)
    if not by_code:
        return Section(lines=(*odd, *(("No recording of a calibrated valve has a warning.",) if count else ())))
    ordered = sorted(by_code.items(), key=lambda one: (-len(one[1]), one[0]))
    table = table_of(
        "Warnings of the recordings, by code",
        ordered,
        ("code", lambda one: Cell(text=one[0], kind="symbol")),
        ("valves", lambda one: in_number_font(f"{whole(len(one[1]))} of {whole(count)}")),
        ("in the first of them it says", lambda one: lot.warning_texts.get(one[0], "–")),
        ("names", lambda one: "all" if len(one[1]) == count > 1 else and_more(one[1], NAMED)),
        csv=csv_text(("code", "valve"), ((code, name) for code, names in ordered for name in names)),
        name="warnings",
    )
    return Section(lines=odd, tables=(table,))


def _provenance_section(lot: Lot) -> Section:
    lines = []
    if len(lot.frame):
        hashed = lot.frame["inputs_sha256"].drop_nulls().len()
        lines.append(
            f"The table has, for {whole(hashed)} of its {whole(len(lot.frame))} valves, the SHA-256 of recordings and "
            "options, and of a calibrated one those of valve.json, compensator.json and the firmware's manifest"
            + ("; the latter were compared with the folders of the valves." if lot.compared else ".")
        )
    table = table_of(
        "What this report was made from, with the SHA-256 of the bytes",
        lot.hashes,
        ("file", lambda one: one[0]),
        ("SHA-256", lambda one: Cell(text=one[1], kind="hash")),
        ("made by", lambda one: f"{lot.summary.tool.name} {lot.summary.tool.version}"),
    )
    return Section(lines=tuple(lines), tables=(table,))
