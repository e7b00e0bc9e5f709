"""The tables of the report, section by section."""

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from dzdesign.core.documents import written_by
from dzdesign.report.artefact_chain import ROLES, SCHEMAS, Chain
from dzdesign.report.figures.figure import csv_text
from dzdesign.report.sections.cells import Cell, Table, number, text_row, verdict, whole
from dzdesign.verify.requirements import RequirementStatus

#: Rows of a constant's table that stand in the page; all of them stand in the CSV.
SHOWN_ROWS = 3


def thresholds_table(side: dict[str, Any], guard: str, title: str) -> Table:
    """Return the thresholds of each ramp test.

    Parameters
    ----------
    side : dict
        Of valve.json.
    guard : str
        Threshold that is guarded.
    title : str
    """
    lower = side.get("guards", {}).get(guard, {}).get("u_lower_V")
    rows = []
    for index, test in enumerate(side["tests"]):
        knees = (number(test[f"u_{what}_{way}_V"], 3) for what in ("knee", "onset") for way in ("rising", "falling"))
        rows.append(
            (
                number(test["dp_MPa"], 3),
                *knees,
                number(1e3 * test["u_knee_se_V"], 1),
                number(lower[index] if lower else test["u_guard_lower_V"], 3),
                number(test["slope_L_min_V"], 3),
                number(test["q_max_L_min"], 2),
                number(test["noise_L_min"], 3),
                Cell(text=str(test["outliers"]), kind="number"),
                Cell(text=test["source"]),
            )
        )
    return Table(
        caption=title,
        columns=(
            "dP (MPa)", "knee opening (V)", "knee closing (V)", "onset opening (V)", "onset closing (V)",
            "s.e. of knee (mV)", f"lower bound, {guard} (V)", "slope (L/min/V)", "largest flow (L/min)",
            "noise (L/min)", "outliers", "ramp test",
        ),
        rows=tuple(rows),
    )  # fmt: skip


def constants_table(firmware: dict[str, Any]) -> Table:
    """Return every number in the C: what it stands for, how it was rounded and where it comes from.

    Parameters
    ----------
    firmware : dict
        manifest.json of a firmware folder.
    """
    rows, cells = [], []
    for entry in firmware.get("constants", []):
        value = entry.get("value")
        cells.append(
            (
                Cell(text=entry["symbol"], kind="symbol", more=entry["file"]),
                Cell(text=_value(value)),
                Cell(text=entry["engineering"], more=f"rounding: {entry['rounding']}"),
                Cell(text=entry["equation"]),
                Cell(text="", more=f"{_origin(entry)}; by {entry['generator']}"),
            )
        )
        rows += [
            [entry["file"], entry["symbol"], place, item, entry["engineering"], entry["rounding"]]
            for place, item in _items(value)
        ]
    return Table(
        caption="Every number in the core, in the order of the files",
        columns=("symbol", "value", "in engineering units", "what it is", "where it comes from"),
        rows=tuple(cells),
        csv=csv_text(("file", "symbol", "row", "value", "engineering", "rounding"), rows),
        name="constants",
    )


def _value(value: Any) -> str:
    if not isinstance(value, list):
        return str(value)
    shown = ", ".join(str(row) for row in value[:SHOWN_ROWS])
    return f"{len(value)} rows: {shown}{', ...' if len(value) > SHOWN_ROWS else ''}"


def _items(value: Any) -> Iterator[tuple[int | None, str]]:
    if not isinstance(value, list):
        yield None, str(value)
        return
    for place, row in enumerate(value):
        yield place, " ".join(map(str, row)) if isinstance(row, list) else str(row)


def _origin(entry: dict[str, Any]) -> str:
    valve, compensator = (", ".join(entry[key]) for key in ("valve_json", "compensator_json"))
    if valve:
        return f"valve: {valve}"
    return f"option of design: {compensator}" if compensator else "the generator's own"


