"""Results as tables on stdout, by rich; plain where stdout is no terminal."""

import json
import math
import os
import re
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.units import chance
from dzdesign.terminal.page import Column, new_console, put_line, put_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from dzdesign.codegen.project import Firmware
    from dzdesign.core.recorded_units import RecordedUnits
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.identify.valve.ramp_result import TestResult
    from dzdesign.identify.valve.side_model import SideModel

#: Files of a test that its row names, and characters by which their names may differ.
NAMED_FILES, LONGEST_DIFFERENCE = 6, 12
#: Pressure drops over which a distance is averaged.
GRID = 101


def print_valve(valve: "ValveModel", console: "Console | None" = None) -> None:
    """Print thresholds per ramp test, the law's parameters and every warning."""
    console = console or new_console()
    if valve.record:
        put_line(console, "record: " + "; ".join(f"{name} {text}" for name, text in valve.record.items()))
    for name, side in valve.sides.items():
        units = valve.recorded_units.of_side(name)
        title = f"Thresholds ({units.label('V')})" + ("" if len(valve.sides) == 1 else f", {name} side")
        _put_thresholds(console, side, title, units)
        at = "" if len(valve.sides) == 1 else f" at {name} commands"
        for line in (f"source of the pressure drop{at}: {_made_of(side)}", *_side_lines(side, units)):
            put_line(console, line)
    if "positive" not in valve.sides:
        console.print("positive commands: not tested")
    put_line(console, meter_line(valve.meter.floor_L_min, valve.meter.lag_in_words(), valve.recorded_units))
    for line in _left_out_lines(valve):
        put_line(console, line)
    if valve.dither is not None:
        put_line(console, f"recorded under {valve.dither_in_words}: all of this is of the dithered valve")
    put_units(console, valve.recorded_units, "valve.json")
    for warning in valve.warnings:
        source = f"{warning.source}: " if warning.source else ""
        put_line(console, f"warning [{warning.code}] {source}{warning.text}")


def _left_out_lines(valve: "ValveModel") -> list[str]:
    """Say what no threshold was found from, a line for each reason but the engineer's own; `-v` has each stretch."""
    from dzdesign.identify.valve.left_out import REASONS

    parts = {part for side in valve.sides.values() for test in side.tests for part in test.left_out}
    lines = []
    for reason, words in REASONS.items():
        spans: dict[str, list[tuple[float, float]]] = {}
        for part in sorted(parts, key=lambda part: part.from_s):
            if part.reason == reason != "option":
                spans.setdefault(part.recording, []).append((part.from_s, part.to_s))
        if spans:
            most = max(_covered(each) for each in spans.values())
            which = f"'{next(iter(spans))}'" if len(spans) == 1 else f"{len(spans)} recordings"
            most_of = "" if len(spans) == 1 else "up to "
            lines.append(f"left out of {which}: {most_of}{most:.1f} s, {words} (listed by -v)")
    return lines


def _covered(spans: "Sequence[tuple[float, float]]") -> float:
    """Return how long some spans of time are together, in the order of their beginnings; two sides may share one."""
    total, reached = 0.0, -math.inf
    for start, end in spans:
        total += max(end - max(start, reached), 0.0)
        reached = max(reached, end)
    return total


def put_units(console: "Console", units: "RecordedUnits", file: str) -> None:
    """Print what is shown in which unit; nothing where that is V, MPa and L/min, as in the file."""
    if units.in_words():
        falls = "; above and below, of commands, count from zero command outwards" if units.command.at_zero else ""
        put_line(console, f"units: {units.in_words()}{falls}; {file} holds V, MPa and L/min")


def meter_line(floor_L_min: float, lag: str, units: "RecordedUnits") -> str:
    """Return what is known of the flow meter of recordings; its lag is in words."""
    return f"meter floor: {units.text(floor_L_min, '.2f L/min')}; {lag}"


