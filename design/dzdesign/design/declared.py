"""The engineer's words on coil, supply, sensors and machine, as read for `DesignChoices`, become what is designed for.

What is not declared of a machine takes a default, which is named in the file.
"""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.options import flag_of
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.circuit import CoilCircuit, CurrentSensor
from dzdesign.design.current.drive import OVER_SHARE
from dzdesign.design.current.responses import CurrentRequest
from dzdesign.design.design_choices import DIGITS, read_error
from dzdesign.design.machine import REFERENCE_C, DriveKind, Machine
from dzdesign.design.signal_text import PinSignal, parse_signal
from dzdesign.design.signals import PressureSignal, Signals
from dzdesign.design.target_inputs import TargetInputs

#: Options that only current control has a use for, and those that it needs.
OF_CURRENT = ("coil", "rated_current", "current_signal", "supply_signal", "current_error", "bench_current")
NEEDED = ("coil", "rated_current", "supply", "current_signal")
#: Options that a controlled current leaves without effect.
OF_VOLTAGE = ("coil_temperature", "bench_coil", "bench_supply")
#: Behind the signal of the current: each of two solenoids has a shunt.
EACH = " each"
#: Of the ends of a sensor's range: that of the decimal numbers in them.
ROUNDING = 1e-9
#: Supplies of machines, V.
NOMINAL_V = (12.0, 24.0, 48.0)
DEFAULT_SENSOR = Fraction("0.001")
DEFAULT_SHUNT, DEFAULT_BENCH_CURRENT = Fraction("0.01"), 0.01
DEFAULT_OIL, DEFAULT_AGEING = 0.002, 0.005
#: Codes of the converter that the controlled current may be off: one in steady state, one of the calibrated offset.
CURRENT_CODES = 2
#: Options that say something of a machine, but do not declare one.
FURTHER = ("pressure_error", "bench_pressure_error", "pressure_converter", "oil", "ageing")


def current_request(
    text: Mapping[str, str], read: Mapping[str, Any], target: TargetInputs, signals: Signals
) -> CurrentRequest | None:
    """Return what is declared for current control; None for a drive by duty. Options come as texts and as read."""
    if text["drive"] == "duty":
        if useless := [flag_of(name) for name in OF_CURRENT if text[name]]:
            raise InputError(
                f"{useless[0]} is for --drive current, but --drive is duty; take it out, or give --drive current"
            )
        return None
    if target.current_sampling is None:
        raise InputError(f"the files of target {target.name} sample no current; give --drive duty, or another --target")
    if useless := [flag_of(name) for name in OF_VOLTAGE if text[name]]:
        raise InputError(
            f"{useless[0]} has no effect with --drive current, as the current loop is designed for the range of "
            "resistance in --coil; take it out, and state there what the temperatures make of it, such as '3.5 ohm x "
            "0.84..1.24, 40 mH' for -20 to 80 degC"
        )
    if missing := [flag_of(name) for name in NEEDED if not text[name]]:
        raise InputError(
            f"--drive current needs {', '.join(missing)}; write for example --coil '3.5 ohm 40 mH' --rated-current "
            "'1 A' --supply '18..32 V' --current-signal '0..1.2 A on 2 ohm + 0.15 V'"
        )
    if ".." not in text["supply"]:
        raise InputError(f"--supply is '{text['supply']}', expected lowest and highest voltage, such as '18..32 V'")
    try:
        circuit = CoilCircuit(rated_A=read["rated_current"], supply_V=read["supply"], **read["coil"])
    except RuleError as error:
        raise InputError(f"--coil, --rated-current and --supply: {error}") from error
    shunts, solenoids = 1 + text["current_signal"].endswith(EACH), len(signals.signs)
    if shunts > solenoids:
        raise InputError(
            f"--current-signal is {quoted(text['current_signal'])}, but a command of one sign drives one solenoid; "
            f"leave out '{EACH.strip()}'"
        )
    sensor = parse_signal(text["current_signal"].removesuffix(EACH), "--current-signal")
    sensor.check_within(target.converter)
    over = f", {OVER_SHARE:g} times the rated current, where the over-current fault trips"
    _check_measured(sensor, "--current-signal", "A", OVER_SHARE * circuit.rated_A, over)
    supply = parse_signal(text["supply_signal"], "--supply-signal") if text["supply_signal"] else None
    if supply is not None:
        _check_measured(supply, "--supply-signal", "V", circuit.supply_V[1], ", the highest --supply")
    return CurrentRequest(
        circuit=circuit,
        sensor=CurrentSensor(
            V_per_A=float(sensor.volts_per_unit),
            offset_V=float(sensor.offset_V),
            supply_divider=float(supply.volts_per_unit) if supply else 0.0,
        ),
        sampling=target.current_sampling,
        converter=target.converter,
        solenoids=solenoids,
        shunts=shunts,
    )


