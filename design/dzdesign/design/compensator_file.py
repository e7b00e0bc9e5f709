"""compensator.json: a `Compensator` written and read, every rational as [numerator, denominator]."""

import json
import re
from fractions import Fraction
from types import NoneType
from typing import Any

from dzdesign.core.artefact_files import TOOL, parse_document, sha256_of, to_json
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.shape import Exactly, Number, check_shape
from dzdesign.design.compensator import Certificate, Compensator, SideLaw
from dzdesign.design.drive import Amplifier
from dzdesign.design.lot_file import LOT, check_lot_hash, lot_document, lot_from_document
from dzdesign.design.request import DesignRequest, TargetInputs
from dzdesign.design.signal_text import Converter
from dzdesign.design.signals import CommandSignal, PressureSignal, Signals
from dzdesign.identify.valve.model import ValveModel

SCHEMA = "dzdesign.compensator/1"
REMEDY = "make it again with `dzdesign design`"
#: What compensator.json must hold; a rational is a pair of integers that a double can still approximate.
CODE = Number(0, 65535, whole=True)
POSITIVE = Number(1, 65535, whole=True)
RATIONAL = Exactly(2, Number(-(10**60), 10**60, whole=True))
CODES = Exactly(2, CODE)
STEPS = Exactly(2, Number(0, 2**30, whole=True))
NODES = [Number(1, 2**31, whole=True)]
SENSOR = {
    "span_MPa": RATIONAL,
    "zero_code": CODE,
    "full_code": CODE,
    "valid_codes": CODES,
    "error_MPa": Exactly(2, RATIONAL),
}
SIDE = {
    "k_x_max_over_u_max": RATIONAL,
    "u_min0_over_u_max": RATIONAL,
    "beta": NODES,
    "edge_beta": (NODES, NoneType),
    "certificate": {
        "confidence": Number(0.5, 1),
        "guard": str,
        "level_L_min": Number(0, 1e6),
        "dp_MPa": Exactly(2, RATIONAL),
        "smallest_margin_V": RATIONAL,
        "mean_loss_V": Number(-1e6, 1e6),
        "largest_loss_V": Number(-1e6, 1e6),
    },
}
SHAPE = {
    "made_from": [{"source": str, "sha256": str}],
    "law": str,
    "below_dp0": str,
    "u_max_V": RATIONAL,
    "signals": {
        "code_max": POSITIVE,
        "compare_max": POSITIVE,
        "sample_Hz": POSITIVE,
        "tick_Hz": POSITIVE,
        "command": {
            "zero_code": CODE,
            "full_code": CODE,
            "negative_full_code": (CODE, NoneType),
            "valid_codes": CODES,
        },
        "pressure_a": SENSOR,
        "pressure_b": SENSOR,
        "swapped": bool,
    },
    "beta_denominator": Number(1, 2**30, whole=True),
    "beta_step_codes": POSITIVE,
    "reverse_codes": CODE,
    "edge_codes": CODE,
    "sides": {"positive": SIDE, "negative": (SIDE, NoneType)},
    "amplifier": {
        "window_codes": CODE,
        "ramp_up": STEPS,
        "ramp_down": STEPS,
        "dither_counts": CODE,
        "dither_ticks": POSITIVE,
        "compare_limit": CODE,
    },
    "costs": [str],
    "valve": dict,
}
#: What `prove_derived` rests on. From a file without any of it nothing is generated, and `verify` calls it not checked;
#: one that lacks a part was edited.
ASKED = {
    "target": {
        "name": str,
        "converter_V": RATIONAL,
        "converter_levels": Number(2, 65536, whole=True),
        "compare_max": POSITIVE,
        "sample_Hz": POSITIVE,
        "tick_Hz": POSITIVE,
    },
    "options": dict,
    "common_valves": CODE,
    "valve_sha256": str,
}
#: What is checked where it is there.
LATER = {"tool": {"name": str, "version": str}, **ASKED, **LOT}
SHA256 = re.compile("[0-9a-f]{64}")
TARGET_NAME = re.compile("[a-z][a-z0-9]*(-[a-z0-9]+)*")


