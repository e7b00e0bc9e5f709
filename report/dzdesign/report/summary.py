"""What the report leads with: the verdict, and the few numbers that matter."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dzdesign.assess.assessment import Assessment, PressureAssessment
from dzdesign.assess.options import Set
from dzdesign.assess.quantities import LIMITED
from dzdesign.core.display import DOES_NOT_HOLD, NOT_CHECKED, verdict_words
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.certificate import reach_of_certificate
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import Chain, laws_of
from dzdesign.report.page import Figure, Headline, counted, whole
from dzdesign.report.sections.quantities import BRANCHES, ORIGIN_WORDS, CharacteristicQuantities, entry_of, origin_of
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.loop_checks import in_which_runs
from dzdesign.verify.evidence import Evidence, InputCheck
from dzdesign.verify.loop_results import PressureResult, ScenarioResult
from dzdesign.verify.requirements import Check
from dzdesign.verify.verification import not_tried


def headline(chain: Chain) -> Headline:
    """Return the verdict on a chain: good only if every requirement was checked and holds, and every file fits."""
    evidence, judged = chain.evidence, _verdict(chain)
    # Under a verdict that is bad nobody takes all for harmless, and what is missed needs the place.
    return replace(
        judged,
        unrequired=unrequired_flow(evidence, chain.recorded_units) if evidence and judged.kind != "bad" else "",
        cautions=tuple(_cautions(chain)),
        untried=not_tried(evidence) if evidence else (),
    )


def _cautions(chain: Chain) -> Iterator[str]:
    """Say what a verdict does not speak of: a machine's own valve, and a side without a law."""
    valve, compensator = chain.valve, chain.compensator
    for cost in dict.fromkeys(compensator.costs if compensator else ()):
        if cost.startswith("accepted, "):
            yield f"ACCEPTED warning, {cost.removeprefix('accepted, ')}."
    if compensator:
        yield reach_of_certificate(compensator)
    if valve and valve.simulated:
        yield "SIMULATED recordings: this is an example. No real valve was measured."
    if valve and compensator:
        for name in valve.sides.keys() - laws_of(compensator).keys():
            yield f"The {name} side was identified, and is NOT in this firmware: its command has one sign."


def _verdict(chain: Chain) -> Headline:
    """Return the verdict on requirements and limits, and what the certificate among them is of."""
    evidence, limits = chain.evidence, _limits(chain)
    checks = [*(evidence.all_checks if evidence else ()), *limits]
    missed, unknown = ([check for check in checks if check.holds is holds] for holds in (False, None))
    reasons = tuple(f"{verdict_words(check.holds)}: {check.name}: {check.text}" for check in (*missed, *unknown))
    kind = "bad" if missed else "open" if unknown or evidence is None else "good"
    if evidence is None:
        what = f"there is no evidence here, only {'a design' if chain.compensator else 'an identified valve'}"
        text = f"{len(reasons)} of {len(limits)} limits of the recordings are missed or not checked"
        text = f"NOT VERIFIED, and {text}" if reasons else f"NOT VERIFIED: {what}"
    elif missed:
        text = f"{DOES_NOT_HOLD}: {len(missed)} of {len(checks)} requirements not met"
    elif unknown:
        text = f"{NOT_CHECKED} in full: {len(unknown)} of {len(checks)} requirements are open"
    else:
        of = f"the certificate covers {chain.compensator.certified_of}" if chain.compensator else ""
        absent = "" if chain.firmware else "the firmware that was verified is not here"
        held = f"All {len(checks)} requirements that were checked hold"
        text = "; ".join(filter(None, [held, of, evidence.reservation, absent]))
    return Headline(kind=kind, text=text, reasons=reasons)


def _limits(chain: Chain) -> list[Check]:
    """Return the user's limits on recordings as requirements, if there are any."""
    names = {key: each.name for key, each in LIMITED.items()}
    return [
        Check(id="limit", name=f"limit of {names[each.quantity]}, {each.place}", holds=each.holds, text=each.text)
        for each in (chain.assessment.limits if chain.assessment else ())
    ]


