"""Results as tables on stdout, by rich; plain where stdout is no terminal."""

import json
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line
from dzdesign.core.units import chance, span_MPa
from dzdesign.core.verdicts import NOT_CHECKED, verdict_words
from dzdesign.terminal.page import new_console, new_table, put_line

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from fractions import Fraction

    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.identify.valve.side_model import SideModel
    from dzdesign.terminal.page import Grid
    from dzdesign.verify.evidence import MonteCarlo, MutationScore, ScenarioResult, Spread
    from dzdesign.verify.verification import Verification


def _volts(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _rational(value: "Fraction") -> str:
    return f"{value} = {float(value):.5f}"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def print_valve(valve: "ValveModel") -> None:
    """Print thresholds per ramp test, the law's parameters and every warning."""
    console = new_console()
    if valve.record:
        put_line(console, "record: " + "; ".join(f"{name} {text}" for name, text in valve.record.items()))
    for name, side in valve.sides.items():
        title = "Thresholds (V)" if len(valve.sides) == 1 else f"Thresholds (V), {name} side"
        console.print(_thresholds(side, title))
        for line in _side_lines(side):
            put_line(console, line)
    if "positive" not in valve.sides:
        console.print("positive commands: not tested")
    how = {"declared": "declared", "identified": "from ramps of two rates", "unknown": "none declared"}
    put_line(
        console,
        f"meter floor: {valve.meter.floor_L_min:.2f} L/min; lag taken as {valve.meter.lag_s:.3g} s "
        f"({how.get(valve.meter.lag_is, valve.meter.lag_is)})",
    )
    for warning in valve.warnings:
        source = f"{warning.source}: " if warning.source else ""
        put_line(console, f"warning [{warning.code}] {source}{warning.text}")


def _thresholds(side: "SideModel", title: str) -> "Grid":
    table = new_table(
        title, "ramp test", "dP (MPa)", "knee opening", "knee closing", "s.e. of knee", "onset closing",
         "bound", "beta", "Q max (L/min)",
    )  # fmt: skip
    betas = side.beta.beta or ("-",)
    for test, beta in zip(side.tests, betas, strict=True):
        table.add_row(
            test.source,
            "?" if test.dp_MPa is None else f"{test.dp_MPa:.3f}",
            _volts(test.u_knee_rising_V),
            _volts(test.u_knee_falling_V),
            f"{test.u_knee_se_V:.4f}",
            _volts(test.u_onset_falling_V),
            _volts(test.u_guard_lower_V),
            beta if isinstance(beta, str) else f"{beta:.4f}",
            f"{test.q_max_L_min:.2f}",
        )
    return table


def _side_lines(side: "SideModel") -> tuple[str, ...]:
    at = "" if side.reference.dp_MPa is None else f" at dP0 = {side.reference.dp_MPa:.3f} MPa"
    certificate = side.certificate
    return (
        f"bound: {100 * certificate.confidence:.6g}% lower bound, for all tests together, of the {certificate.guard} "
        "threshold (the knee, or the tail's zero where the edge is soft); flow below "
        f"{certificate.level_L_min:.2f} L/min (meter's floor, its noise, or 0.5 % of the largest flow) counts as none",
        f"u_min0 = {side.reference.u_min_V:.4f} V{at}: the largest certified offset. Between two tests only the lower "
        "of their bounds is certain, so each offset stays under the neighbour's; more tests raise it",
        f"drive range of the valve k x_max/u_max = {side.k_x_max_over_u_max:.4f}: command from the knee to full "
        "stroke, as a share of full command; the law's counts from its offset, which lies lower"
        + (f"; k = {side.k_V_mm:.4f} V/mm" if side.k_V_mm is not None else ""),
        "trend with dP: can't be said from one ramp test"
        if side.trend is None
        else f"trend with dP: {side.trend} ({1e3 * side.trend_change_V:+.1f} ± {1e3 * side.trend_change_se_V:.1f} mV "
        f"over the tested range, {chance(side.trend_p or 0.0)})",
    )


def print_compensator(compensator: "Compensator") -> None:
    """Print the law, the certificate and what the choices cost."""
    from dzdesign.derivation.law import law
    from dzdesign.design.costs import hidden_failures
    from dzdesign.design.signal_descriptions import signals_in_words

    chosen = law(compensator.law)
    lines = [
        f"law {chosen.name} {chosen.equation}: u_O = {chosen.output}",
        *signals_in_words(compensator.signals, float(compensator.u_max_V)),
    ]
    for sign in compensator.signals.signs:
        side = compensator.side(sign)
        certificate = side.certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        label = "" if compensator.negative is None else "positive: " if sign > 0 else "negative: "
        lines += [
            f"{label}drive range of the law k x_max/u_max = {_rational(side.drive_range_over_u_max)} (from its offset, "
            f"below the valve's knee, to full flow), offset at dP0 u_min0/u_max = {_rational(side.u_min0_over_u_max)}, "
            f"both as shares of full command; beta(dP): straight between {len(side.beta)} nodes, each a "
            f"whole number of 1/{compensator.beta_denominator}",
            f"{label}certificate: the offset stays below the {100 * certificate.confidence:.6g}% lower bound of the "
            f"{certificate.guard} threshold {span_MPa(low, high, 3)}, at every pressure code; flow below "
            f"{certificate.level_L_min:.2f} L/min (meter's floor, its noise, or 0.5 % of the largest flow) counts as "
            "none",
        ]
    if compensator.transition_codes:
        share = compensator.transition_codes / compensator.signals.command.span(1)
        guard = compensator.positive.certificate.guard
        lines.append(f"transition: from the {guard} to the opening threshold over the first {share:.2%} of command")
    hidden = hidden_failures(compensator)
    costs = [line for line in compensator.costs if line not in hidden]
    console = new_console()
    for line in (*(f"warning: {line}" for line in hidden), *lines, *(f"cost: {line}" for line in costs)):
        put_line(console, line)


def print_firmware(firmware: "Firmware", folder: str) -> None:
    """Print the files of a firmware folder."""
    valves = len(json.loads(firmware.files["compensator.json"])["lot"])
    common = f", lot setting of {valves} valves" if valves else ""
    print(one_line(f"Firmware for {firmware.manifest.target}, law {firmware.manifest.law}{common}, in {folder}:"))
    for name in firmware.files:
        print(f"  {name}")


def print_verification(verification: "Verification") -> None:
    """Print every check, what was not tried, and the closed loop per pressure drop."""
    from dzdesign.verify.requirements import not_tried

    console = new_console()
    for check in verification.evidence.checks:
        put_line(console, f"{verdict_words(check.holds)}  {check.name}: {check.text}")
    for name in not_tried(verification.evidence):
        put_line(console, f"{NOT_CHECKED}  {name}".replace("`", ""))
    if verification.loops:
        console.print(_closed_loop(verification))
    print_scenarios(verification.evidence.scenarios)
    print_scatter(verification.evidence.monte_carlo)
    put_line(console, verification.verdict)


def _closed_loop(verification: "Verification") -> "Grid":
    plant = verification.evidence.closed_loop.plant_source
    table = new_table(
        f"Closed loop (plant: {plant}); dead zones in per cent of full command, onset of flow",
        "dP (MPa)", "without: opening", "without: closing", "with: opening", "with: closing", "Q at zero, no beta",
        "Q at zero, beta", "Q max without", "Q max with (L/min)",
    )  # fmt: skip
    both = len({loop.result.side for loop in verification.loops}) > 1
    for loop in verification.loops:
        result = loop.result
        table.add_row(
            f"{result.side} {result.dp_MPa:.2f}" if both else f"{result.dp_MPa:.2f}",
            _percent(result.dead_zone_opening),
            _percent(result.dead_zone_closing),
            _percent(result.residual_opening),
            _percent(result.residual_closing),
            f"{result.q_zero_without_beta_L_min:.2f}",
            f"{result.q_zero_L_min:.2f}",
            f"{result.q_max_direct_L_min:.1f}",
            f"{result.q_max_L_min:.1f}",
        )
    return table


def print_scenarios(scenarios: "Sequence[ScenarioResult]") -> None:
    """Print every scenario once: its worst over the pressure drops, and below the table what else was read there."""
    if not scenarios:
        return
    table = new_table(
        "Scenarios with the compensator, worst of all pressure drops", "scenario", "dP (MPa)",
        "Q at zero, at the end (L/min)", "on the way, at most (L/min)",
    )  # fmt: skip
    lines = []
    for name in dict.fromkeys(each.name for each in scenarios):
        group = [each for each in scenarios if each.name == name]
        worst = max(group, key=lambda each: (each.q_zero_L_min, each.q_peak_at_zero_L_min, each.dp_MPa))
        table.add_row(
            name + ("" if worst.must_shut else " (no core can know)"),
            f"{worst.dp_MPa:.2f}",
            f"{worst.q_zero_L_min:.2f}",
            f"{worst.q_peak_at_zero_L_min:.2f}",
        )
        if worst.figures:
            lines.append(f"{name}: {_figures(worst.figures)}")
    console = new_console()
    console.print(table)
    for line in lines:  # words of many lines in a narrow column are no table
        put_line(console, line)


#: How a figure's name begins -> of which valve it is.
VALVES = {"compensated_": "with the compensator ", "direct_": "without it "}


def _figures(figures: "Mapping[str, float]") -> str:
    """Return figures as words, those of one valve together."""
    groups = {
        words: [_figure(key.removeprefix(start), value) for key, value in figures.items() if key.startswith(start)]
        for start, words in VALVES.items()
    }
    groups[""] = [_figure(key, value) for key, value in figures.items() if not key.startswith(tuple(VALVES))]
    return "; ".join(words + ", ".join(each) for words, each in groups.items() if each)


def _figure(key: str, value: float) -> str:
    """Return a figure whose name ends in its unit as words: rise_ms is a rise in ms."""
    for ending, unit in (("_L_min", "L/min"), ("_MPa", "MPa"), ("_ms", "ms"), ("_mL", "mL"), ("_percent", "%")):
        if key.endswith(ending):
            return f"{key.removesuffix(ending).replace('_', ' ')} {value:.3g} {unit}"
    return f"{key} {value:.3g}"


def print_scatter(series: "MonteCarlo | None") -> None:
    """Print the quantiles of a series of plants per pressure drop."""
    if series is None:
        return
    table = new_table(
        f"Series of {series.plants} plants: median (1 to 99 %)", "side", "dP (MPa)", "dead zone opening (%)",
        "closing (%)", "Q max (L/min)", "Q at zero (L/min)", "plants that leak", keys=2,
    )  # fmt: skip

    def spread(of: "Spread", by: float, digits: int) -> str:
        middle, low, high = (by * value for value in (of.p50, of.p01, of.p99))
        return f"{middle:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"

    for each in series.pressures:
        table.add_row(
            each.side,
            f"{each.dp_MPa:.2f}",
            spread(each.residual_opening, 100, 1),
            spread(each.residual_closing, 100, 1),
            spread(each.q_max_L_min, 1, 1),
            spread(each.q_zero_L_min, 1, 2),
            f"{each.leaking} of {each.plants}",
        )
    console = new_console()
    console.print(table)
    at = max(series.pressures, key=lambda each: each.q_zero_L_min.worst)
    worst = at.q_zero_L_min
    if worst.worst > 0:
        plant = ", ".join(f"{name} {value:.4g}" for name, value in worst.worst_plant.items())
        put_line(
            console,
            f"Most at zero command: {worst.worst:.2f} L/min at {at.dp_MPa:.2f} MPa, by the plant with {plant}. "
            "A series is no requirement: the compensator is certified for the valve of its ramp tests.",
        )


def print_demo(valve: "ValveModel", verification: "Verification", folder: str) -> None:
    """Print the demo's closing table: per pressure drop, what was found and what the compensator does."""
    table = new_table(
        "Simulated example valve, 0-10 V ramps in closed loop with the generated C",
        "dP (MPa)", "threshold open/close (V)", "dead zone without", "with: opening", "with: closing",
        "Q at zero without beta", "with beta (L/min)",
    )  # fmt: skip
    tests = {round(test.dp_MPa, 6): test for test in valve.positive.tests}
    for loop in verification.loops:
        result = loop.result
        test = tests[round(result.dp_MPa, 6)]
        table.add_row(
            f"{result.dp_MPa:.2f}",
            f"{_volts(test.u_knee_rising_V)} / {_volts(test.u_knee_falling_V)}",
            _percent(result.dead_zone_opening),
            _percent(result.residual_opening),
            _percent(result.residual_closing),
            f"{result.q_zero_without_beta_L_min:.2f}",
            f"{result.q_zero_L_min:.2f}",
        )
    console = new_console()
    console.print(table)
    checked, wrong = (sum(getattr(each, name) for each in verification.evidence.inputs) for name in ("inputs", "wrong"))
    put_line(console, f"Inputs checked: {checked}, wrong: {wrong}")
    put_line(console, verification.verdict)
    put_line(console, f"Artefacts: {folder}")


def print_mutations(document: dict) -> None:
    """Print how many wrong equations were caught, those that were not, and the changes that mean the same."""
    table = new_table("Wrong equations", "statement", "wrong", "caught", "same meaning")
    for row in document["statements"]:
        table.add_row(row["number"], str(row["mutants"]), str(row["caught"]), str(len(row["equivalent"]) or ""))
    console = new_console()
    console.print(table)
    for row in document["statements"]:
        for survivor in row["survivors"]:
            put_line(console, f"not caught, {row['number']}: {survivor}")
        for text in row["equivalent"]:
            put_line(console, f"same meaning, {row['number']}: {text}")
    console.print(f"{document['caught']} of {document['mutants']} wrong equations are caught.")


def print_firmware_mutants(score: "MutationScore") -> None:
    """Print what of the wrong C was not killed, and why."""
    console = new_console()
    put_line(console, f"Mutants that were not killed; equivalent: {score.equivalent_means}")
    for each in score.not_killed:
        put_line(console, f"{each.verdict}, {each.file} line {each.line}: {each.change}")
