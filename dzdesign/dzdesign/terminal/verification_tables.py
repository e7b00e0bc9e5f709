"""A verification as tables on stdout: every requirement, the closed loop, the scenarios, a series of plants."""

from typing import TYPE_CHECKING

from dzdesign.core.verdicts import NOT_CHECKED, verdict_words
from dzdesign.terminal.page import Table, new_console, new_table, put_line, put_table, volts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console

    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.evidence import MonteCarlo, MutationScore, ScenarioResult, Spread
    from dzdesign.verify.verification import Verification


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def print_verification(verification: "Verification", console: "Console | None" = None) -> None:
    """Print every check, what was not tried, and the closed loop per pressure drop."""
    from dzdesign.verify.untried import not_tried

    console = console or new_console()
    for check in verification.evidence.checks:
        put_line(console, f"{verdict_words(check.holds)}  {check.name}: {check.text}")
    for name in not_tried(verification.evidence):
        put_line(console, f"{NOT_CHECKED}  {name}".replace("`", ""))
    if verification.loops:
        put_table(console, _closed_loop(verification))
    print_scenarios(verification.evidence.scenarios, console)
    print_scatter(verification.evidence.monte_carlo, console)
    put_line(console, verification.verdict)


def _closed_loop(verification: "Verification") -> Table:
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


def print_scenarios(scenarios: "Sequence[ScenarioResult]", console: "Console | None" = None) -> None:
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
    console = console or new_console()
    put_table(console, table)
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


def print_scatter(series: "MonteCarlo | None", console: "Console | None" = None) -> None:
    """Print the quantiles of a series of plants per pressure drop."""
    if series is None:
        return
    table = new_table(
        f"Series of {series.plants} plants: median (1 to 99 %)", "side", "dP (MPa)", "dead zone opening (%)",
        "closing (%)", "Q max (L/min)", "Q at zero (L/min)", "plants that leak",
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
    console = console or new_console()
    put_table(console, table)
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
    tests = {round(test.dp_MPa or 0.0, 6): test for test in valve.positive.tests}
    for loop in verification.loops:
        result = loop.result
        test = tests[round(result.dp_MPa, 6)]
        table.add_row(
            f"{result.dp_MPa:.2f}",
            f"{volts(test.u_knee_rising_V)} / {volts(test.u_knee_falling_V)}",
            _percent(result.dead_zone_opening),
            _percent(result.residual_opening),
            _percent(result.residual_closing),
            f"{result.q_zero_without_beta_L_min:.2f}",
            f"{result.q_zero_L_min:.2f}",
        )
    console = new_console()
    put_table(console, table)
    checked, wrong = (sum(getattr(each, name) for each in verification.evidence.inputs) for name in ("inputs", "wrong"))
    put_line(console, f"Inputs checked: {checked}, wrong: {wrong}")
    put_line(console, verification.verdict)
    put_line(console, f"Artefacts: {folder}")


def print_firmware_mutants(score: "MutationScore") -> None:
    """Print what of the wrong C was not killed, and why."""
    console = new_console()
    put_line(console, f"Mutants that were not killed; equivalent: {score.equivalent_means}")
    for each in score.not_killed:
        put_line(console, f"{each.verdict}, {each.file} line {each.line}: {each.change}")
