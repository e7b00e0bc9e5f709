"""The engineer's words on the machine, turned into a `Machine`; what is not declared takes a default that is named."""

import re
from collections.abc import Mapping
from fractions import Fraction

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import quantity_range, with_tolerance
from dzdesign.core.options import flag_of
from dzdesign.core.units import parse_quantity
from dzdesign.design.current.drive import CurrentRequest
from dzdesign.design.machine.machine import COPPER_PER_K, REFERENCE_C, DriveKind, Machine
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter, TargetInputs

#: Supplies of machines, V.
NOMINAL_V = (12.0, 24.0, 48.0)
DEFAULT_SENSOR = Fraction("0.001")
DEFAULT_SHUNT, DEFAULT_BENCH_CURRENT = Fraction("0.01"), 0.01
DEFAULT_OIL, DEFAULT_AGEING = 0.002, 0.005
#: Codes of the converter that the controlled current may be off: one in steady state, one of the calibrated offset.
CURRENT_CODES = 2
#: Options that say something of a machine, but do not declare one.
FURTHER = (
    "current_error", "bench_current", "pressure_error", "bench_pressure_error", "pressure_converter", "oil", "ageing",
)  # fmt: skip
#: Decimals of what stands in the file.
DIGITS = 9
NUMBER = r"[-+]?\d{1,6}(?:\.\d{0,9})?"
TEMPERATURE = re.compile(
    rf"\s*(?P<low>{NUMBER})\s*(?:(?:\.\.|to)\s*(?P<high>{NUMBER})\s*)?(?P<unit>(?:deg|°)?\s?[CF])\s*", re.ASCII
)
CODES = re.compile(r"\s*(\d{1,4})\s*\+\s*(\d{1,4})\s*\+\s*(\d{1,4})\s*codes?\s*", re.ASCII)


def machine_of(
    text: Mapping[str, str], target: TargetInputs, signals: Signals, current: CurrentRequest | None
) -> Machine | None:
    """Return the declared machine; None where none was declared.

    It is where coil temperature and supply, an amplifier or --drive current are.
    """
    given = {name for name, value in text.items() if value}
    drive = _drive(given, current)
    if drive is None:
        return None
    defaults: dict[str, str] = {}
    found = _coil(text, given, drive, defaults) | _current(text, drive, target.converter, current, defaults)
    if current is not None and "coil_temperature" in given:
        _check_coil(found["coil_temperature_C"], found["bench_coil_C"], current, text)  # type: ignore[arg-type]
    found |= _pressures(text, signals, target, defaults)
    for name, default, source in (
        ("oil", DEFAULT_OIL, "default: 0.2 %, the paper's Fig. 22"),
        ("ageing", DEFAULT_AGEING, "default: 0.5 %, a convention that no recording shows"),
    ):
        found[f"{name}_error"] = _share(text[name], flag_of(name)) if text[name] else default
        if not text[name]:
            defaults[f"{name}_error"] = source
    try:
        return Machine(drive=drive, **found, defaults=defaults)  # type: ignore[arg-type]
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
    for name in ("current_error", "bench_current"):
        if name in given:
            raise InputError(f"{flag_of(name)} is for --drive current, but --drive is duty; give --drive current")
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


def _coil(text: Mapping[str, str], given: set[str], drive: DriveKind, defaults: dict[str, str]) -> dict[str, object]:
    """Return coil temperature and supply, of the machine and of the bench."""
    found: dict[str, object] = {}
    if "coil_temperature" in given:
        found["coil_temperature_C"] = _temperatures(text["coil_temperature"], "--coil-temperature")
        bench = _temperatures(text["bench_coil"] or f"{REFERENCE_C} degC", "--bench-coil")
        if bench[0] != bench[1]:
            raise InputError(f"--bench-coil is {quoted(text['bench_coil'])}, expected one temperature")
        found["bench_coil_C"] = bench[0]
        if "bench_coil" not in given:
            defaults["bench_coil_C"] = f"default: {REFERENCE_C} degC on the bench, a coil that the ramps did not heat"
    if "supply" in given:
        low, high = quantity_range("voltage")(text["supply"], "--supply")
        found["supply_V"] = (round(low, DIGITS), round(high, DIGITS))
        inside = [nominal for nominal in NOMINAL_V if low <= nominal <= high]
        if "bench_supply" in given:
            found["bench_supply_V"] = round(parse_quantity(text["bench_supply"], "voltage", "--bench-supply"), DIGITS)
        elif len(inside) == 1:
            found["bench_supply_V"] = inside[0]
            defaults["bench_supply_V"] = f"default: {inside[0]:g} V on the bench, the nominal supply within --supply"
        elif drive == "duty":
            raise InputError(
                f"--supply is '{text['supply']}', in which not just one of 12, 24 and 48 V lies; give the bench's with "
                "--bench-supply"
            )
    return found


def _temperatures(text: str, option: str) -> tuple[float, float]:
    """Read one temperature, or two, in degrees Celsius or Fahrenheit."""
    found = TEMPERATURE.fullmatch(text)
    if found is None:
        raise InputError(f"{option} is {quoted(text)}, expected a temperature or two, such as '-20..80 degC'")
    ends = [Fraction(found["low"]), Fraction(found["high"] or found["low"])]
    if found["unit"].endswith("F"):
        ends = [(end - 32) * 5 / 9 for end in ends]
    if ends[0] > ends[1]:
        raise InputError(f"{option} is {quoted(text)}, expected the lower end first")
    low, high = (round(float(end), DIGITS) for end in ends)
    return low, high


