"""Head cards of an assessment: measured dead zones and flow at zero command, before what a simulation shows."""

from collections import Counter
from collections.abc import Sequence

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.options import Set
from dzdesign.report.characteristic.curves import BRANCHES, origin_of
from dzdesign.report.page import Figure
from dzdesign.report.sections.cells import counted


def measured_figures(assessment: Assessment | None) -> tuple[Figure, ...]:
    """Return the measured numbers that matter; none without recordings of the compensated valve."""
    after = [item for item in assessment.pressures if item.after] if assessment else []
    if not after or assessment is None:
        return ()
    of = "measured" if origin_of(assessment) == "recorded" else "simulated recordings"
    found = [_dead_zone(after, branch, of) for branch in BRANCHES]
    return (*(each for each in found if each), *_at_zero(after, assessment, of))


def with_span(driven: Sequence[float]) -> str:
    """Return from where to where the values with the compensator run, where the ends read differently; %."""
    ends = dict.fromkeys(f"{end:.1f}" for end in (min(driven), max(driven)))
    return f". With: {' to '.join(ends)} %" if len(ends) > 1 else ""


def _dead_zone(items: Sequence[PressureAssessment], branch: str, of: str) -> Figure | None:
    """Return the dead zone before and after: at the onset where the meter shows it, else at the reading flow."""
    for key, where in ((f"onset_{branch}", "at the onset of flow"), (f"dead_zone_{branch}", "at the reading flow")):
        driven = _values(items, key, "after")
        if len(driven) == len(items):
            bare = _values(items, key, "before")
            both = f"{max(bare):.1f} % → {max(driven):.1f} %" if bare else f"{max(driven):.1f} %"
            sets = "without → with" if bare else "with the compensator"
            return Figure(
                label=f"Dead zone on {branch}, {of}",
                value=both,
                note=f"of command {where}, {sets}; the worst of {_places(items)}{with_span(driven)}",
            )
    return None


def _at_zero(items: Sequence[PressureAssessment], assessment: Assessment, of: str) -> Sequence[Figure]:
    """Return the largest flow at zero command, or its bound where the meter shows none."""
    found = [reading for item in items if (reading := item.readings("after").get("flow_at_zero"))]
    flows = [each.value for each in found if each.value is not None]
    bounds = [each.at_most for each in found if each.value is None and each.at_most is not None]
    if not flows and not bounds:
        return ()
    units, worst, unseen = assessment.recorded_units, max(flows, key=abs, default=0.0), max(bounds, default=0.0)
    hidden = unseen > abs(worst)
    limited = [limit for limit in assessment.limits if limit.quantity == "flow_at_zero"]
    return (
        Figure(
            label=f"Flow at zero command, {of}",
            value=f"≤ {units.text(unseen, '.2f L/min')}" if hidden else units.text(worst, ".2g L/min"),
            note=("with the compensator, after closing: the meter shows none, and nothing below that" if hidden
                  else "with the compensator, after closing") + f"; the largest of {_places(items)}",
            kind="bad" if any(limit.holds is False for limit in limited) else "text",
        ),
    )


def _places(items: Sequence[PressureAssessment]) -> str:
    counts = Counter(item.side for item in items)
    if len(counts) > 1 and len(set(counts.values())) == 1:
        return f"{counted(len(items) // len(counts), 'pressure drop')} on each side"
    return counted(len(items), "pressure drop") + (" and sides" if len(counts) > 1 else "")


def _values(items: Sequence[PressureAssessment], key: str, name: Set) -> list[float]:
    found = [item.readings(name).get(key) for item in items]
    return [each.value for each in found if each is not None and each.value is not None]