def _put_thresholds(console: "Console", side: "SideModel", title: str, units: "RecordedUnits") -> None:
    def command(value: float | None) -> str:
        return "-" if value is None else units.number(value, ".3f V")

    betas = dict(zip((test.source for test in side.tests), side.beta.beta, strict=False))  # none without a known dP
    columns: dict[str, Column[TestResult]] = {
        "ramp test": lambda test: short_source(test.source, test.ramps),
        f"dP ({units.label('MPa')})": lambda test: "?" if test.dp_MPa is None else units.number(test.dp_MPa, ".3f MPa"),
        "knee opening": lambda test: command(test.u_knee_rising_V),
        "knee closing": lambda test: command(test.u_knee_falling_V),
        "s.e. of knee": lambda test: units.number(test.u_knee_se_V, ".4f dV"),
        "onset closing": lambda test: command(test.u_onset_falling_V),
        "bound": lambda test: command(test.u_guard_lower_V),
        "beta": lambda test: f"{betas[test.source]:.4f}" if betas else "-",
        f"Q max ({units.label('L/min')})": lambda test: units.number(test.q_max_L_min, ".2f L/min"),
    }
    put_rows(console, title, side.tests, columns)


def short_source(source: str, ramps: "Sequence[str]") -> str:
    """Return the files of a test for a narrow column: what their names share stands once; several ramps of one as is.

    Examples
    --------
    >>> short_source("", ["ramp_dP1_1.csv", "ramp_dP1_2.csv", "ramp_dP1_10.csv"])
    'ramp_dP1_{1,2,10}.csv'
    """
    names = list(dict.fromkeys(ramps))
    if len(names) < 2 or any(name.endswith(" s)") for name in names):
        return source
    start = re.sub(r"\d+$", "", os.path.commonprefix(names))  # noqa: RUF071 (of characters)
    rests = [name[len(start) :] for name in names]
    end = re.sub(r"^\d+", "", os.path.commonprefix([rest[::-1] for rest in rests])[::-1])  # noqa: RUF071
    middles = [rest[: len(rest) - len(end)] for rest in rests]
    if not start or not all(middles) or max(map(len, middles)) > LONGEST_DIFFERENCE:
        return source
    shown = middles[:NAMED_FILES] + ["..."] * (len(middles) > NAMED_FILES)
    return f"{start}{{{','.join(shown)}}}{end}"


def _side_lines(side: "SideModel", units: "RecordedUnits") -> tuple[str, ...]:
    dp0 = side.reference.dp_MPa
    at, reference = ("", "") if dp0 is None else (" at dP0", f" at the reference pressure drop {_dp0(dp0, units)}")
    certificate = side.certificate
    return (
        f"bound: lower bound of the {certificate.guard} threshold; all bounds hold together with "
        f"{100 * certificate.confidence:.6g}% confidence. The threshold is {_guarded(side)}",
        _none(side, units),
        f"scatter between ramps: {certificate.repeatability.in_words(units)}",
        f"identified: {certificate.guard} knee u_min0 = {units.number(side.reference.u_min_V, '.4f V')} ± "
        f"{units.text(side.reference.u_min_se_V, '.4f dV')}{reference}{_betas(side, units)}",
        f"certified: largest output at zero command (offset) {units.text(side.curve.u_min0_V, '.4f V')}{at}. "
        f"{gains_most(side, units)}",
        side.premise_in_words(units),
        *_premise_lines(side),
        f"drive range of the valve (knee to full stroke): k x_max/u_max = {side.k_x_max_over_u_max:.4f} ± "
        f"{side.k_x_max_over_u_max_se:.4f} of full command, from largest flow and slope{at}"
        + (
            f"; k = {units.number(side.k_V_mm, '.4f V/mm')} ± {units.text(side.k_V_mm_se or 0.0, '.4f V/mm')}"
            if side.k_V_mm is not None
            else ""
        ),
        "trend with dP: unknown, as all tests have one pressure drop"
        if side.trend_change_V is None or side.trend_change_se_V is None
        else f"trend with dP: {side.trend} ({units.number(1e3 * side.trend_change_V, '+.1f mV')} ± "
        f"{units.text(1e3 * side.trend_change_se_V, '.1f mV')} over the tested range, {chance(side.trend_p or 0.0)})",
    )


