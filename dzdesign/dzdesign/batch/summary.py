"""What a batch comes to: counts, reasons, and the cost of one common safe setting, as batch.json and on paper."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dzdesign.batch.calibration import OK
from dzdesign.core.artefact_files import sha256_of, to_json
from dzdesign.core.errors import and_more
from dzdesign.report.lot.spread import QUANTITIES, TWENTY, quantiles

#: Valves of one warning that are named.
NAMED = 3

if TYPE_CHECKING:
    from dzdesign.design.lot_setting import CommonSetting


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
        **_lacking_document(common),
        "carrier": common.carrier,
        "binding": list(common.binding),
        "smallest_margin_V": {
            name: [round(float(each.smallest_margin_V), 7) for each in certificates]
            for name, certificates in common.proved.items()
        },
        "checked": {
            "valves": len(common.margins),
            "worst": common.worst.name,
            "dp_MPa": round(float(common.worst.dp_MPa), 4),
            "smallest_margin_V": round(float(common.worst.margin_V), 7),
        },
    }


def checked_lines(common: Mapping[str, Any]) -> list[str]:
    """Say for how many valves it is proved that the common setting lies under their bounds, and which is nearest.

    Parameters
    ----------
    common : mapping
        Of batch.json; of an older version it says nothing of this.
    """
    checked = common.get("checked")
    if not checked:
        return []
    margin_mV = 1e3 * checked["smallest_margin_V"]
    return [
        f"it lies under the bounds of each of the {checked['valves']} valves, at every pressure code of its tests; "
        f"nearest is {checked['worst']}: the exact law with half a count of rounding stays {margin_mV:.3f} mV "
        f"under its bound at {checked['dp_MPa']:.2f} MPa"
    ]


def _lacking_document(common: "CommonSetting") -> dict[str, Any]:
    """Return which valves were not tested where the lot was, and what the interval would be without those it hurts."""
    from dzdesign.design.lot_pressures import lacking_in, without_narrow

    lot = common.compensator.lot
    lacking = lacking_in(lot)
    narrow, wider = without_narrow(lot, lacking)
    documents = []
    for each in lacking:
        coarser = each.coarser_V if each.name in common.binding else 0.0
        full = float(common.compensator.side(each.sign).k_x_max_over_u_max * common.compensator.u_max_V)
        documents.append(
            {
                "name": each.name,
                "side": "positive" if each.sign > 0 else "negative",
                "dp_MPa": list(each.dp_MPa),
                "narrows": each.name in narrow,
                "coarser_V": round(each.coarser_V, 7),
                "cost_percent": round(100 * coarser / full, 5),
            }
        )
    return {"lacking": documents, "dp_without_MPa": list(wider) if wider else None}


def lacking_lines(common: Mapping[str, Any]) -> list[str]:
    """Say which valves were not tested where the lot was, and what that costs the common setting.

    Parameters
    ----------
    common : mapping
        Of batch.json; of an older version it says nothing of this, or only which range there would be.
    """
    lacking = common.get("lacking") or ()
    here, wider = span(*common["dp_MPa"]) if lacking else "", common.get("dp_without_MPa")
    # An older version called ranges wider that differ by what no bench sets.
    without = f", and without %s {span(*wider)}" if wider and span(*wider) != here else ""
    narrow = [each for each in lacking if each["narrows"] and (without or not wider)]
    lines = []
    if narrow:
        them = "it" if len({each["name"] for each in narrow}) == 1 else "them"
        lines.append(
            f"{_untested(narrow)}: so the common setting holds for all {here}{without and without % them}; record what "
            f"is missing, or calibrate {them} apart"
        )
    return lines + _coarse_lines([each for each in lacking if each not in narrow])


def _coarse_lines(inside: Sequence[Mapping[str, Any]]) -> list[str]:
    """Say of valves whose bounds are coarser between two tests by how much, and what that costs."""
    costly = [each for each in inside if each.get("cost_percent", 0) > 0]
    free = [each for each in inside if each not in costly and "cost_percent" in each]
    unknown = [each for each in inside if "cost_percent" not in each]
    lines = []
    for each in costly:
        lines.append(
            f"{_untested([each])}: between the tests beside it only the lower of their two bounds is known, there "
            f"about {1e3 * each['coarser_V']:.3g} mV under what a test would show, and {each['name']} holds the common "
            f"setting down: that may cost each valve up to {each['cost_percent']:.2g} % of command; record what is "
            "missing"
        )
    if coarse := [each for each in free if each["coarser_V"] > 0]:
        lines.append(
            f"{_untested(coarse)}: between the tests beside it only the lower of their two bounds is known, which "
            "costs nothing, as other valves hold the common setting down"
        )
    if same := [each for each in free if each not in coarse]:
        lines.append(f"{_untested(same)}: that costs the common setting nothing")
    if unknown:
        lines.append(
            f"{_untested(unknown)}: between two tests only the lower of their bounds is known, which may hold the "
            "common setting down"
        )
    return lines


def _untested(lacking: Sequence[Mapping[str, Any]]) -> str:
    """Say which valves lack which pressure drops, those that lack the same together."""
    at: dict[tuple[float, ...], dict[str, None]] = {}
    for each in lacking:
        at.setdefault(tuple(each["dp_MPa"]), {})[each["name"]] = None
    return "; ".join(
        f"{and_more(list(names), NAMED)} {'was' if len(names) == 1 else 'were'} not tested at "
        f"{' and '.join(f'{dp:.4g}' for dp in pressures)} MPa, as the lot was"
        for pressures, names in at.items()
    )


def span(low: float, high: float) -> str:
    """Return a range of pressure drops in words.

    Examples
    --------
    >>> span(1.0, 5.0), span(2.5, 2.5)
    ('from 1 to 5 MPa', 'at 2.5 MPa only')
    """
    ends = f"{low:.3g}", f"{high:.3g}"
    return f"from {ends[0]} to {ends[1]} MPa" if high > low else f"at {ends[0]} MPa only"


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
    from dzdesign.terminal.page import new_console, new_table, put_line

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
    where = span(*common["dp_MPa"])
    held = ", ".join(common["binding"][:5]) + (" and others" if len(common["binding"]) > 5 else "")
    costs = [(name, q) for name, q in document["quantiles"].items() if name.endswith("common_extra_dead_zone_percent")]
    lines = [
        f"one common setting, safe for each of these valves {where}, is held down by {held}; "
        f"it is in {common['file']}",
        *checked_lines(common),
        *lacking_lines(common),
    ]
    for name, q in costs:
        one_in_twenty = f"{q['0.95']:.2f} % at one in twenty, " if document["calibrated"] >= TWENTY else ""
        side = name.removesuffix("common_extra_dead_zone_percent").replace("_", " side: ")
        lines.append(
            f"{side}it leaves more dead zone than each valve's own setting: {q['0.5']:.2f} % of command at the median "
            f"valve, {one_in_twenty}{q['1']:.2f} % at most"
        )
    return lines