def rounding_table(compensator: dict[str, Any]) -> Table:
    """Return what turning the law into integers costs.

    Parameters
    ----------
    compensator : dict
        compensator.json.
    """
    u_max = Fraction(*compensator["u_max_V"])
    half_count = u_max / compensator["signals"]["compare_max"] / 2
    rows = []
    for name, side in compensator["sides"].items():
        if side is None:
            continue
        certificate = side["certificate"]
        valve = compensator["valve"]["sides"][name]
        offset = Fraction(*side["u_min0_over_u_max"]) * u_max
        node = offset / compensator["beta_denominator"]
        of = f" ({name})" if compensator["sides"]["negative"] else ""
        if not compensator["transition_codes"]:  # an edge counts from the opening threshold, the valve's curve does not
            wanted = Fraction(repr(_wanted_offset(valve, certificate["guard"])))
            volts = (f"{float(offset):.6f} V", f"{float(wanted):.6f} V")
            rows.append(("u_min0" + of, *volts, 1e3 * float(offset - wanted)))
        rows += [
            (
                "one step of a node of β" + of, f"1/{compensator['beta_denominator']}", "rounded down",
                -1e3 * float(node),
            ),
            (
                "offset under the certified curve, mean" + of, "few nodes, rounding, the converter's error",
                f"largest {1e3 * certificate['largest_loss_V']:.2f} mV", -1e3 * certificate["mean_loss_V"],
            ),
        ]  # fmt: skip
    rows.append(("compare value", "a whole count", "half a count", 1e3 * float(half_count)))
    return Table(
        caption="What the integers cost",
        columns=("number", "in the C", "exact, or what is done", "difference, at most (mV)"),
        rows=tuple((*text_row(cells), number(error, 3, "+")) for *cells, error in rows),
    )


def _wanted_offset(valve_side: dict[str, Any], guard: str) -> float:
    curves = valve_side.get("guards", {})
    return curves[guard]["u_min0_V"] if guard in curves else valve_side["reference"]["u_min_V"]


def checks_table(evidence: dict[str, Any], statuses: tuple[RequirementStatus, ...]) -> Table:
    """Return every requirement with its verdict, then what was not tried.

    Parameters
    ----------
    evidence : dict
        verification.json.
    statuses : tuple of RequirementStatus
        Of `requirement_statuses`.
    """
    rows = [
        (verdict(check["holds"]), Cell(text=check["name"]), Cell(text=check["text"])) for check in evidence["checks"]
    ]
    untried = [each for each in statuses if not each.tried]
    for each in untried:
        how = f"to try it: {each.how}".replace("`", "")
        rows.append((verdict(None), Cell(text=each.title), Cell(text=how)))
    return Table(
        caption=f"{len(evidence['checks'])} requirements tried, {len(untried)} not",
        columns=("verdict", "requirement", "figures"),
        rows=tuple(rows),
    )


