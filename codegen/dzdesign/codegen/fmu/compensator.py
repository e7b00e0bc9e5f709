"""The compensator as an FMU: its model, its core word for word that of the firmware, and what its template prints."""

from collections.abc import Mapping

from dzdesign.codegen.calibration.files import core_headers, core_sources
from dzdesign.codegen.fmu.description import Model
from dzdesign.codegen.fmu.variables import compensator_variables, full_output
from dzdesign.codegen.project import generate
from dzdesign.design.compensator import Compensator

#: Of a default experiment, s.
STOP_S = 10.0
#: The library for a PC: it takes the scalings of any compensator.
TARGET = "host"


def compensator_model(compensator: Compensator) -> Model:
    """Return what the FMU is called, and its variables."""
    return Model(
        identifier="dz_compensator",
        title="dzdesign compensator",
        description=f"Dead-zone compensator of a proportional valve, law {compensator.law}: the firmware's integers.",
        variables=compensator_variables(compensator),
        step_s=1 / compensator.signals.tick_Hz,
        stop_s=STOP_S,
        units=compensator.valve.recorded_units,
    )


def compensator_core(compensator: Compensator) -> dict[str, bytes]:
    """Return the files of the core, as `codegen --target host` writes them."""
    made = generate(compensator, TARGET).files
    names = (*core_headers(block=False, current=False), *core_sources(block=False, current=False))
    return {name: made[f"core/{name}"].encode() for name in names}


def compensator_values(compensator: Compensator) -> Mapping[str, object]:
    """Return what the template prints."""
    signals, command = compensator.signals, compensator.signals.command

    def codes(sign: int) -> str:
        return repr(float(sign * command.direction(sign) * (command.span(sign) + 1)))

    def per_MPa(zero: int, full: int, span: float) -> str:
        return repr((full - zero + 1) / span)

    a, b = signals.pressure_a, signals.pressure_b
    return {
        "suffixes": ["" if sign > 0 else "_negative" for sign in signals.signs],
        "bipolar": len(signals.signs) == 2,
        "tick_Hz": signals.tick_Hz,
        "ticks_per_sample": signals.tick_Hz // signals.sample_Hz,
        "code_max": signals.code_max,
        "compare_max": signals.compare_max,
        "u_max": repr(float(compensator.u_max_V)),
        "full_output": repr(full_output(compensator)[1]),
        "command_zero": command.zero_code,
        "positive_codes": codes(1),
        "negative_codes": codes(-1) if len(signals.signs) == 2 else "",
        "a_zero": a.zero_code,
        "a_codes": per_MPa(a.zero_code, a.full_code, float(a.span_MPa)),
        "b_zero": b.zero_code,
        "b_codes": per_MPa(b.zero_code, b.full_code, float(b.span_MPa)),
    }