def key_figures(chain: Chain, found: CharacteristicQuantities) -> tuple[Figure, ...]:
    """Return the numbers that matter; what they are read from decides which of them there are.

    `found` is what the table of the characteristic shows, so that a card says the same.
    """
    evidence, units = chain.evidence, chain.recorded_units
    inputs = evidence.inputs if evidence else ()
    loops = evidence.closed_loop.pressures if evidence else ()
    figures: list[Figure] = list(measured_figures(chain.assessment))
    if loops and figures:
        figures += [_simulated(loops, units)]
    elif loops:
        figures += [*(_dead_zone(loops, branch, units, found) for branch in BRANCHES), _at_zero(loops, units)]
    elif chain.valve and not figures:
        figures.append(_threshold(chain.valve))
    if chain.compensator:
        figures.append(_certificate(chain.compensator, inputs))
    if evidence:
        figures.append(_inputs(evidence))
    return tuple(figures)


def _simulated(loops: Sequence[PressureResult], units: RecordedUnits) -> Figure:
    """Return in one card what the simulated loop shows, where measured figures lead."""
    each = [_dead_zone(loops, branch, units) for branch in BRANCHES]
    return Figure(
        label="Simulated closed loop",
        value=" · ".join(figure.value for figure in each),
        note=f"dead zone on opening and on closing at the onset of flow, without → with, {worst_of(loops, units)}; "
        f"flow at zero command: {_at_zero(loops, units).value}",
    )


def _dead_zone(
    loops: Sequence[PressureResult], branch: str, units: RecordedUnits, found: CharacteristicQuantities | None = None
) -> Figure:
    """Return the dead zone in the loop; without the compensator that of the recordings, where they show it."""
    bare, sources = [100 * getattr(each, f"dead_zone_{branch}") for each in loops], "without → with"
    recorded = [each.before.get(f"onset_{branch}") for each in found.pressures] if found else []
    known = [each.value for each in recorded if each is not None and each.value is not None]
    if found and found.before and found.after and known and len(known) == len(recorded):
        bare = known
        sources = f"without ({ORIGIN_WORDS[found.before]}) → with ({ORIGIN_WORDS[found.after]})"
    driven = [100 * getattr(each, f"residual_{branch}") for each in loops]
    return Figure(
        label=f"Dead zone on {branch}",
        value=f"{max(bare):.1f} % → {max(driven):.1f} %",
        note=f"of command at the onset of flow, {sources}; {worst_of(loops, units)}"
        + with_span(driven)
        + _read(loops, branch, units),
    )


def _read(loops: Sequence[PressureResult], branch: str, units: RecordedUnits) -> str:
    """Say what is read at the reading flow, where it is most, and what an ideal line would read there."""
    worst = max(loops, key=lambda each: float(getattr(each, f"reading_{branch}")))
    flow, read = units.text(worst.reading_flow_L_min, ".2f L/min"), 100 * getattr(worst, f"reading_{branch}")
    return f". Read at {flow}: {read:.1f} % at most, where an ideal line reads {100 * worst.ideal_line:.1f} %"


def worst_of(items: Sequence[PressureResult | PressureAssessment], units: RecordedUnits, most: str = "worst") -> str:
    """Say of how many runs a figure is the worst: of two sides the pressure drops of each."""
    if len(items) == 1:
        only = items[0].dp_MPa
        at = "" if only is None else f"at {units.text(only, '.2f MPa')}, "
        return f"{at}the one pressure drop tested"
    counts = Counter(each.side for each in items)
    if len(counts) == 1:
        return f"the {most} of {len(items)} pressure drops"
    if len(set(counts.values())) == 1:
        return f"the {most} of {counted(len(items) // len(counts), 'pressure drop')} on each side"
    return f"the {most} of " + " and ".join(f"{counted(n, 'pressure drop')} {side}" for side, n in counts.items())


def _at_zero(loops: Sequence[PressureResult], units: RecordedUnits) -> Figure:
    worst = max(loops, key=lambda each: (each.q_zero_L_min, each.unseen_below_L_min or 0.0))
    allowed = worst.allowed_at_zero_L_min
    within = allowed is not None and all(each.q_beyond_L_min <= 0 for each in loops)
    of_it = "" if allowed is None else f"; {units.text(allowed, '.3g L/min')} are allowed there"
    bare = max(loops, key=lambda each: each.q_zero_without_beta_L_min)
    flow, unseen = worst.q_zero_L_min, worst.unseen_below_L_min
    hidden = "" if unseen is None else "; less than that the recordings don't show"
    value = worst.in_words(flow, units) if unseen is not None else units.number(flow, ".3g L/min")
    unit = units.label("L/min")
    without, with_it = bare.in_words(bare.q_zero_without_beta_L_min, units), worst.in_words(flow, units)
    gain = f"; without the correction for the pressure drop (β) it would be {without} {unit}"
    return Figure(
        label="Flow at zero command",
        value="none" if flow <= 1e-9 and unseen is None else f"{value} {unit}",
        note=f"in the simulated loop, after closing, {worst_of(loops, units)}{hidden}{of_it}"
        f"{gain if without != with_it else ''}",
        kind="text" if flow <= 1e-9 or within else "bad",
    )


