"""Head cards of an assessment: measured dead zones and flow at zero command, before what a simulation shows."""

from collections.abc import Sequence

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.options import Set
from dzdesign.report.characteristic.curves import origin_of
from dzdesign.report.language import word
from dzdesign.report.page import Figure
from dzdesign.report.sections.cells import counted


def measured_figures(assessment: Assessment | None) -> tuple[Figure, ...]:
    """Return the measured numbers that matter; none without recordings of the compensated valve."""
    after = [item for item in assessment.pressures if item.after] if assessment else []
    if not after or assessment is None:
        return ()
    of = "measured" if origin_of(assessment) == "recorded" else "simulated recordings"
    found = [_dead_zone(after, branch, of) for branch in ("opening", "closing")]
    return (*(each for each in found if each), *_at_zero(after, assessment, of))


def _dead_zone(items: Sequence[PressureAssessment], branch: str, of: str) -> Figure | None:
    """Return the dead zone before and after: at the onset where the meter shows it, else at the reading flow."""
    for key, where in ((f"onset_{branch}", "at the onset of flow"), (f"dead_zone_{branch}", "at the reading flow")):
        driven = _values(items, key, "after")
        if len(driven) == len(items):
            bare = _values(items, key, "before")
            both = f"{max(bare):.1f} % → {max(driven):.1f} %" if bare else f"{max(driven):.1f} %"
            return Figure(
                label=word(f"Dead zone on {branch}, {of}"),
                value=both,
                note=f"of command {where}, without → with; the worst of {_places(items)}"
                + (f". With: {min(driven):.1f} to {max(driven):.1f} %" if len(driven) > 1 else ""),
            )
    return None


def _at_zero(items: Sequence[PressureAssessment], assessment: Assessment, of: str) -> Sequence[Figure]:
    flows = _values(items, "flow_at_zero", "after")
    if not flows:
        return ()
    units, worst = assessment.recorded_units, max(flows, key=abs)
    limited = [limit for limit in assessment.limits if limit.quantity == "flow_at_zero"]
    return (
        Figure(
            label=word(f"Flow at zero command, {of}"),
            value=units.text(worst, ".2g L/min"),
            note=f"with the compensator, after closing; the largest of {_places(items)}",
            kind="bad" if any(limit.holds is False for limit in limited) else "text",
        ),
    )


def _places(items: Sequence[PressureAssessment]) -> str:
    return counted(len(items), "pressure drop") + (" and sides" if len({item.side for item in items}) > 1 else "")


def _values(items: Sequence[PressureAssessment], key: str, name: Set) -> list[float]:
    found = [item.readings(name).get(key) for item in items]
    return [each.value for each in found if each is not None and each.value is not None]