def _check_measured(signal: PinSignal, option: str, unit: str, needed: float, which: str) -> None:
    """Refuse a signal of another quantity, one that stands for something else, and one that ends too low."""
    if signal.unit != unit or signal.meaning is not None:
        example = "'0..1.2 A on 2 ohm + 0.15 V'" if unit == "A" else "'0..36 V x 0.075'"
        raise InputError(
            f"{option} is {quoted(signal.text)}, expected a range in {unit} that stands for itself, such as {example}"
        )
    if float(signal.high) < needed * (1 - ROUNDING):
        raise InputError(
            f"{option} is {quoted(signal.text)}, which ends at {float(signal.high):g} {unit}, expected {needed:g} "
            f"{unit} or more{which}"
        )


class _Keys:
    """Keys of `Machine`, and of each that was not declared where its default is from."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}
        self.defaults: dict[str, str] = {}

    def take(self, key: str, declared: Any, default: Any, source: str) -> None:
        """Set a key to what was declared, or else to its default."""
        self.values[key] = default if declared is None else declared
        if declared is None:
            self.defaults[key] = f"default: {source}"


def machine_of(
    text: Mapping[str, str],
    read: Mapping[str, Any],
    target: TargetInputs,
    sensors: Sequence[PressureSignal],
    current: CurrentRequest | None,
) -> Machine | None:
    """Return the declared machine; None where none was declared. Options come as texts and as read.

    It is where coil temperature and supply, an amplifier or --drive current are.
    """
    drive = _drive({name for name, value in text.items() if value}, current)
    if drive is None:
        return None
    keys = _Keys()
    _take_coil(keys, text, read, drive)
    if drive == "amplifier":
        keys.values["amplifier_error"] = read["amplifier"]
    if current is not None:
        _take_current(keys, text, read, current)
    _take_pressures(keys, text, read, sensors, target)
    keys.take("oil_error", read["oil"], DEFAULT_OIL, "0.2 %, the paper's Fig. 22")
    keys.take("ageing_error", read["ageing"], DEFAULT_AGEING, "0.5 %, a convention that no recording shows")
    try:
        return Machine(drive=drive, **keys.values, defaults=keys.defaults)
    except RuleError as error:
        raise InputError(f"the declared machine: {error}") from error


def _drive(given: set[str], current: CurrentRequest | None) -> DriveKind | None:
    """Return how the coil is driven, None of no declared machine; contradictions are refused."""
    for part, whole in (("bench_coil", "coil_temperature"), ("bench_supply", "supply")):
        if part in given and whole not in given:
            raise InputError(f"{flag_of(part)} is for {flag_of(whole)}, which is missing; give both, or neither")
    if current is not None:
        if "amplifier" in given:
            raise InputError(
                "--amplifier declares one that controls the current, and --drive current does so in the firmware; "
                "give one of them, and the accuracy of the latter with --current-error"
            )
        return "current"
    if "amplifier" in given:
        return "amplifier"
    declared = {"coil_temperature", "supply"} & given
    if len(declared) == 2:
        return "duty"
    if declared:
        there, lacking = ("coil_temperature", "supply") if "supply" not in declared else ("supply", "coil_temperature")
        raise InputError(
            f"{flag_of(there)} needs {flag_of(lacking)}, because the threshold as a duty goes with resistance over "
            "voltage; give both, or --amplifier where one controls the current"
        )
    if further := [flag_of(name) for name in FURTHER if name in given]:
        raise InputError(
            f"{further[0]} is of a declared machine, and none is; give --coil-temperature and --supply, --amplifier, "
            "or --drive current"
        )
    return None


def _take_coil(keys: _Keys, text: Mapping[str, str], read: Mapping[str, Any], drive: DriveKind) -> None:
    """Take coil temperature and supply, of the machine and of the bench."""
    if read["coil_temperature"] is not None:
        keys.values["coil_temperature_C"] = read["coil_temperature"]
        source = f"{REFERENCE_C} degC on the bench, a coil that the ramps did not heat"
        keys.take("bench_coil_C", read["bench_coil"], float(REFERENCE_C), source)
    if read["supply"] is None:
        return
    low, high = keys.values["supply_V"] = tuple(round(end, DIGITS) for end in read["supply"])
    inside = [nominal for nominal in NOMINAL_V if low <= nominal <= high]
    if read["bench_supply"] is not None:
        keys.values["bench_supply_V"] = round(read["bench_supply"], DIGITS)
    elif len(inside) == 1:
        source = f"{inside[0]:g} V on the bench, the nominal supply within --supply"
        keys.take("bench_supply_V", None, inside[0], source)
    elif drive == "duty":
        raise InputError(
            f"--supply is '{text['supply']}', in which not just one of 12, 24 and 48 V lies; give the bench's with "
            "--bench-supply"
        )


def _take_current(keys: _Keys, text: Mapping[str, str], read: Mapping[str, Any], current: CurrentRequest) -> None:
    """Take the accuracy of the controlled current, and of the bench's."""
    converter = current.converter
    codes = current.sensor.V_per_A * current.circuit.rated_A * current.codes_per_V
    source = f"{CURRENT_CODES} codes of the converter, of rounding and of the calibrated offset"
    keys.take("current_rest_error", None, round(CURRENT_CODES / codes, DIGITS), source)
    gain = Fraction(converter.gain_codes, converter.levels)
    source = f"1 % of shunt and amplifier, {float(gain):.2%} of the target's converter (data sheet)"
    keys.take("current_error", read["current_error"], round(float(DEFAULT_SHUNT + gain), DIGITS), source)
    ampere, error = read["bench_current"] or (None, None)
    if ampere is not None:
        if not ampere > 0:
            raise InputError(f"--bench-current is {quoted(text['bench_current'])}, expected more than zero")
        keys.values["bench_full_A"] = round(ampere, DIGITS)
    share = None if ampere is None or error is None else round(error / ampere, DIGITS)
    keys.take("bench_current_error", share, DEFAULT_BENCH_CURRENT, "1 % of the bench's current at a command")


