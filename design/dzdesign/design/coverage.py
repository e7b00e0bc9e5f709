"""What the certificate covers, on which premise, and what it leaves out, in words."""

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.design_choices import Above
from dzdesign.design.side_law import Budget, Certificate
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.side_model import SideModel


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


def above_in_words(choice: Above, certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does above the tests, up to where that is certified, and on what premise."""
    curve, last = side.certified[certificate.guard], units.text(float(certificate.dp_MPa[1]), ".2f MPa")
    if choice == "hold" or (choice == "lower" and curve.above is None):
        why = "" if choice == "hold" else " (a single test gives no slope for lowering it)"
        return (
            f"above {last} the offset of the highest test is held{why} and nothing is certified: where the threshold "
            "falls, flow at zero command is possible"
        )
    released = certificate.released_from_MPa
    text = f"above {last} the offset falls with the continued bound"
    if choice == "release":
        text = f"above {last} the offset is released"
    if released is not None:
        at = units.text(float(released), ".3g MPa")
        text += f" and is zero from {at} on. There the full dead zone is back"
    holds_to = certificate.holds_to_MPa
    if curve.above is None:
        return f"{text}. Not certified: a single test gives no slope"
    rests = curve.above.in_words(curve.premise, side.trend or "flat", units)
    if released is not None and holds_to >= released > certificate.dp_MPa[1]:  # no offset is left beyond
        return f"{text}. Up to there this offset is {rests}"
    if holds_to > certificate.dp_MPa[1]:
        return f"{text}. Up to {units.text(float(holds_to), '.3g MPa')} this offset is {rests}"
    return f"{text}. {rests[0].upper()}{rests[1:]}"


def below_in_words(certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does below the lowest test, and what is known of the threshold there."""
    first = units.text(float(certificate.dp_MPa[0]), ".2f MPa")
    text = f"below {first} the offset of the lowest test is held and nothing is certified"
    if side.trend == "increasing":
        return f"{text}: the threshold grows with the pressure drop, so flow at zero command is possible there"
    if side.trend == "decreasing":
        return f"{text}. A threshold that keeps rising towards zero pressure drop stays above this offset"
    return text
