"""Sections on the compensator: its law in exact numbers and in the C code's integers, and the uncertainty budget."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.derivation.account.equations import APPROACH, AT_REFERENCE, OFF_REFERENCE
from dzdesign.derivation.account.law_theorems import TARGET, TIES
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.law import law
from dzdesign.derivation.presentation.content import DerivationReport, Entry, Words
from dzdesign.derivation.presentation.report import closure, compose
from dzdesign.derivation.presentation.writers import HtmlWriter
from dzdesign.design.certificate import above_in_words, below_in_words, reach_of_certificate
from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs import signals_in_words
from dzdesign.design.side_law import ADDED_IN_FULL, Budget, BudgetLine
from dzdesign.report.artefacts import laws_of
from dzdesign.report.figure import (
    LIGHT,
    PressureHues,
    ReportFigure,
    csv_text,
    side_words,
    titled_axes,
    to_report_figure,
)
from dzdesign.report.page import (
    Cell,
    Section,
    Table,
    for_both_sides,
    in_number_font,
    number,
    recorded,
    shown_places,
    table_of,
    table_of_rows,
)
from dzdesign.verify.exhaustive.exact_law import ExactLaw

#: Units of a half-width that a person may see in another one, and how many digits.
SHOWN_UNITS = {"mV": ".3g mV", "MPa": ".3g MPa"}
BELOW_DP0 = {"hold": "β = 1, as in the paper", "extend": "β as tested"}


def law_section(compensator: Compensator | None, hues: PressureHues) -> Section:
    """Return the section on the law, its integers and signals; its derivation is added by the page."""
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
    return Section(
        figures=tuple(law_figure(compensator, name, len(laws) > 1, hues) for name in laws),
        lines=for_both_sides(lines),
        groups=(("What the codes stand for", tuple(signals_in_words(compensator))),),
        tables=(rounding_table(compensator),),
    )


def _exact(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.5f}"


def rounding_table(compensator: Compensator) -> Table:
    """Return what turning the law into integers costs."""
    u_max, units = compensator.u_max_V, compensator.valve.recorded_units
    rows: list[tuple[Cell | str, ...]] = []

    def add(what: str, in_c: str, exact: str, difference_mV: float) -> None:
        rows.append((what, in_c, exact, recorded(difference_mV, "+.3f mV", units)))

    for name, side in laws_of(compensator).items():
        certificate = side.certificate
        offset = side.u_min0_over_u_max * u_max
        of = f" ({name})" if len(laws_of(compensator)) > 1 else ""
        if not compensator.transition_codes:  # which counts from the opening threshold, the valve's curve does not
            wanted = Fraction(repr(compensator.valve.sides[name].certified[certificate.guard].u_min0_V))
            in_c, exact = (units.of_side(name).text(float(value), ".6f V") for value in (offset, wanted))
            add("u_min0" + of, in_c, exact, 1e3 * float(offset - wanted))
        denominator = compensator.beta_denominator
        add("one step of a node of β" + of, f"1/{denominator}", "rounded down", -1e3 * float(offset / denominator))
        largest = f"largest {units.text(1e3 * certificate.largest_loss_V, '.2f mV')}"
        how = "few nodes, rounding to codes and to counts"
        add("offset under the certified curve, mean" + of, how, largest, -1e3 * certificate.mean_loss_V)
    add("compare value", "a whole count", "half a count", 1e3 * float(u_max / compensator.signals.compare_max / 2))
    difference = f"difference, at most ({units.label('mV')})"
    return table_of_rows(
        "What the integers cost", ("number", "in the C code", "exact, or what is done", difference), rows
    )


#: All that the laws rest on: sections of the account. Of the others some take a second to import.
STATEMENTS = (*APPROACH, *AT_REFERENCE, *OFF_REFERENCE, *TIES, *TARGET)


@dataclass(frozen=True, slots=True, kw_only=True)
class LawAccount:
    """Where a law comes from: what it and all that it rests on are derived to be.

    `note` says what the law does and does not achieve; `main` has the numbers of the law and of what it rests on
    directly, whose steps are shown; `page` writes words and formulas.
    """

    note: Words
    derived: DerivationReport
    main: frozenset[str]
    page: HtmlWriter

    def outcome(self, entry: Entry) -> str:
        """Return the kind of a verdict's cell."""
        if not entry.as_expected or entry.outcome is Outcome.DOES_NOT_FOLLOW:
            return "bad"
        return {Outcome.FOLLOWS: "good", Outcome.FOLLOWS_IF: "open"}.get(entry.outcome, "text")


@cache
def account_of(law_name: str) -> LawAccount:
    """Derive a law from the paper's premises."""
    number = law(law_name).stated_as
    numbers = closure(STATEMENTS, [number])
    statements = [statement for statement in STATEMENTS if statement.number in numbers]
    return LawAccount(
        note=Words(law(law_name).note),
        derived=compose(prove(statements), numbers),
        main=frozenset(ground.number for ground in statements[-1].grounds) | {number},
        page=HtmlWriter(numbers),
    )


