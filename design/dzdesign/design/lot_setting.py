"""One setting for many valves: the largest offset that over-compensates none of them, and the proof of that.

Its offset lies, at every pressure code, under the least of the valves' certified ceilings. That it lies under the
bounds of every valve is proved of each of them, by `prove_lot`, here and where a compensator from a file is designed
again.

A compensator's file holds the valve that its certificate follows from. The common one holds a real valve of the batch,
its *carrier*, and never an invented one with the least thresholds of all: no ramp test ever showed that.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.recorded_units import worded
from dzdesign.design.beta_table import between_nodes, choose_beta_table
from dzdesign.design.ceiling import OffsetCeiling, OffsetCurve, at_codes, offset_ceiling
from dzdesign.design.certificate import guarded_curve, with_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs import costs_of
from dzdesign.design.designing import design, prove_monotone
from dzdesign.design.exact_row import ExactRow, least_of
from dzdesign.design.lot_valves import LotValve
from dzdesign.design.options import options_of
from dzdesign.design.side_design import finest_units, left_by_machine, offset_at_reference, over, travel
from dzdesign.design.side_law import SideLaw, Sides
from dzdesign.identify.valve.certified_bound import BoundPiece
from dzdesign.identify.valve.side_model import SideModel

#: Of u_max: a valve whose ceiling comes this near to the least one of all holds the setting down.
CLEAR = 1e-6
#: Over-compensated valves that a sentence names.
NAMED = 5
#: What all compensators of a batch must have in common.
SHARED = (
    "law", "below_dp0", "above", "signals", "u_max_V", "beta_denominator",
    "transition_codes", "command_error", "drive_functions", "current_drive", "machine",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LotMargin:
    """How far the offset of a lot setting stays under the bound of one valve."""

    #: Of the valve.
    name: str
    #: Pressure drop, where it is least.
    dp_MPa: Fraction
    #: The least distance; negative of a valve that is over-compensated.
    margin_V: Fraction


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSetting:
    """One compensator for all valves."""

    #: The common law; the valve in it is the carrier's.
    compensator: Compensator
    #: Name of the valve whose trend the law follows and whose certificate the file states.
    carrier: str
    #: Pressure drops that every valve was tested over: inside, the setting is certified for each of them.
    dp_MPa: tuple[float, float]
    #: Valves that hold the offset down where one was tested, or below. Above all tests, where the offset falls anyway,
    #: the steepest would: that costs no tested pressure drop anything.
    binding: tuple[str, ...]
    #: Of every valve of the batch: how far the offset stays under its bound.
    margins: tuple[LotMargin, ...]

    @property
    def worst(self) -> LotMargin:
        """The margin of the valve that has the least."""
        return min(self.margins, key=lambda each: each.margin_V)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Side:
    """One sign of command of all valves: curves, the least ceiling, and how far each valve's own lies above it."""

    sign: int
    models: Mapping[str, SideModel]
    curves: Mapping[str, OffsetCurve]
    least: OffsetCeiling
    nearness: Mapping[str, float]
    binding: frozenset[str]


def lot_setting(batch: Mapping[str, Compensator]) -> LotSetting:
    """Return the largest setting, under one direction of the threshold, that is certified for every valve.

    The batch gives each valve's own compensator by its name. Refused are valves designed with other options, or without
    a common pressure drop. The setting has no transition: it would end at one valve's opening threshold, which is
    another's flow, so a transition that was asked for is refused, and the default's is left out.
    """
    first = _without_transition(_shared_design(batch))
    sides = [_side(batch, first, sign) for sign in first.signals.signs]
    best: tuple[float, str, dict[int, SideLaw]] | None = None
    for carrier in _carriers(batch, sides):
        try:
            laws = {side.sign: _law(side, carrier, first) for side in sides}
        except RequirementError:  # no table of that carrier's direction lies under the least ceiling
            continue
        gain = sum(float(law.u_min0_over_u_max * sum(law.beta)) for law in laws.values())
        if best is None or gain > best[0]:
            best = gain, carrier, laws
    if best is None:
        raise InputError("no law of one direction lies under the least guarded offset of all valves")
    _, carrier, laws = best
    compensator = replace(
        _without_transition(batch[carrier]),
        sides=Sides.of(batch[carrier].valve, laws),
        costs=(),
        lot=_lot(batch, first, sides),
    )
    for side in sides:
        prove_monotone(compensator, side.sign)
    compensator = with_certificates(compensator)
    margins = prove_lot(compensator)
    line = (
        f"lot setting of {len(batch)} valves: under the bounds of each, with that valve's own confidence; this file "
        f"holds the valve {carrier}, for which the lines above are"
    )
    compensator = replace(compensator, costs=(*costs_of(compensator), line))
    return LotSetting(
        compensator=compensator,
        carrier=carrier,
        dp_MPa=_common_interval(side.curves for side in sides),
        binding=tuple(name for name in batch if any(name in side.binding for side in sides)),
        margins=margins,
    )


