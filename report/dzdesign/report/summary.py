"""What the report leads with: the verdict, and the few numbers that matter."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from dzdesign.core.units import span_MPa
from dzdesign.core.verdicts import DOES_NOT_HOLD, NOT_CHECKED
from dzdesign.report.artefact_chain import Chain
from dzdesign.report.sections.cells import counted, whole
from dzdesign.verify.requirements import not_tried

#: What the check of the inputs counts, each of which a requirement has to say.
COUNTS = (
    *("wrong", "out_of_range", "not_monotone_in_u", "not_monotone_in_dp", "over_compensated", "odd_pairs"),
    *("bad_fallbacks", "bad_status", "bad_betas"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """The verdict.

    Attributes
    ----------
    kind : {"good", "bad", "open"}
        All holds; something does not; something could not be checked, or nothing was.
    sign, text : str
        As on the page.
    reasons : tuple of str
        What does not hold or was not checked.
    untried : tuple of str
        What nobody asked for, and the command that tries it: no requirement, but a reader should see it.
    cautions : tuple of str
        What the verdict is not about, whatever it is, and what somebody accepted.
    """

    kind: str
    sign: str
    text: str
    reasons: tuple[str, ...] = ()
    untried: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One number that matters: its label, the number itself and what it is of."""

    label: str
    value: str
    note: str
    kind: str = "text"


def headline(chain: Chain) -> Headline:
    """Return the verdict on a chain: good only if every requirement was checked and holds, and every file fits.

    Parameters
    ----------
    chain : Chain
    """
    evidence = chain.document("verification")
    untried = not_tried(chain.evidence()) if evidence and not chain.faults else ()
    return replace(_verdict(chain), cautions=tuple(_cautions(chain)), untried=untried)


def _cautions(chain: Chain) -> Iterator[str]:
    """Say what a verdict does not speak of: a machine's own valve, and a side without a law."""
    valve, compensator = chain.document("valve"), chain.document("compensator")
    for cost in dict.fromkeys(compensator["costs"] if compensator else ()):
        if cost.startswith("accepted, "):
            yield f"ACCEPTED warning, {cost.removeprefix('accepted, ')}."
    if valve and any(warning["code"] == "simulated" for warning in valve["warnings"]):
        yield "SIMULATED recordings: this is an example, not of a measured valve."
    if valve and compensator:
        for name in valve["sides"]:
            if not compensator["sides"].get(name):
                yield f"The {name} side was identified, and is NOT in this firmware: its command has one sign."


def _verdict(chain: Chain) -> Headline:
    evidence = chain.document("verification")
    if chain.faults:
        return Headline(
            kind="bad", sign="✗", text="THE FILES DO NOT BELONG TOGETHER. No verdict stands.", reasons=chain.faults
        )
    counted = sum(each.get(key, 0) for each in evidence["inputs"] for key in COUNTS) if evidence else 0
    if counted and all(check["holds"] is not False for check in evidence["checks"]):
        return Headline(
            kind="bad",
            sign="✗",
            text=f"THE EVIDENCE CONTRADICTS ITSELF: {whole(counted)} faults counted, and every check holds",
        )
    if evidence is None:
        return Headline(
            kind="open",
            sign="?",
            text="NOT VERIFIED: there is no evidence here, only a design"
            if "compensator" in chain.artefacts
            else "NOT VERIFIED: there is no evidence here, only an identified valve",
        )
    checks = [*evidence["checks"], *_limits(chain)]
    missed = [check for check in checks if check["holds"] is False]
    unknown = [check for check in checks if check["holds"] is None]
    reasons = tuple(
        f"{word}: {check['name']}: {check['text']}"
        for word, group in ((DOES_NOT_HOLD, missed), (NOT_CHECKED, unknown))
        for check in group
    )
    if missed:
        text = f"{DOES_NOT_HOLD}: {len(missed)} of {len(checks)} requirements not met"
        return Headline(kind="bad", sign="✗", text=text, reasons=reasons)
    if unknown or not checks or not evidence["holds"]:
        text = f"{NOT_CHECKED} in full: {len(unknown)} of {len(checks)} requirements are open"
        return Headline(kind="open", sign="?", text=text, reasons=reasons)
    text = f"Every requirement holds, all {len(checks)} that were tried"
    return Headline(kind="good", sign="✓", text=text)


def _limits(chain: Chain) -> list[dict[str, Any]]:
    """Return the user's limits on recordings as requirements, if there are any."""
    assessment = chain.document("assessment")
    if assessment is None:
        return []
    return [
        {"name": f"limit of {each['quantity']}, {each['place']}", "holds": each["holds"], "text": each["text"]}
        for each in assessment["limits"]
    ]


def key_figures(chain: Chain) -> tuple[Figure, ...]:
    """Return the numbers that matter; what they are read from decides which of them there are.

    Parameters
    ----------
    chain : Chain
    """
    evidence, compensator = chain.document("verification"), chain.document("compensator")
    figures: list[Figure] = []
    loops = evidence["closed_loop"]["pressures"] if evidence else []
    if loops:
        for word in ("opening", "closing"):
            figures.append(_dead_zone(loops, word))
        figures.append(_at_zero(loops))
    valve = chain.document("valve")
    if not loops and valve:
        figures.append(_threshold(valve))
    if compensator:
        figures.append(_certificate(compensator, evidence["inputs"] if evidence else []))
    if evidence:
        figures.append(_inputs(evidence["inputs"]))
    return tuple(figures)


