"""The engineer's words on coil, supply and sensor, turned into a `CurrentRequest`."""

import re
from collections.abc import Mapping

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.options import flag_of
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.choosing import OVER_SHARE, CurrentSensor
from dzdesign.design.current.circuit import CoilCircuit
from dzdesign.design.current.drive import CurrentRequest
from dzdesign.design.signal_text import PinSignal, parse_signal
from dzdesign.design.target_inputs import TargetInputs

#: Options that only current control has a use for, and those that it needs.
OF_CURRENT = ("coil", "rated_current", "current_signal", "supply_signal")
NEEDED = ("coil", "rated_current", "supply", "current_signal")
#: Of the ends of a sensor's range: that of the decimal numbers in them.
ROUNDING = 1e-9
NUMBER = r"\d+(?:\.\d+)?(?:[eE]-?\d+)?"
RANGE = rf"(?:\s*x\s*(?P<{{0}}low>{NUMBER})\s*\.\.\s*(?P<{{0}}high>{NUMBER}))?"
COIL = re.compile(
    rf"(?P<ohm>{NUMBER})(?:\s*\+\s*(?P<series>{NUMBER}))?\s*(?P<ohms>[a-zΩ]+){RANGE.format('r')}"
    rf"\s*,?\s*(?P<henry>{NUMBER})\s*(?P<henries>[uµm]?H){RANGE.format('l')}"
)
SUPPLY = re.compile(rf"(?P<low>{NUMBER})\s*\.\.\s*(?P<high>{NUMBER})\s*(?P<unit>[mk]?V)")


def current_request(text: Mapping[str, str], target: TargetInputs) -> CurrentRequest | None:
    """Return what is declared for current control; None for a drive by duty."""
    if text["drive"] == "duty":
        if useless := [flag_of(name) for name in OF_CURRENT if text[name]]:
            raise InputError(f"{useless[0]} is for --drive current, but --drive is duty; give --drive current")
        return None
    if target.current_sampling is None:
        raise InputError(
            f"the files of target {target.name} sample no current; give --drive duty, or another --target"
        )
    if missing := [flag_of(name) for name in NEEDED if not text[name]]:
        raise InputError(
            f"--drive current needs {', '.join(missing)}; write for example --coil '3.5 ohm 40 mH' --rated-current "
            "'1 A' --supply '18..32 V' --current-signal '0..1.2 A on 2 ohm + 0.15 V'"
        )
    circuit, sensor = _circuit(text), parse_signal(text["current_signal"], "--current-signal")
    sensor.check_within(target.converter)
    _check_measured(sensor, "--current-signal", "A", OVER_SHARE * circuit.rated_A)
    supply = parse_signal(text["supply_signal"], "--supply-signal") if text["supply_signal"] else None
    if supply is not None:
        _check_measured(supply, "--supply-signal", "V", circuit.supply_V[1])
    return CurrentRequest(
        circuit=circuit,
        sensor=CurrentSensor(
            V_per_A=float(sensor.volts_per_unit),
            offset_V=float(sensor.offset_V),
            supply_divider=float(supply.volts_per_unit) if supply else 0.0,
        ),
        sampling=target.current_sampling,
    )


def _check_measured(signal: PinSignal, option: str, unit: str, needed: float) -> None:
    """Refuse a signal of another quantity, one that stands for something else, and one that ends too low."""
    if signal.unit != unit or signal.meaning is not None:
        example = "'0..1.2 A on 2 ohm + 0.15 V'" if unit == "A" else "'0..36 V x 0.075'"
        raise InputError(
            f"{option} is {quoted(signal.text)}, expected a range in {unit} that stands for itself, such as {example}"
        )
    if float(signal.high) < needed * (1 - ROUNDING):
        raise InputError(
            f"{option} is {quoted(signal.text)}, which ends at {float(signal.high):g} {unit}, expected {needed:g} "
            f"{unit} or more: beyond its end a sensor tells nothing"
        )


def _circuit(text: Mapping[str, str]) -> CoilCircuit:
    coil, supply = COIL.fullmatch(text["coil"].strip()), SUPPLY.fullmatch(text["supply"].strip())
    if coil is None:
        raise InputError(
            f"--coil is '{text['coil']}', expected resistance and inductance, such as '3.5 ohm 40 mH' or "
            "'3.5 + 0.5 ohm x 0.75..1.35, 40 mH x 0.5..1.5'"
        )
    if supply is None:
        raise InputError(f"--supply is '{text['supply']}', expected lowest and highest voltage, such as '18..32 V'")
    ohms = "ohm" if coil["ohms"] in ("ohm", "ohms", "Ω") else coil["ohms"]
    unit = parse_quantity(f"1 {ohms}", "resistance", "--coil")
    ranges = {
        f"{name}_factors": (float(coil[f"{letter}low"]), float(coil[f"{letter}high"]))
        for name, letter in (("resistance", "r"), ("inductance", "l"))
        if coil[f"{letter}low"]
    }
    series = {"series_ohm": float(coil["series"]) * unit} if coil["series"] else {}
    volts = [parse_quantity(f"{supply[end]} {supply['unit']}", "voltage", "--supply") for end in ("low", "high")]
    circuit = {
        "resistance_ohm": float(coil["ohm"]) * unit,
        "inductance_H": parse_quantity(f"{coil['henry']} {coil['henries']}", "inductance", "--coil"),
        "rated_A": parse_quantity(text["rated_current"], "current", "--rated-current"),
        "supply_V": (volts[0], volts[1]),
    }
    try:
        return CoilCircuit(**circuit, **series, **ranges)  # type: ignore[arg-type]
    except ValueError as error:
        raise InputError(f"--coil, --rated-current and --supply: {error}") from error
