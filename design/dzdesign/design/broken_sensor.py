"""Effect of a failed pressure sensor that its signal does not reveal: the largest offset, and flow at zero command.

A threshold that falls with the pressure drop has its largest offset at a reading of none, one that grows has it at the
largest reading. Codes that a sound signal never makes give the smallest beta; a failure that makes sound ones can not.
"""

from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.signal_text import live_zero_signal
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.design.target_inputs import Converter

#: What `--accept` calls it.
ACCEPTED = "broken-sensor"


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenFailure:
    """Failures of a sensor that one side's law can't tell from a pressure, and what they cost at zero command."""

    #: In words, with the sensor's name.
    failures: tuple[str, ...]
    #: Pressure drop at which the offset passes most flow, of those tested.
    dp_MPa: float
    #: Flow there by the recorded characteristic on closing; None where it is below what the recording resolves.
    flow_L_min: float | None

    def text(self, units: RecordedUnits) -> str:
        """Return it as a sentence."""
        flow = "less flow than the recordings show"
        if self.flow_L_min is not None:
            flow = f"{units.text(self.flow_L_min, '.2f L/min')} at {units.text(self.dp_MPa, '.2f MPa')}"
        reads = "reads as a valid pressure and gives" if len(self.failures) == 1 else "read as valid pressures and give"
        return f"{' and '.join(self.failures)} {reads} the largest offset: {flow} at zero command"


def hidden_failure(compensator: Compensator, sign: int) -> HiddenFailure | None:
    """Return the failures that raise the offset of a side unseen; None where every one is seen or lowers it."""
    model, side = compensator.valve.sides[SIDE_NAMES[sign]], compensator.side(sign)
    if model.trend == "increasing":
        failures = compensator.signals.hidden_excess(sign, broken_code(compensator))
    elif model.trend == "decreasing":
        failures = compensator.signals.hidden_shortfall(sign, broken_code(compensator))
    else:
        return None
    if not failures:
        return None
    largest = max(side.beta) / compensator.beta_denominator
    offset_V = largest * float(side.u_min0_over_u_max * compensator.u_max_V)
    flows = []
    for test in model.tests:
        closing = test.recorded.closing
        flow = float(closing.flow_at(np.array([offset_V]))[0]) if offset_V > closing.u_seen_V else None
        flows.append((flow or 0.0, test.dp_MPa or 0.0, flow))
    _, dp_MPa, flow = max(flows, key=lambda each: each[:2])
    return HiddenFailure(failures=failures, dp_MPa=dp_MPa, flow_L_min=flow)


def broken_code(compensator: Compensator) -> int:
    """Return the largest code that a broken wire may read: the converter's offset, and its noise, at no voltage."""
    machine, target = compensator.machine, compensator.target
    if machine is not None:
        return machine.pressure_offset_codes + machine.pressure_noise_codes
    converter = target.converter if target else Converter()
    return converter.offset_codes + converter.noise_codes


def refuse_hidden_failures(compensator: Compensator) -> None:
    """Refuse pressure signals that hide a failure which opens the valve at zero command."""
    for sign in compensator.signals.signs:
        hidden = hidden_failure(compensator, sign)
        if hidden is not None:
            converter = compensator.target.converter if compensator.target else Converter()
            raise InputError(
                f"{hidden.text(compensator.valve.recorded_units.of_side(SIDE_NAMES[sign]))}; take a signal with a live "
                f"zero and room above, such as '{live_zero_signal(converter)}', or --accept {ACCEPTED}"
            )