def _threshold(valve: ValveModel) -> Figure:
    name, side = next(iter(valve.sides.items()))
    units = valve.recorded_units
    # A share of a signal that is not zero at zero command is no share of its reading.
    unnamed = units.command.at_zero or units.command.unit == "%"
    of = "of full command" if unnamed else f"of {units.text(valve.u_max_V, 'g V')}"
    opens = [100 * (test.u_knee_rising_V or test.u_guard_V) / valve.u_max_V for test in side.tests]
    span = f"; {min(opens):.1f} to {max(opens):.1f} % over {len(opens)} pressure drops"
    return Figure(
        label="Dead zone of the valve",
        value=f"{max(opens):.1f} %",
        note=f"{of}, on opening, {name} commands"
        + (span if len(opens) > 1 else ", at one pressure drop"),
    )


def _certificate(compensator: Compensator, inputs: Sequence[InputCheck]) -> Figure:
    name, law = min(laws_of(compensator).items(), key=lambda item: item[1].certificate.smallest_margin_V)
    worst, at_zero = law.certificate, compensator.valve.sides[name]
    units, (low, high) = compensator.valve.recorded_units, map(float, worst.dp_MPa)
    least = min((1e3 * each.smallest_margin_V for each in inputs), default=0.0)
    if exceeded := sum(each.over_compensated for each in inputs):
        return Figure(
            label="Certificate",
            value="EXCEEDED",
            note=f"at {whole(exceeded)} pressure codes the C code drives the valve at zero command above the "
            f"{worst.guard} threshold's {100 * worst.confidence:g} % bound, by up to {units.text(-least, '.2f mV')}",
            kind="bad",
        )
    return Figure(
        label=f"Certificate of {compensator.certified_of}",
        value=f"{100 * worst.confidence:g} %",
        note=f"confidence that the output at zero command stays below the {worst.guard} threshold "
        f"{units.span(low, high, '.2f MPa')}; smallest margin "
        + (
            f"{units.text(least, '.3f mV')} of the C code's output{_reserve(compensator)}"
            if inputs
            else f"{units.text(1e3 * float(worst.smallest_margin_V), '.3f mV')}, of the exact law under the certified "
            "offset, beside half a count for the rounding; the statistical reserve is in that offset"
        )
        + (
            f". F{at_zero.none_in_words(worst.guard, units)[1:].partition(' (the largest of')[0]}"
            if worst.zero_flow_L_min is None
            else f"; {at_zero.zero_flow_in_words(units)}"
        )
        + f"; {at_zero.between_in_words(worst.guard).removeprefix('between the tests: ')}"
        + _premise(compensator),
    )


def _reserve(compensator: Compensator) -> str:
    """Say of a margin under a bound where the statistical reserve is; a machine's or a lot's is in the margin, too."""
    of_rounding = compensator.machine is None and not compensator.lot
    of_it = ": rounding alone" if of_rounding else " under the lower bound"
    return f"{of_it}; the statistical reserve is in the bound"


def _premise(compensator: Compensator) -> str:
    """Return what is assumed of the repeatability, where too few repeated ramps show it; the warning's own code."""
    sides = [compensator.valve.sides[name] for name in laws_of(compensator)]
    assumed = [side.certificate.repeatability for side in sides]
    largest = max((1e3 * each.sd_V for each in assumed if each.origin == "assumed"), default=None)
    if largest is None:
        return ""
    shown = compensator.valve.recorded_units.text(largest, ".3g mV")
    return (
        f". It holds only if the valve repeats to {shown} (standard deviation from ramp to ramp), which is "
        "assumed: too few repeated ramps show it (assumed-scatter)"
    )


def _inputs(evidence: Evidence) -> Figure:
    if not evidence.inputs:
        return Figure(label="Inputs checked", value=NOT_CHECKED, note="the C code did not get so far", kind="open")
    wrong, every = sum(each.wrong for each in evidence.inputs), sum(each.inputs for each in evidence.inputs)
    pairs = "pairs of command code and pressure-difference code"
    if wrong:
        return Figure(
            label="Inputs checked", value=f"{whole(wrong)} wrong", note=f"of {whole(every)} {pairs}", kind="bad"
        )
    note = f"{pairs}; on each, the C code gives what the law does"
    return Figure(label="Inputs checked", value=whole(every), note=note)


