"""`BoundProof`: what a certified bound follows from, so that a reader can prove it again without a solver.

The ramps' thresholds give the class of curves and the data set (`fit.curve_class`, `fit.certificate`): rows A g >= r
that every next closing's threshold g meets. Of each node the rows that matter are named, with their multipliers l >= 0.
They satisfy A'l = e, the node itself, so that l'r is a lower bound of g there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.fit.certificate import Certificate, Criticals, data_sets, proved_offsets
from dzdesign.identify.fit.curve_class import CurveClass, Kind, find_class, one_way
from dzdesign.identify.fit.ramp_model import Ramps, fit_ramp_model
from dzdesign.identify.fit.scatter import Origin, Scatter, describe_scatter, unlike_at
from dzdesign.identify.valve.quantity_types import PressureDrop, SecondDifference, Voltage, VoltageError

#: What a bound of the file may lie above its proof by, V: its last digit, and those of the critical values.
ROUNDING_V = 1e-6
#: Pairs of a row and its multiplier.
Multipliers = Annotated[str, Meta(max_length=4096, pattern=r"^(\d{1,4}:\d{1,9}(\.\d{1,17})?(e[-+]?\d{1,2})?( |$))*$")]
Deviations = Annotated[float, quantity("1", ge=0, le=1e9)]


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedRamp:
    """The guarded threshold by one ramp."""

    source: str
    """File of the ramp, and its number and times if the file has several."""
    dp_MPa: PressureDrop | None
    """Pressure drop of its test; null if it is unknown."""
    u_V: Voltage
    """Guarded threshold by this ramp."""
    se_V: VoltageError
    """Standard error by the noise of the ramp's own line."""
    budget_V: VoltageError
    """Systematic error to allow for: lag and zero error of the meter, leak, soft edge, and stick-slip."""
    place: Annotated[float, quantity("1", ge=-0.5, le=0.5)] | None
    """Place in the series, from -0.5 at the first ramp to 0.5 at the last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RampSetAside:
    """A ramp that lies off and that the bound does not count: that the valve will not do it again is a premise."""

    source: Annotated[str, Meta(description="File of the ramp, and its number and times if the file has several.")]
    u_V: Annotated[Voltage, Meta(description="Guarded threshold by this ramp.")]
    distance_V: Annotated[Voltage, Meta(description="Distance of this threshold from where the other ramps put it.")]
    deviations: Annotated[Deviations, Meta(description="Distance in standard deviations of such a distance.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateProof:
    """Multipliers that prove the bound of a valve in one state, node by node."""

    state: Annotated[float, quantity("1", ge=-0.5, le=0.5)]
    """State of the valve, as a place in the series; 0 without a drift."""
    direction: Literal[-1, 0, 1]
    """Direction of the curve for monotone: falling -1, rising 1; else 0."""
    multipliers: tuple[Multipliers, ...]
    """Rows that matter at each node, and the multiplier of each, such as 3:0.25 17:0.75. Rows count from 0: those of
    the class from below, from above, floors, then roofs."""

    def rows_and_multipliers(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return the rows that matter at each node, and their multipliers."""
        pairs = [[pair.split(":") for pair in each.split()] for each in self.multipliers]
        rows = [np.array([row for row, _ in each], dtype=int) for each in pairs]
        return rows, [np.array([value for _, value in each], dtype=float) for each in pairs]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundProof:
    """Ramps, scatter and multipliers from which the bound follows."""

    ramps: Annotated[tuple[GuardedRamp, ...], Meta(min_length=1)]
    """Ramps that count."""
    set_aside: tuple[RampSetAside, ...]
    """Ramps that lie off and do not count."""
    shared_budget_V: VoltageError
    """Systematic error that all ramps have in common: the meter's lag."""
    knots_MPa: Annotated[tuple[float, ...], quantity("MPa")]
    """Knots of the curve, by the ramps' pressure drops alone."""
    sd_V: VoltageError
    """Standard deviation of one ramp, its noise included."""
    origin: Origin
    """Whether that was measured on repeats, declared by --repeatability, or assumed."""
    known_sd_V: VoltageError
    """Declared or assumed standard deviation from ramp to ramp."""
    least_sd_V: VoltageError
    """Least standard deviation: half the distance of two groups of ramps; 0 without such groups."""
    unlike_knot: Annotated[int, Meta(ge=0)] | None
    """Knot, from 0, whose ramps scatter more than the others; null if they scatter alike."""
    floor: Deviations
    """Standard deviations from the sums of the ramps to their floors."""
    roof: Deviations | None
    """Standard deviations from the sums of the ramps to their roofs; null if nothing is certified between the tests."""
    floor_unlike: Deviations | None
    """The floor at the knot that scatters more."""
    roof_unlike: Deviations | None
    """The roof at the knot that scatters more."""
    declared: Literal["line", "smooth", "monotone"] | None
    """Premise that was declared; null if the bends were estimated, or nothing is between tests."""
    curvature_V_MPa2: SecondDifference | None
    """Declared M of a smooth curve."""
    direction: Literal[-1, 0, 1]
    """Direction that a monotone curve was given: -1, 1, or 0 for either."""
    states: Annotated[tuple[StateProof, ...], Meta(min_length=1)]
    """Proofs of the bound in each state."""

    def scatter(self) -> Scatter:
        """Return the scatter of the ramps."""
        declared = self.known_sd_V if self.origin == "declared" else None
        dp = [1.0 if ramp.dp_MPa is None else ramp.dp_MPa for ramp in self.ramps]
        places = [ramp.place for ramp in self.ramps if ramp.place is not None]
        ramps = Ramps(
            dp_MPa=np.array(dp), y=np.array([ramp.u_V for ramp in self.ramps]),
            se=np.array([ramp.se_V for ramp in self.ramps]),
            clock=np.array(places) if len(places) == len(dp) else None,
            budget=np.array([ramp.budget_V for ramp in self.ramps]),
            shared=self.shared_budget_V,
        )  # fmt: skip
        model = fit_ramp_model(ramps, share_knots=declared is None)
        unlike = None if self.unlike_knot is None else unlike_at(model, self.unlike_knot, 0.0)
        return describe_scatter(model, unlike, declared=declared, assumed=self.known_sd_V, least=self.least_sd_V)

    def curves(self, scatter: Scatter) -> CurveClass:
        """Return the class of curves."""
        return find_class(scatter, curve=self.declared, curvature=self.curvature_V_MPa2, direction=self.direction)

    def bound(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodes, MPa, and the bound that the rows prove there, V."""
        scatter = self.scatter()
        curves = self.curves(scatter)
        criticals = Criticals(
            floor=self.floor, roof=self.roof, floor_unlike=self.floor_unlike, roof_unlike=self.roof_unlike
        )
        data = {known.state: known for known in data_sets(scatter, curves.grid_MPa, criticals)}
        classes = {each.direction: each for each in one_way(curves)}
        if {each.state for each in self.states} != set(data) or any(
            each.direction not in classes or len(each.multipliers) != curves.grid_MPa.size for each in self.states
        ):
            raise RuleError("the proofs of a bound are not those of the states and nodes that follow from its ramps")
        proved = []
        for each in self.states:
            offsets = proved_offsets(classes[each.direction], data[each.state], *each.rows_and_multipliers())
            proved.append(classes[each.direction].under_chords(offsets))
        return curves.grid_MPa, np.min(proved, axis=0)

    def check(self, dp_MPa: Sequence[float], bound_V: Sequence[float]) -> None:
        """Refuse a bound that lies above what its multipliers prove."""
        try:
            nodes, proved = self.bound()
        except (ArithmeticError, IndexError, np.linalg.LinAlgError) as error:  # of an edited file
            raise RuleError("knots, states and rows of the proof are not those of its ramps") from error
        if dp_MPa and (len(dp_MPa) != nodes.size or np.any(np.abs(nodes - dp_MPa) > ROUNDING_V)):
            raise RuleError("the nodes of the bound do not follow from the pressure drops of its ramps")
        above = np.array(bound_V) - proved
        if np.any(above > ROUNDING_V):
            worst = int(above.argmax())
            raise RuleError(
                f"the bound at {nodes[worst]:g} MPa is {bound_V[worst]:g} V, but the ramps and their multipliers prove "
                f"{proved[worst]:g} V"
            )

    @classmethod
    def of(
        cls,
        scatter: Scatter,
        certificate: Certificate,
        *,
        sources: Sequence[str],
        y: np.ndarray,
        known_sd_V: float,
        least_sd_V: float,
        curvature: float | None,
        with_dp: bool,
    ) -> "BoundProof":
        """Return what a certificate rests on; `sources` and `y` are of all ramps, those set aside too."""
        ramps, curves, criticals = scatter.model.ramps, certificate.curves, certificate.criticals
        kept = [source for source, counts in zip(sources, scatter.kept, strict=True) if counts]
        declared: dict[Kind, Literal["line", "smooth", "monotone"]] = {
            "line": "line", "smooth": "smooth", "monotone": "monotone"
        }  # fmt: skip
        return cls(
            ramps=tuple(
                GuardedRamp(
                    source=source, dp_MPa=float(ramps.dp_MPa[at]) if with_dp else None, u_V=float(ramps.y[at]),
                    se_V=float(ramps.se[at]), budget_V=float(ramps.budgets[at]),
                    place=None if ramps.clock is None else float(ramps.clock[at]),
                )
                for at, source in enumerate(kept)
            ),
            set_aside=tuple(
                RampSetAside(
                    source=sources[each.ramp], u_V=float(y[each.ramp]), distance_V=each.distance,
                    deviations=each.ratio,
                )
                for each in scatter.set_aside
            ),
            shared_budget_V=ramps.shared,
            knots_MPa=tuple(map(float, scatter.model.knots_MPa)),
            sd_V=float(np.sqrt(scatter.variance)),
            origin=scatter.origin,
            known_sd_V=known_sd_V,
            least_sd_V=least_sd_V,
            unlike_knot=None if scatter.unlike is None else scatter.unlike.knot,
            floor=criticals.floor,
            roof=criticals.roof,
            floor_unlike=criticals.floor_unlike,
            roof_unlike=criticals.roof_unlike,
            declared=declared.get(curves.kind),
            curvature_V_MPa2=curvature if curves.kind == "smooth" else None,
            direction=-1 if curves.direction < 0 else 1 if curves.direction > 0 else 0,
            states=tuple(
                StateProof(
                    state=proof.state,
                    direction=-1 if proof.direction < 0 else 1 if proof.direction > 0 else 0,
                    multipliers=tuple(
                        " ".join(f"{row}:{value:.10g}" for row, value in zip(*each, strict=True))
                        for each in zip(proof.rows, proof.multipliers, strict=True)
                    ),
                )
                for proof in certificate.proofs
            ),
        )  # fmt: skip