def _current(
    text: Mapping[str, str],
    drive: DriveKind,
    converter: Converter,
    current: CurrentRequest | None,
    defaults: dict[str, str],
) -> dict[str, object]:
    """Return the accuracy of an amplifier or of the controlled current."""
    if drive == "amplifier":
        return {"amplifier_error": _share(text["amplifier"], "--amplifier")}
    if current is None:
        return {}
    codes = current.sensor.V_per_A * current.circuit.rated_A * converter.levels / float(converter.full_V)
    found: dict[str, object] = {"current_rest_error": round(CURRENT_CODES / codes, DIGITS)}
    defaults["current_rest_error"] = (
        f"default: {CURRENT_CODES} codes of the converter, of rounding and of the calibrated offset"
    )
    if text["current_error"]:
        found["current_error"] = _share(text["current_error"], "--current-error")
    else:
        gain = Fraction(converter.gain_codes, converter.levels)
        found["current_error"] = round(float(DEFAULT_SHUNT + gain), DIGITS)
        defaults["current_error"] = (
            f"default: 1 % of shunt and amplifier, {float(gain):.2%} of the target's converter (data sheet)"
        )
    if not text["bench_current"]:
        defaults["bench_current_error"] = "default: 1 % of the bench's current at a command"
        return found | {"bench_current_error": DEFAULT_BENCH_CURRENT}
    ampere, error = with_tolerance("current")(text["bench_current"], "--bench-current")
    if not ampere > 0:
        raise InputError(f"--bench-current is {quoted(text['bench_current'])}, expected more than zero")
    found["bench_full_A"] = round(ampere, DIGITS)
    if error is None:
        defaults["bench_current_error"] = "default: 1 % of the bench's current at a command"
    return found | {"bench_current_error": DEFAULT_BENCH_CURRENT if error is None else round(error / ampere, DIGITS)}


def _check_coil(
    coil_C: tuple[float, float], bench_C: float, current: CurrentRequest, text: Mapping[str, str]
) -> None:
    """Refuse temperatures at which the coil leaves the range of resistance that the current loop is designed for."""
    factors = [float(1 + COPPER_PER_K * Fraction(each - bench_C)) for each in coil_C]
    low, high = current.circuit.resistance_factors
    if factors[0] < low or factors[1] > high:
        raise InputError(
            f"--coil-temperature '{text['coil_temperature']}' makes the coil's resistance x {factors[0]:.3f} to "
            f"x {factors[1]:.3f}, beyond --coil's x {low:g}..{high:g}; widen that range, or narrow the temperatures"
        )


def _pressures(
    text: Mapping[str, str], signals: Signals, target: TargetInputs, defaults: dict[str, str]
) -> dict[str, object]:
    """Return the errors of the sensors, of the bench's, and of the converter on their channels."""
    spans = (signals.pressure_a.span_MPa, signals.pressure_b.span_MPa)
    parts = [part.strip() for part in text["pressure_error"].split("/")]
    if len(parts) > 2:
        raise InputError(f"--pressure-error is {quoted(text['pressure_error'])}, expected one error, or those of A / B")
    found: dict[str, object] = {}
    keys = ("pressure_error_a_MPa", "pressure_error_b_MPa")
    for key, part, span in zip(keys, (parts[0], parts[-1]), spans, strict=True):
        found[key] = _pressure(part, span, "--pressure-error") if part else round(float(DEFAULT_SENSOR * span), DIGITS)
        if not part:
            defaults[key] = "default: 0.1 % of the span, as the paper's sensors"
    bench = text["bench_pressure_error"]
    if bench:
        found["bench_pressure_error_MPa"] = _pressure(bench, spans[0], "--bench-pressure-error")
    else:
        found["bench_pressure_error_MPa"] = round(float(DEFAULT_SENSOR * sum(spans)), DIGITS)
        defaults["bench_pressure_error_MPa"] = "default: two sensors of 0.1 % of the span, as the paper's"
    names = ("pressure_offset_codes", "pressure_gain_codes", "pressure_noise_codes")
    codes: tuple[int, ...] = (
        target.converter.offset_codes, target.converter.gain_codes, target.converter.noise_codes,
    )  # fmt: skip
    if declared := text["pressure_converter"]:
        match = CODES.fullmatch(declared)
        if match is None:
            raise InputError(
                f"--pressure-converter is {quoted(declared)}, expected offset, gain error and noise, such as "
                "'15 + 30 + 4 codes'"
            )
        codes = tuple(map(int, match.groups()))
    else:
        defaults |= dict.fromkeys(names, f"default: the converter of {target.name} (data sheet)")
    return found | dict(zip(names, codes, strict=True))


def _pressure(text: str, span_MPa: Fraction, option: str) -> float:
    """Read a pressure, or a share of the span, MPa."""
    if text.endswith("%"):
        return round(float(Fraction(repr(_share(text, option))) * span_MPa), DIGITS)
    value = parse_quantity(text, "pressure", option) / 1e6
    if value < 0:
        raise InputError(f"{option} is {quoted(text)}, expected zero or more")
    return round(value, DIGITS)


def _share(text: str, option: str) -> float:
    value = parse_quantity(text, "ratio", option)
    if not 0 <= value <= 0.5:
        raise InputError(f"{option} is {quoted(text)}, expected 0 to 50 %")
    return round(value, DIGITS)