def compensator_document(compensator: Compensator) -> dict[str, Any]:
    """Return the JSON document of schema dzdesign.compensator/1; without a request it is as of before one was kept."""
    c, signals, amplifier = compensator, compensator.signals, compensator.amplifier
    valve = json.loads(c.valve_document)
    document = {
        "schema": SCHEMA,
        "tool": TOOL,
        "made_from": [{"source": "valve.json", "sha256": c.valve_sha256}],
        "target": _target_document(c.request.target) if c.request else None,
        "options": dict(c.request.options) if c.request else None,
        "common_valves": c.common_valves,
        "law": c.law_name,
        "below_dp0": c.below_reference,
        "u_max_V": _pair(c.u_max_V),
        "signals": {
            "code_max": signals.code_max,
            "compare_max": signals.compare_max,
            "sample_Hz": signals.sample_Hz,
            "tick_Hz": signals.tick_Hz,
            "command": {
                "zero_code": signals.command.zero_code,
                "full_code": signals.command.full_code,
                "negative_full_code": signals.command.negative_full_code,
                "valid_codes": list(signals.command.valid_codes),
            },
            "pressure_a": _sensor_document(signals.pressure_a),
            "pressure_b": _sensor_document(signals.pressure_b),
            "swapped": signals.swapped,
        },
        "beta_denominator": c.beta_denominator,
        "beta_step_codes": c.beta_step_codes,
        "reverse_codes": c.reverse_codes,
        "edge_codes": c.edge_codes,
        "sides": {
            "positive": _side_document(c.positive),
            "negative": _side_document(c.negative) if c.negative else None,
        },
        "amplifier": {
            "window_codes": amplifier.window_codes,
            "ramp_up": list(amplifier.ramp_up),
            "ramp_down": list(amplifier.ramp_down),
            "dither_counts": amplifier.dither_counts,
            "dither_ticks": amplifier.dither_ticks,
            "compare_limit": amplifier.compare_limit,
        },
        "costs": list(c.costs),
        "valve_sha256": _hash_of(valve),
        "valve": valve,
    }
    document |= lot_document(c.lot)
    return {key: value for key, value in document.items() if c.request or key not in ASKED}


def _hash_of(valve: dict[str, Any]) -> str:
    """Return the SHA-256 of the valve as it stands in compensator.json; that of its file depends on the spacing too."""
    return sha256_of(to_json(valve).encode())


def _target_document(target: TargetInputs) -> dict[str, Any]:
    return {
        "name": target.name,
        "converter_V": _pair(target.converter.full_V),
        "converter_levels": target.converter.levels,
        "compare_max": target.compare_max,
        "sample_Hz": target.sample_Hz,
        "tick_Hz": target.tick_Hz,
    }


def _sensor_document(sensor: PressureSignal) -> dict[str, Any]:
    return {
        "span_MPa": _pair(sensor.span_MPa),
        "zero_code": sensor.zero_code,
        "full_code": sensor.full_code,
        "valid_codes": list(sensor.valid_codes),
        "error_MPa": [_pair(end) for end in sensor.error_MPa],
    }


def _side_document(side: SideLaw) -> dict[str, Any]:
    certificate = side.certificate
    return {
        "k_x_max_over_u_max": _pair(side.k_x_max_over_u_max),
        "u_min0_over_u_max": _pair(side.u_min0_over_u_max),
        "beta": list(side.beta_numerators),
        "edge_beta": list(side.edge_numerators) if side.edge_numerators is not None else None,
        "certificate": {
            "confidence": certificate.confidence,
            "guard": certificate.guard,
            "level_L_min": certificate.level_L_min,
            "dp_MPa": [_pair(end) for end in certificate.dp_MPa],
            "smallest_margin_V": _pair(certificate.smallest_margin_V),
            "mean_loss_V": certificate.mean_loss_V,
            "largest_loss_V": certificate.largest_loss_V,
        },
    }


def compensator_from_document(content: bytes, source: str) -> Compensator:
    """Read compensator.json; a missing or misshapen key is named.

    Raises
    ------
    InputError
        If the document is not a compensator of this schema.
    """
    document = parse_document(content, source, (SCHEMA,))
    check_shape(document, SHAPE, source, REMEDY)
    _check_asked(document, source)
    check_shape(document, {key: shape for key, shape in LATER.items() if key in document}, source, REMEDY)
    _check_hashes(document, source)
    valve = read_artefact(to_json(document["valve"]).encode(), ValveModel, f"{source}: valve")
    if _fraction(document["u_max_V"], "u_max_V") != Fraction(repr(valve.u_max_V)):
        raise InputError(f"'{source}': 'u_max_V' is not that of its valve, {valve.u_max_V:g} V; {REMEDY}")
    if document.get("valve_sha256", _hash_of(document["valve"])) != _hash_of(document["valve"]):
        raise InputError(
            f"'{source}': 'valve' was changed since the compensator was designed from it ('valve_sha256' is that of "
            f"another); change valve.json, and {REMEDY}"
        )
    try:
        amplifier, negative = document["amplifier"], document["sides"]["negative"]
        return Compensator(
            law_name=document["law"],
            below_reference=document["below_dp0"],
            signals=_signals(document["signals"]),
            u_max_V=_fraction(document["u_max_V"], "u_max_V"),
            positive=_side(document["sides"]["positive"], "sides.positive"),
            negative=_side(negative, "sides.negative") if negative else None,
            beta_denominator=document["beta_denominator"],
            beta_step_codes=document["beta_step_codes"],
            reverse_codes=document["reverse_codes"],
            edge_codes=document["edge_codes"],
            amplifier=Amplifier(
                window_codes=amplifier["window_codes"],
                ramp_up=tuple(amplifier["ramp_up"]),
                ramp_down=tuple(amplifier["ramp_down"]),
                dither_counts=amplifier["dither_counts"],
                dither_ticks=amplifier["dither_ticks"],
                compare_limit=amplifier["compare_limit"],
            ),
            costs=tuple(document["costs"]),
            valve_document=to_json(document["valve"]),
            valve_sha256=document["made_from"][0]["sha256"],
            request=_request(document),
            common_valves=document.get("common_valves", 0),
            lot=lot_from_document(document),
        )
    except InputError as error:
        raise InputError(f"'{source}': {error}; {REMEDY}") from error