def _dead_zone(loops: list[dict[str, Any]], word: str) -> Figure:
    before = [100 * each[f"dead_zone_{word}"] for each in loops]
    after = [100 * each[f"residual_{word}"] for each in loops]
    return Figure(
        label=f"Dead zone on {word}",
        value=f"{max(before):.1f} % → {max(after):.1f} %",
        note=f"of command, without → with; {worst_of(loops)}"
        + (f". With: {min(after):.1f} to {max(after):.1f} %" if len(loops) > 1 else ""),
    )


def worst_of(loops: list[dict[str, Any]]) -> str:
    """Say of how many runs a figure is the worst: of two sides the pressure drops of each.

    Parameters
    ----------
    loops : list of dict
        Of verification.json.
    """
    sides = dict.fromkeys(each["side"] for each in loops)
    counts = {name: sum(each["side"] == name for each in loops) for name in sides}
    if len(set(counts.values())) > 1:
        return "the worst of " + " and ".join(f"{counted(n, 'pressure drop')} {name}" for name, n in counts.items())
    count = next(iter(counts.values()))
    if count == 1:
        where = f"at {loops[0]['dp_MPa']:.2f} MPa, the one pressure drop tested" if len(sides) == 1 else ""
        return where or "the worse of both sides, each at one pressure drop"
    return f"the worst of {count} pressure drops" + (f" on each of {len(sides)} sides" if len(sides) > 1 else "")


def _at_zero(loops: list[dict[str, Any]]) -> Figure:
    worst = max(loops, key=lambda each: each["q_zero_L_min"])
    flow = worst["q_zero_L_min"]
    bare = max(each["q_zero_without_beta_L_min"] for each in loops)
    return Figure(
        label="Flow at zero command",
        value="none" if flow <= 1e-9 else f"{flow:.3g} L/min",
        note=f"in the simulated loop, after closing, {worst_of(loops)}; without β it would be {bare:.2f} L/min",
        kind="text" if flow <= 1e-9 else "bad",
    )


def _threshold(valve: dict[str, Any]) -> Figure:
    name, side = next(iter(valve["sides"].items()))
    opens = [test["u_knee_rising_V"] or test["u_guard_V"] for test in side["tests"]]
    share = 100 / valve["u_max_V"]
    return Figure(
        label="Dead zone of the valve",
        value=f"{share * max(opens):.1f} %",
        note=f"of {valve['u_max_V']:g} V, on opening, {name} commands"
        + (
            f"; {share * min(opens):.1f} to {share * max(opens):.1f} % over {len(opens)} pressure drops"
            if len(opens) > 1
            else ", at one pressure drop"
        ),
    )


def _certificate(compensator: dict[str, Any], inputs: list[dict[str, Any]]) -> Figure:
    sides = [side for side in compensator["sides"].values() if side]
    worst = min(sides, key=lambda side: Fraction(*side["certificate"]["smallest_margin_V"]))["certificate"]
    low, high = (float(Fraction(*end)) for end in worst["dp_MPa"])
    margin = 1e3 * float(Fraction(*worst["smallest_margin_V"]))
    exceeded = sum(each["over_compensated"] for each in inputs)
    least = min((1e3 * each["smallest_margin_V"] for each in inputs), default=margin)
    if exceeded:
        return Figure(
            label="Certificate",
            value="EXCEEDED",
            note=f"at {whole(exceeded)} pressure codes the C drives the valve at zero command above the "
            f"{worst['guard']} threshold's {100 * worst['confidence']:g} % bound, by up to {-least:.2f} mV",
            kind="bad",
        )
    return Figure(
        label="Certificate",
        value=f"{100 * worst['confidence']:g} %",
        note=f"confidence that the drive at zero command stays below the {worst['guard']} threshold "
        f"{span_MPa(low, high)}; smallest margin {margin:.3f} mV of the exact law under the certified offset, half a "
        "count kept for the rounding"
        + (f"; {least:.3f} mV of the C's compare values under the threshold's bound" if inputs else "")
        + f". Flow below {worst['level_L_min']:.2f} L/min counts as none",
    )


def _inputs(inputs: list[dict[str, Any]]) -> Figure:
    if not inputs:
        return Figure(label="Inputs checked", value=NOT_CHECKED, note="the C did not get so far", kind="open")
    wrong, every = (sum(each[key] for each in inputs) for key in ("wrong", "inputs"))
    if wrong:
        note = f"of {whole(every)} pairs of command and pressure-difference code"
        return Figure(label="Inputs checked", value=f"{whole(wrong)} wrong", note=note, kind="bad")
    return Figure(
        label="Inputs checked",
        value=whole(every),
        note="pairs of command and pressure-difference code, none wrong",
    )
