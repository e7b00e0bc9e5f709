"""Every requirement on a firmware or another output: id, title and how to have it checked; and its result.

The checks are of rooms that import this module. What runs them stands above them: `verification.REQUIREMENTS` and
`outputs.verification.REQUIREMENTS` are tuples of `Tried`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Generic, TypeVar

from msgspec import Meta

from dzdesign.core.display import DOES_NOT_HOLD, HOLDS, NOT_CHECKED

#: How what every run tries is tried; and that of some firmware alone.
EVERY_RUN, OF_SOME = "`verify`", "`verify` of a firmware "
IN_BLOCK_FORM, BY_CURRENT = f"{OF_SOME}in block form", f"{OF_SOME}with a current controller"
Context = TypeVar("Context")


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """Result of one requirement."""

    id: Annotated[str, Meta(description="Short name of the requirement, stable across versions.")]
    name: Annotated[
        str, Meta(description="Requirement, with the sign of the command or the processor to which it applies.")
    ]
    holds: Annotated[
        bool | None, Meta(description=f"True: {HOLDS}; false: {DOES_NOT_HOLD}; null: {NOT_CHECKED}, it could not be.")
    ]
    text: Annotated[str, Meta(description="Finding, with its figures.")]
    not_required: Annotated[
        tuple[str, ...], Meta(description="Findings beside the requirement, on which its verdict does not depend.")
    ] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """One requirement."""

    #: The same in every version.
    id: str
    #: What is required.
    title: str
    #: What to do to have it checked; a command stands in backticks.
    how: str = EVERY_RUN

    def check(self, *, holds: bool | None, text: str, name: str = "", not_required: tuple[str, ...] = ()) -> Check:
        """Return the result of a check; `name` says which part was tried, such as one processor's machine code."""
        return Check(id=self.id, name=name or self.title, holds=holds, text=text, not_required=not_required)


@dataclass(frozen=True, slots=True)
class Tried(Generic[Context]):
    """Requirements that one run tries together: what runs, which returns their checks, and when it does."""

    requirements: tuple[Requirement, ...]
    run: Callable[[Context], Iterable[Check]]
    when: Callable[[Context], bool]


def checks_of(rows: Sequence[Tried[Context]], context: Context) -> tuple[Check, ...]:
    """Return the checks of all requirements that apply, in their order; a run may find that the next ones do not."""
    return tuple(check for row in rows if row.when(context) for check in row.run(context))


