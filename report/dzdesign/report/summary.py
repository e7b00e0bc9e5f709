"""What the report leads with: the verdict, and the few numbers that matter."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from dzdesign.assess.options import SETS, Set
from dzdesign.assess.quantities import LIMITED
from dzdesign.core.display import DOES_NOT_HOLD, NOT_CHECKED, verdict_words
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.certificate import reach_of_certificate
from dzdesign.design.compensator import Compensator
from dzdesign.design.redesign import without_sensors
from dzdesign.report.artefacts import Chain, laws_of
from dzdesign.report.page import Figure, Headline, counted, whole
from dzdesign.report.sections.characteristic import WITH_WORDS
from dzdesign.report.sections.closed_loop import passes_flow
from dzdesign.report.sections.quantities import (
    ORIGIN_WORDS,
    CharacteristicQuantities,
    Found,
    PressureQuantities,
    entry_of,
)
from dzdesign.report.sections.valve import RECORDED
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.closed_loop.loop_checks import in_which_runs
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.requirements import Check
from dzdesign.verify.verification import not_tried

#: Characters of a finding on the first page.
LONGEST_REASON = 160


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
        yield from _assumed_scatter(compensator)
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
    reasons = tuple(f"{verdict_words(each.holds)}: {each.name}: {_in_short(each.text)}" for each in (*missed, *unknown))
    kind = "bad" if missed else "open" if unknown or evidence is None else "good"
    basis = ""
    if evidence is None:
        what = f"there is no evidence here, only {'a design' if chain.compensator else 'an identified valve'}"
        text = f"{len(reasons)} of {len(limits)} limits of the recordings are missed or not checked"
        text = f"NOT VERIFIED, and {text}" if reasons else f"NOT VERIFIED: {what}"
    elif missed:
        text = f"{DOES_NOT_HOLD}: {len(missed)} of {len(checks)} requirements not met"
    elif unknown:
        text = f"{NOT_CHECKED} in full: {len(unknown)} of {len(checks)} requirements are open"
    else:
        absent = "" if chain.firmware else "the firmware that was verified is not here"
        held = f"All {len(checks)} requirements that were checked hold"
        text = certified_in_words(chain.compensator) if chain.compensator else held
        parts = (held if text != held else "", *_tried(evidence), *dict.fromkeys(_no_flow(chain.compensator)))
        basis = "; ".join(filter(None, (*parts, evidence.reservation, absent)))
    return Headline(kind=kind, text=text, basis=basis, reasons=reasons)


def _in_short(text: str) -> str:
    """Return a finding, or its first part where it is too long for the first page; a table has all of it."""
    if len(text) <= LONGEST_REASON:
        return text
    first = text[:LONGEST_REASON]
    return f"{first.rpartition(' ')[0] or first} …"


def certified_in_words(compensator: Compensator) -> str:
    """Return the certificate as a verdict: which flow passes at zero command, over which pressure drops, how surely."""
    units = compensator.valve.recorded_units
    sides: dict[str, list[str]] = {}
    for name, law in laws_of(compensator).items():
        allowed = compensator.valve.sides[name].zero_flow_L_min if law.certificate.zero_flow_L_min is not None else None
        flow = "No flow" if allowed is None else f"At most {units.text(allowed, '.3g L/min')}"
        low, high = map(float, law.certificate.dp_MPa)
        text = f"{flow} at zero command {units.span(low, high, '.3g MPa')}, {100 * law.certificate.confidence:g} %"
        sides.setdefault(text, []).append(f"{name} commands")
    if len(sides) == 1:
        return next(iter(sides))
    return "; ".join(f"{' and '.join(names)}: {text[:1].lower()}{text[1:]}" for text, names in sides.items())


def _no_flow(compensator: Compensator | None) -> Iterator[str]:
    """Say which flow counts as none."""
    for name, law in laws_of(compensator).items():
        if compensator and law.certificate.zero_flow_L_min is None:
            units = compensator.valve.recorded_units
            yield compensator.valve.sides[name].none_in_words(law.certificate.guard, units).partition(" (")[0]


def _assumed_scatter(compensator: Compensator) -> Iterator[str]:
    """Say what is assumed of the repeatability, where too few repeated ramps show it; the warning's own code."""
    sides = [compensator.valve.sides[name] for name in laws_of(compensator)]
    assumed = [1e3 * each.sd_V for side in sides if (each := side.certificate.repeatability).origin == "assumed"]
    if assumed:
        shown = compensator.valve.recorded_units.text(max(assumed), ".3g mV")
        yield (
            f"The certificate holds only if the valve repeats to {shown} (standard deviation from ramp to ramp), which "
            "is assumed: too few repeated ramps show it (assumed-scatter)."
        )