def _lot(batch: Mapping[str, Compensator], first: Compensator, sides: Sequence[_Side]) -> tuple[LotValve, ...]:
    """Return the valves with the bounds of the threshold that their compensators guard."""
    guards = {side.sign: first.side(side.sign).certificate.guard for side in sides}
    return tuple(
        LotValve.of(name, each.valve_json_sha256, {side.sign: side.models[name] for side in sides}, guards)
        for name, each in batch.items()
    )


def _shared_design(batch: Mapping[str, Compensator]) -> Compensator:
    """Return one compensator, whose options are those of all; refuse valves that were designed otherwise."""
    if len(batch) < 2:
        raise InputError(f"a lot setting needs two valves or more, got {len(batch)}")
    if alone := [name for name, each in batch.items() if each.positive is None]:
        raise InputError(
            f"'{alone[0]}' was tested with negative commands alone, of which no lot setting is made; record its "
            "positive ones too, or design each valve by itself"
        )
    name, first = next((name, each) for name, each in batch.items())
    for other, each in batch.items():
        unlike = [field for field in SHARED if getattr(each, field) != getattr(first, field)]
        if each.side().certificate.guard != first.side().certificate.guard:
            unlike.append("guard")
        if each.valve.dither != first.valve.dither:
            unlike.append("dither of the recordings")
        if unlike:
            raise InputError(f"{other} and {name} are designed with another {unlike[0]}, so no setting serves both")
    asked = (first.options or {}).get("transition", "auto")
    if first.transition_codes and asked != "auto":
        raise InputError(
            f"with --transition '{asked}' the law follows each valve's opening threshold, so no setting serves all"
        )
    return first


def _without_transition(own: Compensator) -> Compensator:
    """Return a valve's compensator as it is with ``--transition off``, and with the other options that it has."""
    if not own.transition_codes:
        return own
    if own.target is None or own.options is None:
        raise InputError("a valve's compensator does not say what it was designed with; make it again")
    off = options_of({**own.options, "transition": "off"}, own.target)
    return replace(design(own.valve, off), made_from=own.made_from)


def _common_interval(sides: Iterable[Mapping[str, OffsetCurve]]) -> tuple[float, float]:
    """Return the pressure drops that all curves cover, MPa."""
    ends = [(curve.dp_MPa[0], curve.dp_MPa[-1], name) for curves in sides for name, curve in curves.items()]
    low, _, highest = max(ends, key=lambda one: one[0])
    _, high, lowest = min(ends, key=lambda one: one[1])
    if low > high:
        raise InputError(
            worded(
                "the valves have no tested pressure drop in common ({highest} begins at {low:g MPa}, {lowest} ends at "
                "{high:g MPa}), so no setting is certified for all",
                highest=highest,
                low=float(low),
                lowest=lowest,
                high=float(high),
            )
        )
    return float(low), float(high)


def _side(batch: Mapping[str, Compensator], first: Compensator, sign: int) -> _Side:
    """Find the least ceiling of one sign of command, exactly, and which valves hold it down."""
    pair, allowance = first.signals.pair(sign), first.allowance(sign)
    models = {name: each.valve.side(sign) for name, each in batch.items()}
    guard = first.side(sign).certificate.guard
    curves = {
        name: guarded_curve(model, guard, first.below_dp0, first.above, first.machine) for name, model in models.items()
    }
    low, high = _common_interval([curves])
    doubles, least = [], list[ExactRow]()
    for curve in curves.values():  # of many valves the exact rows would fill the memory
        limit = offset_ceiling(curve, first.u_max_V, allowance).limit
        doubles.append(limit.doubles)
        least = [least_of([*least, limit])]
    certified = range(ceil(pair.dp_code(Fraction(repr(low)))), floor(pair.dp_code(Fraction(repr(high)))) + 1)
    ceiling = OffsetCeiling(limit=least[0], certified=certified)
    if ceiling.limit[: certified.stop].least() <= 0:
        raise InputError("one of the valves leaves no positive offset for a lot setting")
    tested = floor(pair.dp_code(max(curve.dp_MPa[-1] for curve in curves.values()))) + 1
    above_least = np.array(doubles) - ceiling.limit.doubles
    near = above_least[:, :tested].min(axis=1) < CLEAR
    return _Side(
        sign=sign, models=models, curves=curves, least=ceiling,
        nearness=dict(zip(curves, map(float, above_least.mean(axis=1)), strict=True)),
        binding=frozenset(name for name, is_near in zip(curves, near, strict=True) if is_near),
    )  # fmt: skip


def _carriers(batch: Mapping[str, Compensator], sides: Sequence[_Side]) -> list[str]:
    """Return, for each trend that a valve has, the valve of that trend whose own ceilings are nearest to the least."""
    nearest: dict[tuple[str | None, ...], tuple[float, str]] = {}
    for name in batch:
        trends = tuple(side.models[name].trend for side in sides)
        distance = sum(side.nearness[name] for side in sides)
        nearest[trends] = min(nearest.get(trends, (np.inf, "")), (distance, name))
    return [name for _, name in sorted(nearest.values())]


