"""Coverage of a certificate and the deductions of the budget, in words for C, README, report and terminal."""

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.budget import Budget
from dzdesign.design.signals import SIDE_NAMES


def reach_of_certificate(compensator: Compensator) -> str:
    """Return a sentence on what the certificate counts of a machine, or that it counts nothing of one."""
    if compensator.machine is None:
        return (
            "The certificate covers the valve as recorded: no machine was declared, so coil temperature, "
            "supply voltage, pressure sensors, oil and ageing are not counted."
        )
    parts = []
    for sign in compensator.signals.signs:
        budget, name = compensator.side(sign).budget, SIDE_NAMES[sign]
        side = "" if compensator.negative is None else f"{name} commands: "
        if budget is not None:
            parts.append(side + taken_off(budget, compensator.valve.recorded_units.of_side(name)))
    return f"The certificate covers the valve as recorded and the declared machine: {'; '.join(parts)}."


def taken_off(budget: Budget, units: RecordedUnits) -> str:
    """Return by how much the offset's ceiling lies under the recorded threshold at most, and for what mostly."""
    place = max(range(len(budget.dp_MPa)), key=lambda at: budget.combined_mV[at])
    largest = budget.largest
    return (
        f"its budget takes {units.text(budget.combined_mV[place], '.0f mV')} from the recorded threshold at "
        f"{units.text(budget.dp_MPa[place], '.2f MPa')}; its largest component is {largest.component} "
        f"({largest.origin}), {units.text(largest.contribution_mV[place], '.0f mV')}"
    )


def not_counted(compensator: Compensator | None) -> tuple[str, ...]:
    """Return lines on what of a machine the certificate leaves out."""
    if compensator is None or compensator.machine is None:
        return (
            "The machine: another coil temperature or supply than on the bench, errors of its pressure sensors and of "
            "their converters beyond rounding, the oil and ageing. `dzdesign design` counts them where they are "
            "declared.",
            "Failures that the signals hide, and the spread between valves of a type.",
        )
    return (
        "A machine outside what was declared: the budget counts that, and nothing beyond it.",
        "Defaults of the budget that nobody measured on this machine; each is named in its table.",
        "Failures that the signals hide, and the spread between valves of a type.",
    )