def _tried(evidence: Evidence) -> Iterator[str]:
    """Say of how many inputs the C code gives what the law does."""
    if evidence.inputs:
        every = sum(each.inputs for each in evidence.inputs)
        yield f"the C code gives what the law does on each of {whole(every)} pairs of command and pressure code"


def _limits(chain: Chain) -> list[Check]:
    """Return the user's limits on recordings as requirements, if there are any."""
    names = {key: each.name for key, each in LIMITED.items()}
    return [
        Check(id="limit", name=f"limit of {names[each.quantity]}, {each.place}", holds=each.holds, text=each.text)
        for each in (chain.assessment.limits if chain.assessment else ())
    ]


def key_figures(chain: Chain, found: CharacteristicQuantities) -> tuple[Figure, ...]:
    """Return the numbers that matter: of what the table of the characteristic shows, the worst of each.

    None without any curve of the valve.
    """
    made = (_dead_zone(chain, found), _largest_flow(chain, found), _hysteresis(found), _at_zero(chain, found))
    return tuple(each for each in made if each)


def sets_in_words(found: CharacteristicQuantities, units: RecordedUnits) -> str:
    """Say of what the numbers that matter are: where those without and with the compensator are from, and the worst."""
    words = {name: ORIGIN_WORDS[origin] for name in SETS if (origin := getattr(found, name))}
    if not found.pressures or not words:
        return ""
    if len(words) == len(SETS):
        return f"Without → with the compensator ({' → '.join(words.values())}); {worst_of(found.pressures, units)}."
    (name, origin), *_ = words.items()
    return f"{WITH_WORDS[name].capitalize()} ({origin}); {worst_of(found.pressures, units)}."


def _values(found: CharacteristicQuantities, key: str, name: str) -> list[float] | None:
    """Return the values of a set at every pressure drop; None where one is not known."""
    read = [getattr(each, name).get(key, Found(None)).value for each in found.pressures]
    known = [value for value in read if value is not None]
    return known if known and len(known) == len(read) else None


def _worst(found: CharacteristicQuantities, key: str, form: Callable[[float], str]) -> str:
    """Return the largest value without and with the compensator, as far as they are known at every pressure drop."""
    sets = [values for name in SETS if (values := _values(found, key, name))]
    return " → ".join(form(max(values)) for values in sets)


def _percent(value: float) -> str:
    return f"{value:.1f} %"


def _dead_zone(chain: Chain, found: CharacteristicQuantities) -> Figure | None:
    """Return the dead zone on opening: at the onset of flow where that is seen, else at the reading flow."""
    for key, where in (("onset_opening", "at the onset of flow"), ("dead_zone_opening", "at the reading flow")):
        if found.after and _values(found, key, "after") is None:
            continue
        if value := _worst(found, key, _percent):
            fixed = without_sensors(chain.compensator) if chain.compensator else None
            left = None if fixed is None else fixed.onset if key == "onset_opening" else fixed.reading
            beside = "" if left is None else f"fixed MIN offset: {100 * left:.1f} %"
            return Figure(label="Dead zone on opening", value=value, beside=beside, note=f"of command {where}")
    return None


def _largest_flow(chain: Chain, found: CharacteristicQuantities) -> Figure | None:
    units = chain.recorded_units
    value = _worst(found, "largest_flow", lambda flow: units.number(flow, ".1f L/min"))
    bare, driven = (_values(found, "largest_flow", name) for name in SETS)
    note = "at full command"
    if bare and driven and min(bare) > 0:
        kept = min(new / old for old, new in zip(bare, driven, strict=True))
        note += f"; at least {100 * kept:.1f}\u00a0% remains at each pressure drop"
    return Figure(label="Largest flow", value=f"{value} {units.label('L/min')}", note=note) if value else None