def _law(side: _Side, carrier: str, first: Compensator) -> SideLaw:
    """Choose the common coefficients and table of one side, in the direction of the carrier's threshold."""
    model, u_max = side.models[carrier], first.u_max_V
    reference = Fraction(repr(model.reference.dp_MPa))
    top = min(curve.at(reference) for curve in side.curves.values())
    if first.machine:
        top = left_by_machine(top, side.least, first.allowance(side.sign), reference, u_max)
    scale = finest_units(first.signals, transition_codes=0).coefficient
    u_min0 = offset_at_reference(top / u_max, first.signals, scale)
    goes_on = any(curve.above is not None for curve in side.curves.values())
    table = choose_beta_table(
        side.least,
        u_min0,
        model.trend,
        denominator=first.beta_denominator,
        above_one=model.trend == "increasing" or first.below_dp0 == "extend",
        above=first.above if goes_on else None,
    )
    # The longest travel: full command fully opens every valve.
    longest = max(travel(each, u_max, top) for each in side.models.values())
    return SideLaw(  # certificate and budget are those of this law as soon as it is in the carrier's compensator
        drive_range_over_u_max=over(longest, "nearest", scale),
        u_min0_over_u_max=u_min0,
        beta=table,
        certificate=first.side(side.sign).certificate,
    )


def lot_margins(compensator: Compensator) -> tuple[LotMargin, ...]:
    """Return each valve's margin, exactly: at every pressure drop of its tests, under the largest offset read there.

    Between two codes a bound is lowest at one of them or at an end of its piece; the codes that may be read there are
    those of both. Rounding, dither and the machine count as in a ceiling.
    """
    margins: dict[str, LotMargin] = {}
    for sign in compensator.signals.signs:
        drive = _Drive(compensator, sign)
        for valve in compensator.lot:
            side = valve.side(sign)
            if side is None:
                raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
            places = {place for piece in side.bound().pieces for place in drive.nearest(piece)}
            margin_V, dp_MPa = min(places)
            if valve.name not in margins or margin_V < margins[valve.name].margin_V:
                margins[valve.name] = LotMargin(name=valve.name, dp_MPa=dp_MPa, margin_V=margin_V)
    return tuple(margins.values())


class _Drive:
    """The offsets of a compensator's law of a sign, code by code, and how far bounds lie above them."""

    def __init__(self, compensator: Compensator, sign: int) -> None:
        law, count = compensator.side(sign), compensator.signals.pair(sign).largest_difference + 1
        scale = compensator.beta_denominator * compensator.beta_step_codes
        self.allowance = compensator.allowance(sign)
        self.kept_V = self.allowance.kept * compensator.u_max_V
        self.unit_V = law.u_min0_over_u_max * compensator.u_max_V / scale
        self.numerators = between_nodes(law.beta, count, compensator.beta_step_codes)
        low, high = self.allowance.window
        around = np.pad(self.numerators, (high, -low), mode="edge")
        #: The largest that may be read at a pressure whose code is whole.
        self.highest = np.lib.stride_tricks.sliding_window_view(around, high - low + 1).max(axis=1).tolist()

    def nearest(self, piece: BoundPiece) -> Iterator[tuple[Fraction, Fraction]]:
        """Yield the margin, V, and the pressure drop, MPa, of places one of which comes nearest to a piece's bound."""
        pair, (low, high) = self.allowance.pair, self.allowance.window
        ends = [pair.dp_code(end) for end in (piece.from_MPa, piece.to_MPa)]
        codes = range(max(ceil(ends[0]), 0), min(floor(ends[1]) + 1, self.numerators.size))
        places = [piece.from_MPa, piece.to_MPa]
        if codes:
            bounds, unit = at_codes(piece, pair.dp_MPa(1), codes)
            up, down = self.allowance.factor / unit, self.unit_V
            one, other = up.numerator * down.denominator, down.numerator * up.denominator
            left = [bound * one - self.highest[code] * other for bound, code in zip(bounds, codes, strict=True)]
            places.append(pair.dp_MPa(codes[left.index(min(left))]))
        for place in places:
            code = pair.dp_code(place)
            first, last = sorted((ceil(code) - high, floor(code) - low))  # between two codes both count
            first = max(min(first, self.numerators.size - 1), 0)
            read = int(self.numerators[first : max(last, first) + 1].max())
            yield self.allowance.factor * piece.at(place) - read * self.unit_V - self.kept_V, place


def prove_lot(compensator: Compensator) -> tuple[LotMargin, ...]:
    """Prove that a lot setting over-compensates no valve of its lot, and return the margins."""
    margins = lot_margins(compensator)
    above = sorted((each for each in margins if each.margin_V < 0), key=lambda each: each.margin_V)
    if above:
        worst, units = above[0], compensator.valve.recorded_units
        raise RequirementError(
            f"the lot setting over-compensates {len(above)} of {len(margins)} valves of its lot: "
            f"{and_more([each.name for each in above], NAMED)}; {worst.name} by "
            f"{units.text(-1e3 * float(worst.margin_V), '.3f mV')} at {units.text(float(worst.dp_MPa), '.2f MPa')}"
        )
    return margins