def measured_figures(assessment: Assessment | None) -> tuple[Figure, ...]:
    """Return the measured numbers that matter; none without recordings of the compensated valve."""
    after = [item for item in assessment.pressures if item.after] if assessment else []
    if not after or assessment is None:
        return ()
    of = "measured" if origin_of(assessment) == "recorded" else "simulated recordings"
    found = [_measured_dead_zone(after, branch, of, assessment.recorded_units) for branch in BRANCHES]
    return (*(each for each in found if each), *_measured_at_zero(after, assessment, of))


def with_span(driven: Sequence[float]) -> str:
    """Return from where to where the values with the compensator run, where the ends read differently; %."""
    ends = dict.fromkeys(f"{end:.1f}" for end in (min(driven), max(driven)))
    return f". With: {' to '.join(ends)} %" if len(ends) > 1 else ""


def _measured_dead_zone(
    items: Sequence[PressureAssessment], branch: str, of: str, units: RecordedUnits
) -> Figure | None:
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
                note=f"of command {where}, {sets}; {worst_of(items, units)}{with_span(driven)}",
            )
    return None


def _measured_at_zero(items: Sequence[PressureAssessment], assessment: Assessment, of: str) -> Sequence[Figure]:
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
                  else "with the compensator, after closing") + f"; {worst_of(items, units, 'largest')}",
            kind="bad" if any(limit.holds is False for limit in limited) else "text",
        ),
    )


def _values(items: Sequence[PressureAssessment], key: str, name: Set) -> list[float]:
    found = [item.readings(name).get(key) for item in items]
    return [each.value for each in found if each is not None and each.value is not None]


#: What a scenario measures whose flow is that of a command that was never taken away.
OF_A_COMMAND = "flow_after_zero_command_L_min"
#: What a machine is declared by; the caution beside it says that none was.
DECLARE = "Declare the machine to `design`: `--coil-temperature` with `--supply`, `--amplifier` or `--drive current`."


def unrequired_flow(evidence: Evidence, units: RecordedUnits) -> str:
    """Say how much passes at zero command at most, in the scenarios in which no flow is not required; empty if none.

    A flow that the recordings do not show is none here: the card of the flow at zero command has its bound.
    """
    passing = [each for each in evidence.scenarios if not each.must_shut and _is_seen(each)]
    if not passing:
        return ""
    most = max(passing, key=lambda one: one.q_zero_L_min)
    flow = units.text(most.q_zero_L_min, ".3g L/min")
    remedy = DECLARE if most.not_required == NOT_DECLARED else f"Reason: {most.not_required}."
    return (
        f"Not required, and not harmless: up to {flow} at zero command "
        f"({most.name}{in_which_runs(most, passing, units)}). {remedy}"
    )


def _is_seen(scenario: ScenarioResult) -> bool:
    """Return whether flow passes at zero command, beyond what may and what the recordings hide."""
    shown = scenario.q_zero_L_min >= (scenario.unseen_below_L_min or 0.0)
    return shown and scenario.q_beyond_L_min > NO_FLOW_L_MIN and OF_A_COMMAND not in scenario.figures


#: How a record may name them, in the words of those who keep one; case, dashes and blanks do not count.
SERIAL = (
    "serial", "serial number", "serial no", "serial no.", "s/n", "sn", "seriennummer", "serien nr", "serien nr.",
    "fabrik nr", "fabrik nr.",
)  # fmt: skip
TYPE = (
    "type", "valve type", "valve", "model", "part number", "part no", "part no.", "typ", "ventiltyp", "ventil",
    "type code", "typschluessel", "typschlüssel",
)  # fmt: skip


def valve_name(record: Mapping[str, str]) -> str:
    """Return the valve's type and serial number, as far as the record has them; empty if it has neither.

    Examples
    --------
    >>> valve_name({"Serial-No": "4711", "type": "4WRA 10"}), valve_name({"oil": "HLP 46"})
    ('4WRA 10, serial number 4711', '')
    >>> valve_name({"S/N": "4711"}), valve_name({"valve": "bench example"})
    ('Valve, serial number 4711', 'Valve: bench example')
    """
    serial, kind = (entry_of(record, names) for names in (SERIAL, TYPE))
    if serial:
        return f"{kind or 'Valve'}, serial number {serial}"
    return f"Valve: {kind}" if kind else ""