def _take_pressures(
    keys: _Keys,
    text: Mapping[str, str],
    read: Mapping[str, Any],
    sensors: Sequence[PressureSignal],
    target: TargetInputs,
) -> None:
    """Take the errors of the sensors, of the bench's, and of the converter on their channels."""
    spans = [sensor.span_MPa for sensor in sensors]
    parts = [part.strip() for part in text["pressure_error"].split("/")]
    if len(parts) > len(spans):
        raise InputError(
            f"--pressure-error is {quoted(text['pressure_error'])}, expected one error, or those of A / B, or A / B / C"
        )
    for name, part, span in zip("abc", (parts[0], parts[min(1, len(parts) - 1)], parts[-1]), spans, strict=True):
        declared = _pressure(part, span, "--pressure-error") if part else None
        default, source = round(float(DEFAULT_SENSOR * span), DIGITS), "0.1 % of the span, as the paper's sensors"
        keys.take(f"pressure_error_{name}_MPa", declared, default, source)
    bench = text["bench_pressure_error"]
    keys.take(
        "bench_pressure_error_MPa",
        _pressure(bench, spans[0], "--bench-pressure-error") if bench else None,
        round(float(DEFAULT_SENSOR * sum(spans[:2])), DIGITS),
        "two sensors of 0.1 % of the span, as the paper's",
    )
    converter, errors = target.converter, read["pressure_converter"] or (None, None, None)
    known = (converter.offset_codes, converter.gain_codes, converter.noise_codes)
    for name, declared, default in zip(("offset", "gain", "noise"), errors, known, strict=True):
        keys.take(f"pressure_{name}_codes", declared, default, f"the converter of {target.name} (data sheet)")


def _pressure(text: str, span_MPa: Fraction, option: str) -> float:
    """Read a pressure, or a share of the span, MPa."""
    if text.endswith("%"):
        return round(float(Fraction(repr(read_error(text, option))) * span_MPa), DIGITS)
    value = parse_quantity(text, "pressure", option) / 1e6
    if value < 0:
        raise InputError(f"{option} is {quoted(text)}, expected zero or more")
    return round(value, DIGITS)
