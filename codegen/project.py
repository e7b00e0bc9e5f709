"""`generate`: a `Compensator` and a target in, the files of a C project out."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from importlib.resources import files as files_of
from typing import TYPE_CHECKING, Any

from dzdesign.codegen.integer_form import IntegerForm, integer_form
from dzdesign.codegen.target import Target, folder_of
from dzdesign.codegen.telemetry import beta_factor
from dzdesign.codegen.user_names import printable_list
from dzdesign.core.artefacts import TOOL, sha256_of, to_json
from dzdesign.core.errors import InputError, nearest
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator

if TYPE_CHECKING:
    import jinja2

SCHEMA = "dzdesign.firmware/1"
PACKAGE = "dzdesign.codegen"
CORE_FILES = {"core/dz_comp.c": "dz_comp.c.jinja", "core/dz_comp.h": "dz_comp.h.jinja"}
NODES_IN_A_ROW = 5


def _found_targets() -> tuple[str, ...]:
    """Return the names of the folders that have a `target.py`, so that a new one needs no entry here."""
    folders = (entry for entry in files_of(PACKAGE).iterdir() if entry.is_dir())
    return tuple(sorted(entry.name.replace("_", "-") for entry in folders if (entry / "target.py").is_file()))


#: One folder a target; each has `target.py` with a `TARGET` and its templates.
TARGET_NAMES = _found_targets()


@dataclass(frozen=True, slots=True, kw_only=True)
class Firmware:
    """The files of a C project, path to text, and the manifest that names their origin."""

    files: Mapping[str, str]
    manifest: Mapping[str, Any]


def target_named(name: str) -> Target:
    """Return the target of that name.

    Raises
    ------
    InputError
        If there is none; the nearest name is proposed.
    """
    if name not in TARGET_NAMES:
        raise InputError(f"there is no target '{name}'{nearest(name, TARGET_NAMES)}; known: {', '.join(TARGET_NAMES)}")
    return import_module(f"{PACKAGE}.{folder_of(name)}.target").TARGET


def targets() -> tuple[Target, ...]:
    """Return every target, in the order of the names."""
    return tuple(target_named(name) for name in TARGET_NAMES)


def generate(compensator: Compensator, target_name: str, compensator_bytes: bytes | None = None) -> Firmware:
    """Generate the C project of a compensator for a target.

    Parameters
    ----------
    compensator : Compensator
        From `dzdesign.design.designing.design` or compensator.json.
    target_name : str
        One of `TARGET_NAMES`.
    compensator_bytes : bytes, optional
        The file it was read from; without it the document as it would be written.

    Raises
    ------
    InputError
        If the target is unknown, or its converter or PWM differs from the compensator's signals.
    """
    target = target_named(target_name)
    target.check_signals(compensator.signals)
    document = compensator_bytes or to_json(compensator.to_document()).encode()
    digest = sha256_of(document)
    recordings = ramp_tests_of(compensator)
    context = core_context(compensator, integer_form(compensator))
    hardware = {**target.context, **{key: context[key] for key in ("u_max_V", "pressure_span_MPa")}}
    hardware["firmware_origin"] = f"0x{digest[:4].upper()}"
    plans = [(CORE_FILES, environment(PACKAGE), context)]
    plans.append((target.templates, environment(f"{PACKAGE}.{target.folder}"), hardware))
    files = {
        path: _render(renderer, template, banner(template, digest, recordings), values)
        for templates, renderer, values in plans
        for path, template in templates.items()
    }
    files["compensator.json"] = document.decode()
    manifest = {
        "schema": SCHEMA,
        "tool": TOOL,
        "made_from": [{"source": "compensator.json", "sha256": digest}],
        "target": target.name,
        "law": compensator.law_name,
        "core": list(CORE_FILES),
    }
    return Firmware(files=files, manifest=manifest)


def core_context(compensator: Compensator, form: IntegerForm) -> dict[str, str | list[str]]:
    """Return the flat plan of printed strings for the core's templates."""
    chosen, signals = law(compensator.law_name), compensator.signals
    scale = form.table[0] // compensator.beta_numerators[0] * compensator.beta_denominator
    reverse = signals.dp_MPa(compensator.reverse_codes)
    largest = ((1 << form.reciprocal_shift) - 1) // max(
        1, form.reciprocal * form.divisor - (1 << form.reciprocal_shift)
    )
    step = compensator.beta_step_codes
    factor, factor_shift = beta_factor(scale * step, max(form.table) * step)
    zero_command = [compensator.compare(0, node * compensator.beta_step_codes) for node in range(len(form.table) - 1)]
    return {
        "certificate_text": certificate_text(compensator),
        "zero_command_low": str(min(zero_command)),
        "zero_command_high": str(max(zero_command)),
        "law_text": str(chosen.output).replace("**", "^"),
        "law_equation": chosen.equation,
        "kappa_text": _rational(compensator.k_x_max_over_u_max),
        "u_min0_text": _rational(compensator.u_min0_over_u_max),
        "u_max_V": f"{float(compensator.u_max_V):g}",
        "compare_max": str(signals.compare_max),
        "adc_code_max": str(max(signals.command_code_max, signals.pressure_code_max)),
        "command_code_max": str(signals.command_code_max),
        "pressure_code_max": str(signals.pressure_code_max),
        "pressure_span_MPa": f"{float(signals.pressure_span_MPa):g}",
        "reverse_codes": str(compensator.reverse_codes),
        "reverse_text": f"-{float(reverse):.3f} MPa",
        "table_length": str(len(form.table)),
        "table_rows": [
            " ".join(f"UINT32_C({value})," for value in form.table[start : start + NODES_IN_A_ROW])
            for start in range(0, len(form.table), NODES_IN_A_ROW)
        ],
        "beta_scale": str(scale),
        "beta_factor": str(factor),
        "beta_shift": str(factor_shift),
        "step_codes": str(compensator.beta_step_codes),
        "step_MPa": f"{float(signals.dp_MPa(compensator.beta_step_codes)):.4f}",
        "step_shift": str(form.step_shift),
        "step_mask": str(compensator.beta_step_codes - 1),
        "fallback": str(form.fallback),
        "slope": str(form.slope),
        "slope_c": _int32(form.slope),
        "offset": str(form.offset),
        "offset_c": _int32(form.offset),
        "linear": str(form.linear),
        "linear_shift": str(form.linear_shift),
        "half": str(form.half),
        "shift": str(form.shift),
        "divisor": str(form.divisor),
        "reciprocal": str(form.reciprocal),
        "reciprocal_shift": str(form.reciprocal_shift),
        "largest": str(largest),
    }


