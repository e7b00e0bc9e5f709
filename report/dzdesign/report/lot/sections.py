"""What stands in each section of the report of a lot."""

from collections import Counter
from collections.abc import Sequence

from dzdesign.core.errors import and_more
from dzdesign.report.figures.figure import ReportFigure, figure_style
from dzdesign.report.lot.budget import lot_budget_table
from dzdesign.report.lot.figures import spread_figure
from dzdesign.report.lot.folder import Lot
from dzdesign.report.lot.outputs import outputs_section
from dzdesign.report.lot.reasons import reason_groups
from dzdesign.report.lot.setting_text import checked_line, cost_lines, cost_text, span, untested_lines
from dzdesign.report.lot.spread import EXTRA, FAR, FEWEST, Spread
from dzdesign.report.lot.summary import SettingOfOthers
from dzdesign.report.lot.tables import (
    NAMED,
    failed_table,
    far_table,
    holding_table,
    provenance_table,
    spread_table,
    valves_table,
    warnings_table,
)
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import counted, from_to, whole

#: Name of a figure, columns of the quantities in it, caption, and whether they are on one scale.
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
    with figure_style():
        return {
            "failed": _failed_section(lot),
            "spread": _spread_section(lot, spreads),
            "far": _far_section(spreads),
            "left": _left_section(lot, spreads),
            "setting": _setting_section(lot, spreads),
            "valves": _valves_section(lot, spreads),
            **outputs_section(lot),
            "recordings": _recordings_section(lot),
            "warnings": Section(),
            "provenance": _provenance_section(lot),
        }


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


def _failed_section(lot: Lot) -> Section:
    if not lot.failed:
        return Section(lines=("Every valve that was tried is calibrated.",) if lot.rows else ())
    groups = reason_groups(lot.failed)
    many, kinds = counted(len(lot.failed), "valve"), counted(len(groups), "kind")
    return Section(
        lines=(
            f"{many}, {kinds} of reason; what differs between the valves of a kind is … in the reason and stands "
            "behind the name.",
        ),
        tables=(failed_table(groups, lot.failed),),
    )


def _spread_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    if not spreads:
        return Section(missing="No valve is calibrated, so there is nothing to compare.")
    return Section(
        lines=tuple(_lot_lines(lot)),
        figures=_figures(lot, spreads, *SPREAD_FIGURES),
        tables=(spread_table(spreads), lot_budget_table(lot.summary.budget if lot.summary else None, lot.units)),
    )


def _lot_lines(lot: Lot) -> list[str]:
    """Say at which pressure drops the numbers hold, and which way the thresholds move."""
    lines = []
    for side in lot.sides:
        of = f"{side.capitalize()} commands: " if side else ""
        tested = [figures for row in lot.calibrated if (figures := row.sides[side]).dp0_MPa is not None]
        if not tested:
            lines.append(f"{of}no valve was tested.")
            continue
        trends = Counter(each.trend or "not known" for each in tested)
        counts = ", ".join(f"{word} in {whole(count)}" for word, count in trends.most_common())
        dp0, highest = (
            from_to([None if one is None else lot.units.convert(one, "MPa") for one in known], ".3g")
            for known in ([each.dp0_MPa for each in tested], [each.highest_dp_MPa for each in tested])
        )
        unit = lot.units.label("MPa")
        lines.append(
            f"{of}dP0 is {dp0} {unit}, the highest tested pressure drop {highest} {unit}. Threshold over the pressure "
            f"drop: {counts} valves."
        )
    return lines


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
    table = far_table(judged)
    return Section(lines=(rule,) if table else (rule, "No valve lies there."), tables=(table,))


def _left_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    if not spreads:
        return Section(missing="No valve is calibrated.")
    return Section(figures=_figures(lot, spreads, LEFT_FIGURE))


def _setting_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    if lot.summary is None:
        return Section(missing="The lot setting is made at the end of a batch.")
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
    return Section(lines=lines, figures=(figure,), tables=(holding_table(lot, setting),))


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


def _valves_section(lot: Lot, spreads: Sequence[Spread]) -> Section:
    return Section(tables=(valves_table(lot, {name for spread in spreads for name, _ in spread.far()}),))


def _recordings_section(lot: Lot) -> Section:
    table = warnings_table(lot)
    odd = tuple(f"Odd: {text}." for text in (lot.summary.anomalies if lot.summary else ()))
    none = ("No recording of a calibrated valve has a warning.",) if lot.calibrated and not table else ()
    return Section(lines=(*odd, *none), tables=(table,))


def _provenance_section(lot: Lot) -> Section:
    lines = []
    if lot.summary and lot.rows:
        hashed = sum("inputs_sha256" in row.hashes for row in lot.rows)
        lines.append(
            f"The table has, for {whole(hashed)} of its {whole(len(lot.rows))} valves, the SHA-256 of recordings and "
            "options, and of a calibrated one those of valve.json, compensator.json and the firmware's manifest"
            + ("; the latter were compared with the folders of the valves." if lot.compared else ".")
        )
    return Section(lines=tuple(lines), tables=(provenance_table(lot),))