def _check_asked(document: dict[str, Any], source: str) -> None:
    """Refuse half of what the law is derived again from: the other half would be believed."""
    missing = [key for key in ASKED if document.get(key) is None]
    if missing and any(key in document for key in ASKED):
        raise InputError(f"'{source}' does not say '{missing[0]}', expected all of {', '.join(ASKED)}; {REMEDY}")


def _check_hashes(document: dict[str, Any], source: str) -> None:
    """Refuse what can't be a hash; that of valve.json counts its spacing, which is not kept, and can't be compared."""
    check_lot_hash(document, source)
    if not document["made_from"]:
        raise InputError(f"'{source}': 'made_from' is empty, expected the valve's hash; {REMEDY}")
    for index, entry in enumerate(document["made_from"]):
        if not SHA256.fullmatch(entry["sha256"]):
            raise InputError(
                f"'{source}': 'made_from[{index}].sha256' is {quoted(entry['sha256'])}, expected a SHA-256 of 64 "
                f"digits 0-9 and a-f; {REMEDY}"
            )


def _request(document: dict[str, Any]) -> DesignRequest | None:
    """Return what was asked for; None of a file that does not say, as all from before it was kept."""
    target, options = document.get("target"), document.get("options")
    if target is None or options is None:
        return None
    if not TARGET_NAME.fullmatch(target["name"]):
        raise InputError(f"'target.name' is {quoted(target['name'])}, expected a target such as 'f28335'")
    check_shape(options, dict.fromkeys(options, str), "options", "")
    full_V = _fraction(target["converter_V"], "target.converter_V")
    if full_V <= 0:
        raise InputError(f"'target.converter_V' is {float(full_V):g}, expected more than zero")
    return DesignRequest(
        target=TargetInputs(
            name=target["name"],
            converter=Converter(full_V=full_V, levels=target["converter_levels"]),
            compare_max=target["compare_max"],
            sample_Hz=target["sample_Hz"],
            tick_Hz=target["tick_Hz"],
        ),
        options=tuple(options.items()),
    )


def _signals(document: dict[str, Any]) -> Signals:
    command = document["command"]
    return Signals(
        code_max=document["code_max"],
        compare_max=document["compare_max"],
        sample_Hz=document["sample_Hz"],
        tick_Hz=document["tick_Hz"],
        command=CommandSignal(
            zero_code=command["zero_code"],
            full_code=command["full_code"],
            negative_full_code=command["negative_full_code"],
            valid_codes=tuple(command["valid_codes"]),
        ),
        pressure_a=_sensor(document["pressure_a"], "signals.pressure_a"),
        pressure_b=_sensor(document["pressure_b"], "signals.pressure_b"),
        swapped=document["swapped"],
    )


def _sensor(document: dict[str, Any], name: str) -> PressureSignal:
    return PressureSignal(
        span_MPa=_fraction(document["span_MPa"], f"{name}.span_MPa"),
        zero_code=document["zero_code"],
        full_code=document["full_code"],
        valid_codes=tuple(document["valid_codes"]),
        error_MPa=tuple(_fraction(end, f"{name}.error_MPa") for end in document["error_MPa"]),
    )


def _side(document: dict[str, Any], name: str) -> SideLaw:
    certificate = document["certificate"]
    return SideLaw(
        k_x_max_over_u_max=_fraction(document["k_x_max_over_u_max"], f"{name}.k_x_max_over_u_max"),
        u_min0_over_u_max=_fraction(document["u_min0_over_u_max"], f"{name}.u_min0_over_u_max"),
        beta_numerators=tuple(document["beta"]),
        edge_numerators=tuple(document["edge_beta"]) if document["edge_beta"] is not None else None,
        certificate=Certificate(
            confidence=certificate["confidence"],
            guard=certificate["guard"],
            level_L_min=certificate["level_L_min"],
            dp_MPa=tuple(_fraction(end, f"{name}.certificate.dp_MPa") for end in certificate["dp_MPa"]),
            smallest_margin_V=_fraction(certificate["smallest_margin_V"], f"{name}.certificate.smallest_margin_V"),
            mean_loss_V=certificate["mean_loss_V"],
            largest_loss_V=certificate["largest_loss_V"],
        ),
    )


def _pair(value: Fraction) -> list[int]:
    return [value.numerator, value.denominator]


def _fraction(pair: list[int], name: str) -> Fraction:
    numerator, denominator = pair
    if denominator <= 0:
        raise InputError(f"'{name}' is {pair}, expected a positive denominator")
    return Fraction(numerator, denominator)
