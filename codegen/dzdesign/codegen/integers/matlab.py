"""`output_files`: a compensator in; dz_comp.m, the script for Simulink's C Caller block and its C, out."""

from collections.abc import Mapping
from textwrap import wrap

from dzdesign.codegen.core.certificate_text import certificate_lines, zero_command
from dzdesign.codegen.integers.law import FUNCTIONS, PRESSURE_C, function_form
from dzdesign.codegen.integers.plc import left_out_of
from dzdesign.codegen.integers.text import COLUMNS, matlab_body, matlab_constants, rendered
from dzdesign.codegen.project import generate
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareOrigin
from dzdesign.design.pressure_inputs import what_machine_switches

TEMPLATE, SETUP = "dz_comp.m.jinja", "setup_c_caller.m"
#: The library for a PC: it takes the scalings of any compensator.
TARGET = "host"


def output_files(compensator: Compensator, origin: FirmwareOrigin, settings: Mapping[str, str]) -> dict[str, bytes]:
    """Return a function a sign of command, the script that sets up a C Caller block, and the core's C in core/.

    A compensator that controls the current is an `InputError`: the law alone says nothing of that loop.
    """
    del settings  # it has none
    if compensator.current_drive is not None:
        raise InputError(
            "the compensator controls the current, but a MATLAB function holds only the law; design it "
            "again with --drive duty, or take --target fmu or a C firmware"
        )
    signs, digest = compensator.signals.signs, origin.compensator_json
    files = {f"{FUNCTIONS[sign]}.m": law_function(compensator, digest, sign).encode() for sign in signs}
    files[SETUP] = _setup(compensator, digest).encode()
    made = generate(compensator, TARGET).files
    names = ("core/dz_comp.h", "core/dz_calibration.h", "core/dz_valve.h", "core/dz_comp.c")
    return {**files, **{name: made[name].encode() for name in names}}


def note_of(compensator: Compensator, settings: Mapping[str, str]) -> str:
    """Return what of a design a function of the law has not; empty where it has all of it."""
    del settings  # it has none
    left_out = ", ".join(left_out_of(compensator))
    return f"dz_comp.m is the law alone and leaves out, of this design: {left_out}" if left_out else ""


def law_function(compensator: Compensator, digest: str, sign: int) -> str:
    """Return the law of one sign of command as a function, of a compensator whose file has this SHA-256."""
    signals, units, form = compensator.signals, compensator.valve.recorded_units, function_form(compensator, sign)
    side = "" if len(signals.signs) == 1 else f", {'positive' if sign > 0 else 'negative'} commands"
    return rendered(
        TEMPLATE,
        compensator,
        digest,
        name=FUNCTIONS[sign],
        side_text=side,
        signals=signals,
        pair=signals.pair(sign),
        switched=wrap(what_machine_switches(compensator), COLUMNS - 4) if sign < 0 else [],
        status_bits={"A": 2, "B": 4, "C": PRESSURE_C},
        full_code=signals.command.full_code if sign > 0 else signals.command.negative_full_code,
        u_max=units.of_controller.text(float(compensator.u_max_V) * sign, "g V"),
        limit=compensator.drive_functions.compare_limit,
        at_zero=zero_command(compensator, sign),
        certificate=certificate_lines(compensator, sign),
        step_codes=compensator.beta_step_codes,
        step_text=units.text(float(signals.pair(sign).dp_MPa(compensator.beta_step_codes)), ".4f MPa"),
        zero_band=compensator.zero_band_codes,
        transition=compensator.transition_codes,
        constants=matlab_constants(form),
        body=matlab_body(form),
    )


def _setup(compensator: Compensator, digest: str) -> str:
    """Return the script that sets up a C Caller block."""
    names = [FUNCTIONS[sign] for sign in compensator.signals.signs]
    named = " and ".join(f"{name}()" for name in names)
    return rendered(
        f"{SETUP}.jinja", compensator, digest, bipolar=len(names) == 2, names=names, names_text=named,
        sources=["dz_comp.c"],
    )  # fmt: skip