#: The front door designs and generates again; this room, which shares no code with it, compares.
REPRODUCED = Requirement(id="reproduced", title="the files are reproduced from compensator.json")
#: Of Structured Text, and `STATES` of a function for MATLAB too.
OVERFLOW = Requirement(id="overflow", title="no operation leaves the range of its type")
STATES = Requirement(id="states", title="status and what is remembered match their description")
#: Of Structured Text that counts cycles.
DEBOUNCE = Requirement(
    id="debounce",
    title="a fault ends after its good cycles, and the interlock waits for zero command",
    how="`verify` of a function block with a cycle time",
)
COMPILES = Requirement(id="compiles", title="compiles without warnings")
INT_WIDTH = Requirement(id="int-width", title="no operation needs an int wider than the target's 16 bits")
EXACT_LAW = Requirement(id="exact-law", title="equals the exactly rounded law")
MONOTONE = Requirement(id="monotone", title="within range and monotone")
ZERO_COMMAND = Requirement(id="over-compensation", title="no over-compensation in the tested pressure range")
ABOVE_TESTS = Requirement(id="above-tests", title="the output at zero command above the tests matches the certificate")
LOT = Requirement(
    id="over-compensation-of-lot", title="no over-compensation of any valve in the lot", how=f"{OF_SOME}for a lot"
)
PRESSURE_DIFFERENCE = Requirement(
    id="pressure-difference", title="depends on the pressures only through their difference"
)
FALLBACK = Requirement(id="fallback", title="codes outside their signal's valid range give the safe value")
DRIVE = Requirement(id="drive", title="the drive follows its model")
#: Of a compensator that says with which options it was designed.
ASKED_FOR = Requirement(
    id="asked-for", title="drive and signals are those that were asked for", how=f"{OF_SOME}that says its options"
)
PLANT_OPENS = Requirement(id="plant-opens", title="the plant of the closed loop opens")
PLANT_IS_THE_VALVE = Requirement(id="plant-is-the-valve", title="the plant agrees with the identified valve")
ZERO_FLOW = Requirement(id="zero-flow", title="no flow at zero command in the closed loop")
ZERO_FLOW_AFTER_SCENARIOS = Requirement(
    id="zero-flow-after-scenarios", title="no flow at zero command after any required scenario"
)
COMPENSATES = Requirement(id="compensates", title="the dead zone is compensated, and the full flow remains")
NATIVE_PLANT = Requirement(id="native-plant", title="the plant of the closed loop agrees with CasADi's integrator")
#: Checked by the front door, which asks `identify`. Without it thresholds are taken as stated.
RAMPS = Requirement(
    id="identified-again",
    title="the ramp tests give this valve",
    how="`verify --ramps` with the recordings that valve.json was made from",
)
#: Checked by the front door too, of a firmware for both signs: it reads the recordings.
PRESSURE_INPUTS = Requirement(
    id="pressure-inputs",
    title="the pressure inputs, wired as recorded, give the recorded pressure drop",
    how="`verify --ramps` with the recordings that valve.json was made from",
)
BOARD_FILES = Requirement(id="board-files", title="your board files compile", how=f"{OF_SOME}with board files of yours")
#: Of a firmware in block form.
OWN_BLOCK = Requirement(
    id="block-accepted", title="the firmware accepts its calibration block and refuses damaged ones", how=IN_BLOCK_FORM
)
#: Of a firmware in block form: blocks of other valves than the one that lies in its folder.
CALIBRATION_BLOCK = Requirement(
    id="calibration-block",
    title="every input is right with the calibration block",
    how="`verify --blocks` with its file",
)
MACHINE_CODE = Requirement(
    id="machine-code", title="machine code of other processors is right in simulators", how="`verify --machine-code`"
)
#: Of FMUs.
FMU_VALID = Requirement(id="fmu-valid", title="FMPy finds no problem in the FMUs")
FMU_LAW = Requirement(id="fmu-law", title="the compensator's binary gives what its C code does, the exact law")
FMU_DRIVE = Requirement(
    id="fmu-drive", title="Co-Simulation follows the drive's model one step later, and Model Exchange at once"
)
FMU_UNITS = Requirement(id="fmu-units", title="inputs in V and MPa give the exact law of their codes")
FMU_CLOSED_LOOP = Requirement(id="fmu-closed-loop", title="the coupled FMUs behave as the closed loop")
#: Of an amplifier's file.
READ_BACK = Requirement(id="amplifier-read-back", title="the file is read back", how="`verify` of an amplifier's file")
SAFE = Requirement(
    id="amplifier-over-compensation",
    title="no over-compensation at zero command in the tested pressure range",
    how="`verify` of an amplifier's file",
)
DEAD_ZONES = Requirement(
    id="amplifier-dead-zones",
    title="the stated dead zones are those of the file's law",
    how="`verify` of an amplifier's file",
)
OWN_PLANT = Requirement(
    id="own-plant", title="the closed-loop requirements hold with the machine's plant", how="`verify --plant`"
)
#: Of a stand-in that was recorded at one pressure drop nothing is known at another.
LOAD_STEPS = Requirement(
    id="load-steps",
    title="load steps, and readings stuck during one, were tried in the closed loop",
    how="`verify --plant`",
)
#: The front door reads what the user states; a firmware of one solenoid moves a piston one way.
POSITION_LOOP = Requirement(
    id="position-loop",
    title="a position loop of the stated gain comes to rest",
    how=f"{OF_SOME}for both signs with --position-loop",
)
CURRENT_STATES = Requirement(
    id="current-controller", title="the current controller equals its exact model", how=BY_CURRENT
)
CURRENT_MARGINS = Requirement(id="current-margins", title="the current loop is stable at every corner", how=BY_CURRENT)
CURRENT_SETTLES = Requirement(id="current-settles", title="the current settles at every corner", how=BY_CURRENT)
CURRENT_STEP = Requirement(id="current-step", title="the current follows a step as fast as stated", how=BY_CURRENT)
CURRENT_FAULTS = Requirement(
    id="current-faults", title="an open, shorted or over-driven coil switches the output off", how=BY_CURRENT
)
CURRENT_SOLENOIDS = Requirement(
    id="current-solenoids",
    title="a solenoid is driven once no current flows in the other",
    how=f"{BY_CURRENT} of two solenoids",
)
CURRENT_VALVE = Requirement(
    id="current-valve", title="the valve opens at the same command with any coil and supply", how=BY_CURRENT
)
#: Of a target whose device is modelled: what runs on the model is the firmware, with its hardware files.
ON_DEVICE = f"{OF_SOME}for a device that is modelled"
HARDWARE_COMPILES = Requirement(id="hardware-compiles", title="the hardware files compile with the core", how=ON_DEVICE)
HARDWARE_PWM = Requirement(id="hardware-pwm", title="the PWM pin has its frequency, polarity and duty", how=ON_DEVICE)
HARDWARE_START = Requirement(
    id="hardware-start", title="the output is low from reset until the first valid sample", how=ON_DEVICE
)
HARDWARE_CHANNELS = Requirement(
    id="hardware-channels", title="each declared channel reaches its input, and the pin follows the law", how=ON_DEVICE
)
HARDWARE_TRIP = Requirement(id="hardware-trip", title="the trip input switches the output off", how=ON_DEVICE)
HARDWARE_SAMPLE_LOSS = Requirement(id="hardware-sample-loss", title="lost samples switch the output off", how=ON_DEVICE)
HARDWARE_WATCHDOG = Requirement(
    id="hardware-watchdog", title="the watchdog resets the device once the interrupt stops", how=ON_DEVICE
)
HARDWARE_RATES = Requirement(id="hardware-rates", title="interrupts and samples come at their rates", how=ON_DEVICE)
HARDWARE_SOLENOIDS = Requirement(
    id="hardware-solenoids", title="only one of the two solenoids is driven at a time", how=ON_DEVICE
)
HARDWARE_HALT = Requirement(
    id="hardware-halt", title="the output goes low when a debugger halts the processor", how=ON_DEVICE
)
HARDWARE_TELEMETRY = Requirement(
    id="hardware-telemetry", title="the telemetry says what the firmware does, on its line", how=ON_DEVICE
)
HARDWARE_CURRENT = Requirement(
    id="hardware-current", title="the current is sampled on its channel at its times", how=ON_DEVICE
)
OF_HARDWARE = (
    HARDWARE_COMPILES, HARDWARE_PWM, HARDWARE_START, HARDWARE_CHANNELS, HARDWARE_TRIP, HARDWARE_SAMPLE_LOSS,
    HARDWARE_WATCHDOG, HARDWARE_RATES, HARDWARE_SOLENOIDS, HARDWARE_HALT, HARDWARE_TELEMETRY,
    HARDWARE_CURRENT,
)  # fmt: skip
BOARD_CODE = Requirement(
    id="board-code", title="your board code runs on the device's model", how="`verify --board-code`"
)
#: What one run tries together: every input, the current loop, the closed loop.
OF_INPUTS = (EXACT_LAW, MONOTONE, ZERO_COMMAND, ABOVE_TESTS, PRESSURE_DIFFERENCE, FALLBACK)
OF_CURRENT = (CURRENT_STATES, CURRENT_MARGINS, CURRENT_SETTLES, CURRENT_STEP, CURRENT_FAULTS)
OF_LOOP = (
    PLANT_OPENS, PLANT_IS_THE_VALVE, ZERO_FLOW, ZERO_FLOW_AFTER_SCENARIOS, CURRENT_VALVE, COMPENSATES, NATIVE_PLANT,
)  # fmt: skip
#: What every run tries; evidence that lacks one of them is not that of a firmware that holds.
ALWAYS = (
    REPRODUCED, COMPILES, INT_WIDTH, *OF_INPUTS, DRIVE, *(each for each in OF_LOOP if each is not CURRENT_VALVE),
)  # fmt: skip
#: What the closed loop tries beside it, if it is given what that takes.
OF_GIVEN_LOOP = (OWN_PLANT, LOAD_STEPS)
#: What a verdict adds where the ramp tests were not there.
AS_STATED = "thresholds not checked against the recordings"
