"""What the report of a lot says of the outputs of its valves beside the C firmware."""

from collections.abc import Callable, Sequence

from dzdesign.core.errors import and_more
from dzdesign.design.output_manifest import setting_words
from dzdesign.report.lot.folder import Lot
from dzdesign.report.lot.output_types import LotOutput
from dzdesign.report.lot.summary import LotSummary
from dzdesign.report.lot.table import OUTPUT_HASH, TableRow
from dzdesign.report.lot.valve_folder import VALVES
from dzdesign.report.page import Section
from dzdesign.report.sections.cells import Cell, Table, in_number_font, table_of, whole

#: Valves that a cell names.
NAMED = 20


def outputs_section(lot: Lot) -> dict[str, Section]:
    """Return the section on the outputs, by its anchor; none of a lot without outputs."""
    if lot.summary is None or not lot.summary.outputs:
        return {}
    return {"outputs": Section(tables=(_outputs_table(lot.summary),))}


def _outputs_table(summary: LotSummary) -> Table:
    """Return a row for each kind of output: of how many valves it was made and holds, and the names of the others."""

    def names(of: Callable[[LotOutput], Sequence[str]]) -> Callable[[tuple[str, LotOutput]], Cell]:
        return lambda item: Cell(text=and_more(of(item[1]), NAMED), kind="bad") if of(item[1]) else Cell(text="–")

    return table_of(
        "Outputs of the valves beside their firmware",
        summary.outputs.items(),
        ("output", lambda item: item[0]),
        ("settings", lambda item: ", ".join(setting_words(item[1].settings)) or "–"),
        ("folder", lambda item: Cell(text=f"{VALVES}/NAME/{item[1].folder}", kind="symbol")),
        ("made", lambda item: in_number_font(whole(item[1].made))),
        ("verified, holds", lambda item: in_number_font(whole(len(item[1].holds)) if summary.verified else "–")),
        ("does not hold", names(lambda output: output.does_not_hold)),
        ("not verified", names(lambda output: output.not_verified) if summary.verified else lambda _: "–"),
        ("not made", names(lambda output: output.not_made)),
    )


def output_verdicts(row: TableRow) -> str:
    """Return the verdict on each output of a valve, for its row; empty of one without outputs."""
    return ", ".join(f"{name} {cell}" for name, cell in row.outputs.items() if not name.endswith(OUTPUT_HASH))


def output_lines(summary: LotSummary) -> list[str]:
    """Return one sentence for each output, for the terminal."""
    lines = []
    for target, output in summary.outputs.items():
        words = [f"made for {output.made} of {summary.valves} valves"]
        words += [f"verified, and holds for {len(output.holds)}"] if summary.verified else ["not verified"]
        words += [f"does not hold for {and_more(output.does_not_hold, NAMED)}"] if output.does_not_hold else []
        words += [f"NOT VERIFIED for {and_more(output.not_verified, NAMED)}"] * bool(
            summary.verified and output.not_verified
        )
        words += [f"not made for {and_more(output.not_made, NAMED)}"] if output.not_made else []
        settings = "".join(f", {word}" for word in setting_words(output.settings))
        lines.append(f"output {target}{settings}: {'; '.join(words)}; in {VALVES}/NAME/{output.folder}")
    return lines