def gains_most(side: "SideModel", units: "RecordedUnits") -> str:
    """Say how far the offset lies below the threshold, at the tests and between them, and what would raise it most."""
    import numpy as np

    curve = side.curve
    dp = np.linspace(*side.valid_dp_MPa, GRID) if side.valid_dp_MPa else np.array([0.0])
    threshold, bound, offset = (
        np.interp(dp, nodes or (0.0,), values)
        for nodes, values in (
            (curve.dp_MPa, curve.u_threshold_V), (curve.dp_MPa, curve.u_lower_V), (curve.offset_dp_MPa, curve.offset_V)
        )
    )  # fmt: skip
    at_tests, between = 1e3 * float(np.mean(threshold - bound)), 1e3 * float(np.mean(bound - offset))
    scatter, noise = side.certificate.repeatability, float(np.mean([test.u_knee_se_V for test in side.tests]))
    budget_V = curve.proof.shared_budget_V + float(np.mean([ramp.budget_V for ramp in curve.proof.ramps]))
    if between > at_tests:
        most = "More pressure drops"
    elif 2e3 * budget_V > at_tests:
        most = "Slower ramps, or lag and zero of the meter known better,"
    elif scatter.origin == "assumed":
        most = "Repeated ramps, as their scatter is assumed,"
    elif scatter.sd_V > noise:
        most = "More ramps at each pressure drop"
    else:
        most = "Slower ramps or a quieter meter"
    apart = f"On average it lies {units.text(at_tests, '.1f mV')} below the threshold at the tests"
    if len(side.tests) > 1:
        apart += f", and {units.text(between, '.1f mV')} more between them"
    return f"{apart}. {most} would gain most"


def _dp0(dp0_MPa: float, units: "RecordedUnits") -> str:
    return f"dP0 = {units.text(dp0_MPa, '.3f MPa')}"


def _made_of(side: "SideModel") -> str:
    """Say which columns make the pressure drop, the pressure ahead first, and what is below zero as recorded."""
    made_of = ", ".join(dict.fromkeys(test.dp_from or "not recorded" for test in side.tests))
    return made_of + (" (recorded below zero)" if side.recorded_drop and side.recorded_drop.sign < 0 else "")


def _guarded(side: "SideModel") -> str:
    """Say which threshold is bounded."""
    if side.zero_flow_L_min is not None:
        return "the command that passes the flow allowed at zero"
    gradual = "if the port opens gradually, it is the lower command where the small flow below the knee reaches zero"
    return f"the knee; {gradual}"


def _none(side: "SideModel", units: "RecordedUnits") -> str:
    """Say what counts as no flow, or what may flow below the bound."""
    if declared := side.zero_flow_in_words(units):
        return f"below the bound, {declared}"
    return side.none_in_words(side.certificate.guard, units)


def _betas(side: "SideModel", units: "RecordedUnits") -> str:
    """Say beta at the highest pressure drop, of each branch."""
    found = [
        f"{each.beta[-1]:.4f} ± {each.beta_se[-1]:.4f} on {name}"
        for name, each in side.identified.items()
        if len(each.beta) > 1
    ]
    at = units.text(side.tests[-1].dp_MPa or 0.0, ".3g MPa")
    return f"; beta({at}) = {', '.join(found)}" if found else ""


def _premise_lines(side: "SideModel") -> tuple[str, ...]:
    """Say of each premise that these tests allow how it fits them, and what it would leave."""
    if len(side.curve.premises) < 2:
        return ()
    words = []
    for check in side.curve.premises:
        p_value, left = check.lack_of_fit_p, check.dead_zone_over_u_max
        estimated = check.premise == "smooth" and len(side.tests) > 2
        untested = "M estimated from the tests" if estimated else "untested"
        tested = untested if p_value is None else f"lack of fit {chance(p_value)}"
        leaves = "no offset" if left is None else f"{100 * left:.1f} %"
        words.append(f"{check.premise} {leaves} ({tested})")
    what = "predicted opening dead zone without a transition, largest over the tested pressure range, for each premise"
    return (f"{what} (--curve): {', '.join(words)}. `design` states the exact values; a transition reduces them",)


def print_firmware(firmware: "Firmware", console: "Console | None" = None, folder: str = "") -> None:
    """Print the files of a firmware, and in which folder they are."""
    console = console or new_console()
    valves = len(json.loads(firmware.files["compensator.json"])["lot"])
    common = f", lot setting of {valves} valves" if valves else ""
    place = f", in folder '{folder}'" if folder else ""
    manifest = firmware.manifest
    put_line(console, f"Firmware for target {manifest.target} with law '{manifest.law}'{common}{place}:")
    put_files(console, (*firmware.contents, MANIFEST_NAME))


def put_files(console: "Console", names: "Sequence[str]") -> None:
    """Print the names of files, a line for each folder that they are in."""
    folders: dict[str, list[str]] = {}
    for name in names:
        folder, _, file = name.rpartition("/")
        folders.setdefault(folder, []).append(file)
    for folder, files in folders.items():
        put_line(console, f"  {folder and f'{folder}/: '}{', '.join(files)}")