def plant_table(loop: dict[str, Any]) -> Table | None:
    """Return the parameters of the closed loop's plant; from where to where, of one for each pressure drop.

    Parameters
    ----------
    loop : dict
        verification.json's ``closed_loop``.
    """
    plants = [loop["plant"]] if loop.get("plant") else [each["parameters"] for each in loop.get("plants") or []]
    cells = []
    for name in plants[0] if plants else ():
        values = sorted(plant[name] for plant in plants)
        ends = dict.fromkeys(f"{value:.6g}" for value in (values[0], values[-1]))
        cells.append((Cell(text=name, kind="symbol"), Cell(text=" to ".join(ends), kind="number")))
    if not cells:
        return None
    half = -(-len(cells) // 2)  # in two columns, or they would take a page of paper
    right = [*cells[half:], (Cell(text=""), Cell(text=""))]
    rows = [(*left, *beside) for left, beside in zip(cells[:half], right, strict=False)]
    of = "" if len(plants) == 1 else f", from the least to the largest of {len(plants)} pressure drops"
    return Table(
        caption=f"The plant's parameters; the unit is in the name{of}",
        columns=("parameter", "value", "parameter", "value"),
        rows=tuple(rows),
    )


def loops_table(pressures: list[dict[str, Any]]) -> Table:
    """Return dead zones and flows of the closed loop.

    Parameters
    ----------
    pressures : list of dict
        Of verification.json.
    """
    keys = ("dead_zone_opening", "residual_opening", "dead_zone_closing", "residual_closing")
    flows = ("q_zero_without_beta_L_min", "q_zero_L_min", "q_max_direct_L_min", "q_max_L_min")
    rows = tuple(
        (
            Cell(text=each["side"]),
            number(each["dp_MPa"], 2),
            *(number(100 * each[key], 1) for key in keys),
            *(number(each[key], 2) for key in flows),
        )
        for each in pressures
    )
    return Table(
        caption="Dead zones in per cent of command, flows in L/min",
        columns=(
            "side", "dP (MPa)", "opening without (%)", "opening with (%)", "closing without (%)", "closing with (%)",
            "at zero without β (L/min)", "at zero (L/min)", "largest without (L/min)", "largest with (L/min)",
        ),
        rows=rows,
    )  # fmt: skip


def scenarios_table(scenarios: list[dict[str, Any]]) -> Table | None:
    """Return each scenario at the pressure drop where it is worst; None if there are none.

    Parameters
    ----------
    scenarios : list of dict
        Of verification.json.
    """
    rows = []
    for name in dict.fromkeys(each["name"] for each in scenarios):
        group = [each for each in scenarios if each["name"] == name]
        worst = max(group, key=lambda each: (each["q_zero_L_min"], each["q_peak_at_zero_L_min"], each["dp_MPa"]))
        rows.append(
            (
                Cell(text=name),
                number(worst["dp_MPa"], 2),
                number(worst["q_zero_L_min"], 2),
                number(worst["q_peak_at_zero_L_min"], 2),
                Cell(text="must be shut at the end" if worst["must_shut"] else "no core can know: not required"),
            )
        )
    if not rows:
        return None
    return Table(
        caption="Beside ramps: each scenario at the pressure drop where it is worst",
        columns=("scenario", "dP (MPa)", "at zero, at the end (L/min)", "on the way, at most (L/min)", "required"),
        rows=tuple(rows),
    )


def series_table(series: dict[str, Any] | None) -> Table | None:
    """Return the quantiles of a series of plants; None if none was run.

    Parameters
    ----------
    series : dict or None
        verification.json's ``monte_carlo``.
    """
    if not series:
        return None
    rows = []
    for each in series["pressures"]:
        spreads = [
            [by * each[key][quantile] for quantile in ("p50", "p01", "p99")]
            for key, by in (("residual_opening", 100), ("residual_closing", 100), ("q_zero_L_min", 1))
        ]
        rows.append(
            (
                Cell(text=each["side"]),
                number(each["dp_MPa"], 2),
                *(Cell(text=f"{mid:.2f} ({low:.2f} to {high:.2f})", kind="number") for mid, low, high in spreads),
                Cell(text=f"{each['leaking']} of {each['plants']}", kind="number"),
            )
        )
    return Table(
        caption="Series of plants: median (1 to 99 %). No requirement: the certificate is of the tests' valve",
        columns=("side", "dP (MPa)", "opening with (%)", "closing with (%)", "at zero (L/min)", "plants that leak"),
        rows=tuple(rows),
    )


def provenance_table(chain: Chain) -> Table:
    """Return which file made which, from the firmware's evidence back to the recordings.

    Parameters
    ----------
    chain : Chain
    """
    rows = []
    for role, label in ROLES.items():
        one = chain.artefacts.get(role)
        if one is None:
            if written_by(SCHEMAS[role][0]):
                rows.append((Cell(text=label), Cell(text="missing or not used", kind="open"), *text_row(("", "", ""))))
            continue
        tool = one.document["tool"]
        made_from = ", ".join(each["source"] for each in one.document.get("made_from", []))
        rows.append(
            (
                Cell(text=label),
                Cell(text=one.name),
                Cell(text=one.sha256, kind="hash"),
                Cell(text=f"{tool['name']} {tool['version']}"),
                Cell(text=made_from or "–"),
            )
        )
    valve = chain.document("valve")
    for test in valve["made_from"] if valve else []:
        row = text_row(("recording", test["source"]))
        rows.append((*row, Cell(text=test["sha256"], kind="hash"), *text_row(("–", "–"))))
    return Table(
        caption="Each artefact with the SHA-256 of its bytes, and what it was made from",
        columns=("artefact", "file", "SHA-256", "made by", "made from"),
        rows=tuple(rows),
    )


def hashes_table(inputs: list[dict[str, Any]], firmware: dict[str, Any] | None) -> Table | None:
    """Return the hashes of what was tried: sources, object, outputs; and of the firmware's files.

    Parameters
    ----------
    inputs : list of dict
        Of verification.json.
    firmware : dict or None
        manifest.json.
    """
    rows = []
    for each in inputs:
        of = "positive" if each["sign"] > 0 else "negative"
        rows += [
            (f"C of the {of} core that was compiled", each["core_sha256"]),
            (f"object of the {of} core that was tried", each["object_sha256"]),
            (f"compare values of all {whole(each['inputs'])} inputs, 64 bits", each["outputs_hash"]),
        ]
    rows += [(name, str(digest)) for name, digest in firmware["files"].items()] if firmware else []
    if not rows:
        return None
    return Table(
        caption="Hashes of the firmware's files and of what was tried",
        columns=("what", "SHA-256"),
        rows=tuple((Cell(text=what), Cell(text=digest, kind="code")) for what, digest in rows),
    )
