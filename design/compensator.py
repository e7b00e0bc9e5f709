"""`Compensator`: the law with exact rational coefficients, as the artefact compensator.json."""

import json
from dataclasses import dataclass
from fractions import Fraction
from types import NoneType
from typing import Any

from dzdesign.core.artefacts import TOOL, parse_document, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.shape import Exactly, Number, check_shape
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import drive, evaluate_line
from dzdesign.design.signals import Signals
from dzdesign.identify.valve_file import valve_from_document

SCHEMA = "dzdesign.compensator/1"
REMEDY = "make it again with `dzdesign design`"
#: What compensator.json must hold; a rational is a pair of integers that a double can still approximate.
CODE = Number(1, 65535, whole=True)
RATIONAL = Exactly(2, Number(-(10**60), 10**60, whole=True))
SHAPE = {
    "made_from": [{"source": str, "sha256": str}],
    "law": str,
    "u_max_V": RATIONAL,
    "signals": {
        "command_code_max": CODE,
        "pressure_code_max": CODE,
        "pressure_span_MPa": RATIONAL,
        "compare_max": CODE,
    },
    "k_x_max_over_u_max": RATIONAL,
    "u_min0_over_u_max": RATIONAL,
    "beta": {
        "denominator": Number(1, 2**30, whole=True),
        "step_codes": CODE,
        "numerators": [Number(1, 2**31, whole=True)],
    },
    "reverse_codes": Number(0, 65535, whole=True),
    "certificate": {
        "confidence": Number(0.5, 1),
        "guard": str,
        "level_L_min": Number(0, 1e6),
        "dp_MPa": (Exactly(2, RATIONAL), NoneType),
        "smallest_margin_V": (RATIONAL, NoneType),
    },
    "costs": [str],
    "valve": dict,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """What is proved about the offset, on the integers.

    Attributes
    ----------
    confidence : float
        With which the threshold's lower bounds hold together.
    guard : str
        ``closing`` or ``opening``: the threshold that they bound.
    level_L_min : float
        Flow that counted as flow when the thresholds were identified.
    dp_MPa : tuple of Fraction, or None
        Interval of the pressure drop on which it holds; None if the valve was tested without a pressure drop.
    smallest_margin_V : Fraction, or None
        Smallest distance from the offset to the lower bound, over every pressure code of the interval.
    """

    confidence: float
    guard: str
    level_L_min: float
    dp_MPa: tuple[Fraction, Fraction] | None
    smallest_margin_V: Fraction | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensator:
    """The law ``u_O = g(dP) u_i + o(dP)`` on code pairs, every coefficient an exact rational number.

    Attributes
    ----------
    law_name : str
        ``paper`` (Eq. 18) or ``target`` (meets Eq. 16).
    signals : Signals
        Scalings of command, pressures and compare value.
    u_max_V : Fraction
        Full command.
    k_x_max_over_u_max, u_min0_over_u_max : Fraction
        Coefficients, integers over a power of two; k x_max counts from the law's offset u_min0 on, not from the knee.
    beta_numerators : tuple of int
        Nodes of beta, over `beta_denominator`, at pressure codes 0, step, 2 step, ...; straight between them.
    beta_denominator, beta_step_codes : int
        Powers of two.
    reverse_codes : int
        Differences of pressure codes below ``-reverse_codes`` are taken as a failed sensor: the smallest beta is used.
    certificate : Certificate
        What is proved.
    costs : tuple of str
        What the safe choices cost, in a person's words.
    valve_document, valve_sha256 : str
        The valve.json it was designed from, whole, and its hash: provenance, and the plant for the closed loop.
    """

    law_name: str
    signals: Signals
    u_max_V: Fraction
    k_x_max_over_u_max: Fraction
    u_min0_over_u_max: Fraction
    beta_numerators: tuple[int, ...]
    beta_denominator: int
    beta_step_codes: int
    reverse_codes: int
    certificate: Certificate
    costs: tuple[str, ...]
    valve_document: str
    valve_sha256: str

    def __post_init__(self) -> None:
        law(self.law_name)
        for name in ("beta_denominator", "beta_step_codes"):
            value = getattr(self, name)
            if value < 1 or value & (value - 1):
                raise InputError(f"{name} is {value}, expected a power of two, so that the firmware needs no division")
        if not 0 <= self.reverse_codes <= self.signals.pressure_code_max // 20:
            raise InputError(f"reverse_codes is {self.reverse_codes}, expected noise about zero: up to 5 % of the span")
        nodes = self.signals.pressure_code_max // self.beta_step_codes + 2
        if len(self.beta_numerators) != nodes:
            raise InputError(f"beta has {len(self.beta_numerators)} nodes, expected {nodes} for every code")
        if not all(0 < numerator < 2 * self.beta_denominator for numerator in self.beta_numerators):
            raise InputError("every beta must lie between 0 and 2, exclusive")
        if not 0 < self.u_min0_over_u_max < 1:
            raise InputError(f"u_min0 is {float(self.u_min0_over_u_max):.3f} of u_max, expected between 0 and 1")
        if not 0 < self.u_max_V <= 10**4:
            raise InputError(f"u_max is {float(self.u_max_V):g} V, expected a positive command")
        if not 0 < self.k_x_max_over_u_max <= 10**3:
            raise InputError("k x_max/u_max must be positive")

    @property
    def fallback_beta(self) -> Fraction:
        """Smallest beta: the safe one when the pressure signal can't be right."""
        return Fraction(min(self.beta_numerators), self.beta_denominator)

    def beta(self, dp_code: int) -> Fraction:
        """Return beta at a difference of pressure codes, exactly."""
        if dp_code < -self.reverse_codes:
            return self.fallback_beta
        index, share = divmod(max(dp_code, 0), self.beta_step_codes)
        left, right = self.beta_numerators[index], self.beta_numerators[index + 1]
        return Fraction(
            left * (self.beta_step_codes - share) + right * share, self.beta_denominator * self.beta_step_codes
        )

    def counts(self, command_code: int, dp_code: int) -> Fraction:
        """Return the compare value of the law at a code pair, exactly: not rounded, not limited."""
        line = evaluate_line(
            law(self.law_name),
            beta=self.beta(dp_code),
            kappa=self.k_x_max_over_u_max,
            u_min0_over_u_max=self.u_min0_over_u_max,
            n_adc=self.signals.command_code_max,
            n_full=self.signals.compare_max,
        )
        return line.slope * command_code + line.start

    def drive(self, command_code: int, dp_code: int) -> Fraction:
        """Return u_O/u_max of the law at a code pair, exactly and before it is limited to 0...1."""
        return drive(self.counts(command_code, dp_code), self.signals.compare_max)

    def compare(self, command_code: int, dp_code: int) -> int:
        """Return the PWM compare value: the law rounded to the nearest count (a half goes up), limited to the range."""
        counts = self.counts(command_code, dp_code)
        rounded = (2 * counts.numerator + counts.denominator) // (2 * counts.denominator)
        return min(max(rounded, 0), self.signals.compare_max)

    def to_document(self) -> dict[str, Any]:
        """Return the JSON document of schema dzdesign.compensator/1; rationals as [numerator, denominator]."""
        signals, certificate = self.signals, self.certificate
        return {
            "schema": SCHEMA,
            "tool": TOOL,
            "made_from": [{"source": "valve.json", "sha256": self.valve_sha256}],
            "law": self.law_name,
            "u_max_V": _pair(self.u_max_V),
            "signals": {
                "command_code_max": signals.command_code_max,
                "pressure_code_max": signals.pressure_code_max,
                "pressure_span_MPa": _pair(signals.pressure_span_MPa),
                "compare_max": signals.compare_max,
            },
            "k_x_max_over_u_max": _pair(self.k_x_max_over_u_max),
            "u_min0_over_u_max": _pair(self.u_min0_over_u_max),
            "beta": {
                "denominator": self.beta_denominator,
                "step_codes": self.beta_step_codes,
                "numerators": list(self.beta_numerators),
            },
            "reverse_codes": self.reverse_codes,
            "certificate": {
                "confidence": certificate.confidence,
                "guard": certificate.guard,
                "level_L_min": certificate.level_L_min,
                "dp_MPa": [_pair(end) for end in certificate.dp_MPa] if certificate.dp_MPa else None,
                "smallest_margin_V": _pair(certificate.smallest_margin_V) if certificate.dp_MPa else None,
            },
            "costs": list(self.costs),
            "valve": json.loads(self.valve_document),
        }


def _pair(value: Fraction) -> list[int]:
    return [value.numerator, value.denominator]


def _fraction(pair: list[int], name: str) -> Fraction:
    numerator, denominator = pair
    if denominator <= 0:
        raise InputError(f"'{name}' is {pair}, expected a positive denominator")
    return Fraction(numerator, denominator)


def compensator_from_document(content: bytes, source: str) -> Compensator:
    """Read compensator.json; a missing or misshapen key is named.

    Raises
    ------
    InputError
        If the document is not a compensator of this schema.
    """
    document = parse_document(content, source, (SCHEMA,))
    check_shape(document, SHAPE, source, REMEDY)
    if not document["made_from"]:
        raise InputError(f"'{source}': 'made_from' is empty, expected the valve's hash; {REMEDY}")
    ends_known, margin_known = (document["certificate"][key] is not None for key in ("dp_MPa", "smallest_margin_V"))
    if ends_known != margin_known:
        raise InputError(f"'{source}': 'certificate' has one of dp_MPa and smallest_margin_V, expected both; {REMEDY}")
    valve = valve_from_document(to_json(document["valve"]).encode(), f"{source}: valve")
    if _fraction(document["u_max_V"], "u_max_V") != Fraction(repr(valve.u_max_V)):
        raise InputError(f"'{source}': 'u_max_V' is not that of its valve, {valve.u_max_V:g} V; {REMEDY}")
    try:
        signals, beta, certificate = document["signals"], document["beta"], document["certificate"]
        ends = certificate["dp_MPa"]
        return Compensator(
            law_name=document["law"],
            signals=Signals(
                command_code_max=signals["command_code_max"],
                pressure_code_max=signals["pressure_code_max"],
                pressure_span_MPa=_fraction(signals["pressure_span_MPa"], "signals.pressure_span_MPa"),
                compare_max=signals["compare_max"],
            ),
            u_max_V=_fraction(document["u_max_V"], "u_max_V"),
            k_x_max_over_u_max=_fraction(document["k_x_max_over_u_max"], "k_x_max_over_u_max"),
            u_min0_over_u_max=_fraction(document["u_min0_over_u_max"], "u_min0_over_u_max"),
            beta_numerators=tuple(beta["numerators"]),
            beta_denominator=beta["denominator"],
            beta_step_codes=beta["step_codes"],
            reverse_codes=document["reverse_codes"],
            certificate=Certificate(
                confidence=certificate["confidence"],
                guard=certificate["guard"],
                level_L_min=certificate["level_L_min"],
                dp_MPa=tuple(_fraction(end, "certificate.dp_MPa") for end in ends) if ends else None,
                smallest_margin_V=_fraction(certificate["smallest_margin_V"], "certificate.smallest_margin_V")
                if ends
                else None,
            ),
            costs=tuple(document["costs"]),
            valve_document=to_json(document["valve"]),
            valve_sha256=document["made_from"][0]["sha256"],
        )
    except InputError as error:
        raise InputError(f"'{source}': {error}; {REMEDY}") from error