def _hysteresis(found: CharacteristicQuantities) -> Figure | None:
    value = _worst(found, "hysteresis", _percent)
    note = "of command, the widest"
    return Figure(label="Hysteresis", value=value, note=note) if value else None


def _at_zero(chain: Chain, found: CharacteristicQuantities) -> Figure | None:
    """Return the largest flow at zero command, or its bound where the meter shows none."""
    name: Set = "after" if found.after else "before"
    seen = [value for each in found.pressures if (value := getattr(each, name).get("flow_at_zero"))]
    flow = max((each.value for each in seen if each.value is not None), key=abs, default=None)
    bound = max((each.at_most for each in seen if each.value is None and each.at_most is not None), default=None)
    if flow is None and bound is None:
        return None
    units, loops = chain.recorded_units, chain.evidence.closed_loop.pressures if chain.evidence else ()
    hidden = bound is not None and bound > abs(flow or 0.0)
    text = f"≤ {units.text(bound or 0.0, '.2f L/min')}" if hidden else units.text(flow or 0.0, ".2g L/min")
    simulated = name == "after" and found.after == "simulated"
    allowed = max((each.allowed_at_zero_L_min or 0.0 for each in loops), default=0.0) if simulated else 0.0
    beyond = simulated and any(passes_flow(each) for each in loops)
    limited = [each.limits["flow_at_zero"].holds for each in found.pressures if "flow_at_zero" in each.limits]
    return Figure(
        label="Flow at zero command",
        value="none" if flow is not None and abs(flow) <= NO_FLOW_L_MIN and not hidden else text,
        note=f"after closing, {WITH_WORDS[name]}"
        + ("; less than that the recordings do not show" if hidden else "")
        + (f"; {units.text(allowed, '.3g L/min')} are allowed" if allowed else ""),
        kind="bad" if beyond or False in limited else "text",
    )


def worst_of(items: Sequence[PressureQuantities], units: RecordedUnits) -> str:
    """Say of how many runs a figure is the worst: of two sides the pressure drops of each."""
    if len(items) == 1:
        only = items[0].dp_MPa
        at = "" if only is None else f"at {units.text(only, '.2f MPa')}, "
        return f"{at}the one pressure drop tested"
    counts = Counter(each.side for each in items)
    if len(counts) == 1:
        return f"the worst of {len(items)} pressure drops"
    if len(set(counts.values())) == 1:
        return f"the worst of {counted(len(items) // len(counts), 'pressure drop')} on each side"
    return "the worst of " + " and ".join(f"{counted(n, 'pressure drop')} {side}" for side, n in counts.items())


#: What a machine is declared by; the caution beside it says that none was.
DECLARE = "Declare the machine to `design`: `--coil-temperature` with `--supply`, `--amplifier` or `--drive current`."


def unrequired_flow(evidence: Evidence, units: RecordedUnits) -> str:
    """Say how much passes at zero command at most, in the scenarios in which no flow is not required; empty if none.

    A flow that the recordings do not show is none here: the card of the flow at zero command has its bound.
    """
    passing = [each for each in evidence.scenarios if not each.must_shut and passes_flow(each)]
    if not passing:
        return ""
    most = max(passing, key=lambda one: one.q_zero_L_min)
    flow = units.text(most.q_zero_L_min, ".3g L/min")
    remedy = DECLARE if most.not_required == NOT_DECLARED else f"Reason: {most.not_required}."
    return (
        f"Not required, and not harmless: up to {flow} at zero command "
        f"({most.name}{in_which_runs(most, passing, units)}). {remedy}"
    )


#: How a record may name them, in the words of those who keep one; case, dashes and blanks do not count.
SERIAL = (
    "serial", "serial number", "serial no", "serial no.", "s/n", "sn", "seriennummer", "serien nr", "serien nr.",
    "fabrik nr", "fabrik nr.",
)  # fmt: skip
TYPE = (
    "type", "valve type", "valve", "model", "part number", "part no", "part no.", "typ", "ventiltyp", "ventil",
    "type code", "typschluessel", "typschlüssel",
)  # fmt: skip


def further_record(record: Mapping[str, str]) -> Mapping[str, str]:
    """Return the entries of a record that neither the page's title nor the test conditions show."""
    shown = (SERIAL, TYPE, *RECORDED.values())
    return {name: text for name, text in record.items() if not any(entry_of({name: text}, names) for names in shown)}


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

