"""What a batch comes to: counts, reasons, and the cost of one common safe setting, as batch.json and on paper."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dzdesign.batch.calibration import OK
from dzdesign.batch.spread import QUANTITIES, quantiles
from dzdesign.core.artefacts import sha256_of, to_json

#: Valves of one warning that are named.
NAMED = 3

if TYPE_CHECKING:
    from dzdesign.design.common import CommonSetting


def summary_of(
    rows: Sequence[Mapping[str, Any]],
    common: "CommonSetting | None",
    why_not: str,
    *,
    files: Mapping[str, bytes],
    verified: bool,
    without_binding: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return batch.json but for schema and tool.

    Parameters
    ----------
    rows : sequence of mapping
        The table.
    common : CommonSetting or None
        Of the valves that are calibrated.
    why_not : str
        The reason where there is none.
    files : mapping of str to bytes
        Of the table, by name.
    verified : bool
        Whether each valve's firmware was verified too.
    without_binding : mapping, optional
        What the common setting would cost without the valves that hold it down.
    """
    failed = [{key: row[key] for key in ("name", "status", "reason")} for row in rows if row["status"] != OK]
    columns = [column for column in rows[0] if column.removeprefix("positive_").removeprefix("negative_") in QUANTITIES]
    return {
        "complete": True,
        "made_from": [{"source": row["name"], "inputs_sha256": row["inputs_sha256"]} for row in rows],
        "valves": len(rows),
        "calibrated": len(rows) - len(failed),
        "failed": failed,
        "verified": verified,
        "warnings": _warnings(rows),
        "files": {name: sha256_of(content) for name, content in files.items()},
        "quantiles": {column: quantiles([row[column] for row in rows]) for column in columns},
        "common_setting": (
            {**_common_document(common), "without_binding": without_binding} if common else {"why_not": why_not}
        ),
    }


def _warnings(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Return the codes of warnings, each with the valves that have it."""
    found: dict[str, list[str]] = {}
    for row in rows:
        for code in row["warnings"].split():
            found.setdefault(code, []).append(row["name"])
    return dict(sorted(found.items()))


def _common_document(common: "CommonSetting") -> dict[str, Any]:
    from dzdesign.design.compensator_file import compensator_document

    content = to_json(compensator_document(common.compensator)).encode()
    return {
        "file": "common_compensator.json",
        "sha256": sha256_of(content),
        "dp_MPa": list(common.dp_MPa),
        "carrier": common.carrier,
        "binding": list(common.binding),
        "smallest_margin_V": {
            name: [round(float(each.smallest_margin_V), 7) for each in certificates]
            for name, certificates in common.proved.items()
        },
    }


def print_batch(document: Mapping[str, Any], folder: str, has_report: bool = True) -> None:
    """Print the counts, the spread, the common setting's cost and the reasons.

    Parameters
    ----------
    document : mapping
        From `summary_of`.
    folder : str
        Where it was written.
    has_report : bool
        Whether the lot's report is there too.
    """
    from dzdesign.page import new_console, new_table, put_line

    console = new_console()
    count = document["calibrated"]
    title = f"{count} calibrated valve{'' if count == 1 else 's'} of {document['valves']}"
    table = new_table(title, "", "least", "5 %", "median", "95 %", "largest")
    for column, at in document["quantiles"].items():
        if at:
            name, _, unit = column.rpartition("_")
            words, unit = (name.replace("_", " "), {"V": "V", "percent": "%"}[unit]) if unit in ("V", "percent") else (
                column.replace("_", " "), "",
            )  # fmt: skip
            shown = [f"{at[q]:.3f}" for q in ("0", "0.05", "0.5", "0.95", "1")]
            table.add_row(f"{words} ({unit})" if unit else words, *shown)
    console.print(table)
    for line in _common_lines(document):
        put_line(console, line)
    warned = sorted(document["warnings"].items(), key=lambda item: len(item[1]))
    if warned:
        put_line(console, "warnings: " + ", ".join(_warned(code, names) for code, names in warned))
    for each in document["failed"]:
        put_line(console, f"{each['status']}  {each['name']}: {each['reason']}")
    for line in document["oddities"]:
        put_line(console, f"odd: {line}")
    put_line(
        console,
        f"{document['calibrated']} of {document['valves']} valves calibrated, {len(document['failed'])} not. "
        f"Table: {folder}/valves.csv, valves.parquet; "
        + (f"to be read: {folder}/report.html" if has_report else "no report.html"),
    )


def _warned(code: str, names: Sequence[str]) -> str:
    """Return a code with how many valves have it; a few are named, for those are where to look."""
    return f"{code} {len(names)}" + (f" ({', '.join(names)})" if len(names) <= NAMED else "")


def _common_lines(document: Mapping[str, Any]) -> list[str]:
    """Say what one setting for all would cost, or why there is none."""
    common = document["common_setting"]
    if "why_not" in common:
        return [f"no common setting: {common['why_not']}"]
    low, high = common["dp_MPa"]
    where = f"from {low:.4g} to {high:.4g} MPa" if high > low else f"at {low:.4g} MPa only"
    held = ", ".join(common["binding"][:5]) + (" and others" if len(common["binding"]) > 5 else "")
    costs = [(name, q) for name, q in document["quantiles"].items() if name.endswith("common_extra_dead_zone_percent")]
    lines = [
        f"one common setting, safe for each of these valves {where}, is held down by {held}; "
        f"it is in {common['file']}"
    ]
    for name, q in costs:
        one_in_twenty = f"{q['0.95']:.2f} % at one in twenty, " if document["calibrated"] >= 20 else ""
        side = name.removesuffix("common_extra_dead_zone_percent").replace("_", " side: ")
        lines.append(
            f"{side}it leaves more dead zone than each valve's own setting: {q['0.5']:.2f} % of command at the median "
            f"valve, {one_in_twenty}{q['1']:.2f} % at most"
        )
    return lines