def law_figure(compensator: Compensator, name: str, both: bool, hues: PressureHues) -> ReportFigure:
    """Draw the output against the command at the ends of the tested interval, and the threshold's bound."""
    exact = ExactLaw(compensator, compensator.valve.sign_of(name))
    u_max, certificate = float(compensator.u_max_V), laws_of(compensator)[name].certificate
    units = compensator.valve.recorded_units.of_side(name)
    low, high = map(float, certificate.dp_MPa)
    figure, axes = titled_axes(3.2, name, both)
    bare = units.convert(np.array([0.0, u_max]), "V")
    axes.plot([0, 100], bare, ":", color=LIGHT["soft"], lw=1.3, label="without compensator")
    rows = []
    for dp_MPa, dash in ((low, "-"), (high, "--")):
        corners = exact.corners(exact.betas(round(compensator.signals.pair(exact.sign).dp_code(Fraction(dp_MPa)))))
        percent = [100 * away / exact.span for away, _ in corners]
        volts = [u_max * float(count) / exact.compare_max for _, count in corners]
        shown = units.convert(np.array(volts), "V")
        axes.plot(percent, shown, dash, color=hues.of(dp_MPa), lw=1.8, label=f"at {units.text(dp_MPa, '.2f MPa')}")
        rows += [[round(dp_MPa, 4), round(x, 4), round(y, 6)] for x, y in zip(percent, volts, strict=True)]
    bound = units.convert(min(compensator.valve.sides[name].certified[certificate.guard].u_lower_V), "V")
    axes.axhline(bound, color=LIGHT["green"], lw=1.2, ls="-.", label="least lower bound of the threshold")
    label = f"output u_O ({units.label('V')})"
    axes.set(xlabel="command u_i (% of full)", ylabel=label, xlim=(0, 100))
    if units.falling:
        axes.invert_yaxis()
    else:
        axes.set(ylim=(units.convert(0.0, "V"), None))
    axes.legend(loc="lower right")
    return to_report_figure(
        figure,
        f"law-{name}",
        f"The law in exact coefficients at both ends of the tested interval{side_words(name, both)}.",
        f"The compensator's output starts at {units.text(rows[0][2], '.3f V')} and ends at "
        f"{units.text(rows[-1][2], '.3f V')}.",
        csv_text(("dp_MPa", "command_percent", "output_V"), rows),
    )


# --- what is counted between the recorded threshold and the largest offset ----------------------------------


def budget_section(compensator: Compensator | None) -> Section:
    """Return the section on the budget of each side."""
    if compensator is None:
        return Section(missing="No compensator is here: `dzdesign design` makes compensator.json with its budget.")
    laws, units = laws_of(compensator), compensator.valve.recorded_units
    budgets = {name: law.budget for name, law in laws.items() if law.budget is not None}
    lines = [reach_of_certificate(compensator), f"The components are {ADDED_IN_FULL}."]
    if not budgets:
        return Section(lines=tuple(lines[:1]))
    both = len(budgets) > 1
    return Section(
        lines=tuple(lines),
        tables=[budget_table(budget, name, both, units.of_side(name)) for name, budget in budgets.items()],
    )


def budget_table(budget: Budget, name: str, both: bool, units: RecordedUnits) -> Table:
    """Return the components: origin, half-width, sensitivity, contribution at the pressure drops, and price."""
    millivolts, places = units.label("mV"), shown_places(len(budget.dp_MPa))

    def contribution(at: int) -> tuple[str, Callable[[BudgetLine], Cell]]:
        heading = f"{units.text(budget.dp_MPa[at], '.2f MPa')} ({millivolts})"
        return heading, lambda line: recorded(line.contribution_mV[at], ".2f mV", units)

    def component(line: BudgetLine) -> Cell:
        known = line.source.startswith(line.origin)
        return Cell(text=line.component, more=line.source if known else f"{line.origin}: {line.source}")

    table = table_of(
        f"Uncertainty budget{f', {name} commands' if both else ''}",
        budget.lines,
        ("component", component),
        ("half-width", lambda line: in_number_font(_half_width(line, units))),
        (f"sensitivity ({millivolts} per unit of it)", lambda line: in_number_font(_sensitivity(line, units))),
        *map(contribution, places),
        ("price (% of command)", lambda line: number(100 * line.price, 3)),
        csv=csv_text(
            ("component", "origin", "source", "half_width", "unit", "dp_MPa", "sensitivity_mV", "contribution_mV",
             "price_percent"),
            _budget_rows(budget),
        ),
        name=f"budget-components-{name}",
        notes=(
            "Contribution: by how much the component alone lowers what is certified. Sensitivity: that for one unit of "
            "its half-width, from the least to the most over the pressure drops.",
            "Price: the dead zone that the component costs, that is by how much the offset would rise without it.",
            "All together may differ from the sum: the drive, oil and ageing multiply what the others leave.",
        ),
    )  # fmt: skip
    combined = (recorded(budget.combined_mV[at], ".2f mV", units) for at in places)
    dash = in_number_font("–")
    return replace(table, rows=(*table.rows, (Cell(text="all together"), dash, dash, *combined, dash)))


def _half_width(line: BudgetLine, units: RecordedUnits) -> str:
    form = SHOWN_UNITS.get(line.unit)
    if form is not None:
        return units.text(line.half_width, form)
    return f"{line.half_width:.4g} {line.unit}"


def _sensitivity(line: BudgetLine, units: RecordedUnits) -> str:
    """Return from where to where the sensitivity runs, for one unit of the half-width as it is shown."""
    if line.unit == "mV":  # of the threshold itself
        return "–"
    one = units.convert(1.0, line.unit) if line.unit in SHOWN_UNITS else 1.0
    ends = (units.number(end(line.sensitivity_mV) / one, ".3g mV") for end in (min, max))
    return " to ".join(dict.fromkeys(ends))


def _budget_rows(budget: Budget) -> Iterator[tuple[object, ...]]:
    for line in budget.lines:
        for at, dp_MPa in enumerate(budget.dp_MPa):
            yield (
                line.component, line.origin, line.source, line.half_width, line.unit, dp_MPa, line.sensitivity_mV[at],
                line.contribution_mV[at], 100 * line.price,
            )  # fmt: skip