def certificate_text(compensator: Compensator) -> str:
    """Say in one comment line what the offset is certified for."""
    certificate = compensator.certificate
    low, high = (float(end) for end in certificate.dp_MPa)
    return (
        f"Certified for {low:.2f} to {high:.2f} MPa: below the {certificate.confidence:.0%} bound of the "
        f"{certificate.guard} threshold; flow below {certificate.level_L_min:.2f} L/min counts as none."
    )


def _rational(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.6f}"


def _int32(value: int) -> str:
    """Print a 32-bit constant that is one on every compiler, whatever its `long` is."""
    return f"{'-' if value < 0 else ''}INT32_C({abs(value)})"


def ramp_tests_of(compensator: Compensator) -> tuple[str, ...]:
    """Return the names of the recordings that the valve was identified from, as their users gave them."""
    made_from = json.loads(compensator.valve_document).get("made_from", ())
    return tuple(str(entry["source"]) for entry in made_from)


def environment(package: str) -> "jinja2.Environment":
    """Return the renderer of a package's templates, then of the shared ones: strict, a name without a value fails."""
    import jinja2

    packages = dict.fromkeys((package, PACKAGE))
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "templates") for name in packages]),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        autoescape=False,  # C and make, not HTML
    )


def banner(template: str, digest: str, recordings: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the lines that open every generated file: tool, template, hash and recordings; no date.

    Parameters
    ----------
    template : str
        File name of the template.
    digest : str
        SHA-256 of compensator.json.
    recordings : sequence of str
        Names from users; whatever could act in a comment is replaced.
    """
    lines = (
        f"Generated by dzdesign {TOOL['version']} from template {template}. Do not edit: generate it again.",
        f"Compensator SHA-256: {digest}",
    )
    return (*lines, f"Valve identified from: {printable_list(recordings)}") if recordings else lines


def _render(
    renderer: "jinja2.Environment", template: str, opening: tuple[str, ...], values: Mapping[str, str | list[str]]
) -> str:
    return renderer.get_template(template).render(banner=opening, project="dzdesign", **values)
