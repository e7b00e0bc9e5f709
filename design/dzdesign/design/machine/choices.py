"""What `design` is told of the machine, in the engineer's words. Light on imports: the command line reads it."""

from dataclasses import dataclass
from typing import Annotated

from dzdesign.core.options import MACHINE, Option, Text


@dataclass(frozen=True, kw_only=True)
class MachineChoices:
    """Options of `design` on by how much the machine may differ from the bench."""

    coil_temperature: Annotated[Text, Option("T", MACHINE, example="-20..80 degC")] = None
    """Lowest and highest coil temperature of the machine, such as "-20..80 degC". Together with --supply it declares a
    machine whose coil is driven by the duty directly."""
    bench_coil: Annotated[Text, Option("T", MACHINE, example="20 degC")] = None
    """Coil temperature during the recording of the ramps (default: 20 degC)."""
    supply: Annotated[Text, Option("V", MACHINE, example="18..32 V")] = None
    """Lowest and highest supply voltage of the coil."""
    bench_supply: Annotated[Text, Option("V", MACHINE, example="24 V")] = None
    """Supply voltage during the recording of the ramps (default: 12, 24 or 48 V, the one within --supply)."""
    amplifier: Annotated[Text, Option("E", MACHINE, example="1 %")] = None
    """Accuracy of a current-controlling amplifier between PWM and coil, such as "1 %" (default: none, the duty drives
    the coil). It is the deviation from the bench over coil temperature and supply, relative to the value and not to
    full scale."""
    current_error: Annotated[Text, Option("E", MACHINE, example="1 %")] = None
    """Accuracy of the current under --drive current, relative to its value (default: 1 % and the gain error of the
    target's converter). It includes the shunt, its amplifier and the converter's gain."""
    bench_current: Annotated[Text, Option("I", MACHINE, example="1 A +- 1 %")] = None
    """Coil current at full command on the bench, with its accuracy, for --drive current, such as "1 A +- 1 %" (default:
    the rated current, to 1 %)."""
    pressure_error: Annotated[Text, Option("E", MACHINE, example="0.1 %")] = None
    """Error of the pressure sensors, offset and gain together (default: 0.1 %). It is a share of the span or a
    pressure, such as "0.1 %" or "0.02 MPa", or "0.1 % / 0.5 %" for A and B."""
    bench_pressure_error: Annotated[Text, Option("E", MACHINE, example="0.02 MPa")] = None
    """Error of the recorded pressure drop, as a pressure or as a share of the span (default: two sensors of 0.1 %)."""
    pressure_converter: Annotated[Text, Option("E", MACHINE, example="15 + 30 + 4 codes")] = None
    """Offset, gain error at the top of the range and peak noise of the converter on each pressure channel, such as
    "15 + 30 + 4 codes" (default: the target's data sheet)."""
    oil: Annotated[Text, Option("E", MACHINE, example="0.2 %")] = None
    """Change of the threshold with the oil temperature, relative to its value (default: 0.2 %)."""
    ageing: Annotated[Text, Option("E", MACHINE, example="0.5 %")] = None
    """Change of the threshold by ageing, relative to its value (default: 0.5 %)."""


#: Options that say something of a machine, but do not declare one.
FURTHER = (
    "current_error", "bench_current", "pressure_error", "bench_pressure_error", "pressure_converter", "oil", "ageing",
)  # fmt: skip
