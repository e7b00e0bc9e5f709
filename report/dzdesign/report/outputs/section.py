"""The section "Outputs of this compensator", and what the verdict of the report says of them."""

from collections.abc import Sequence
from dataclasses import replace

from dzdesign.core.verdicts import verdict_words
from dzdesign.report.chain import Chain
from dzdesign.report.outputs.made_output import MadeOutput, MadeOutputs
from dzdesign.report.page import Headline, Section
from dzdesign.report.sections.cells import Cell, counted, table_of, verdict, whole


def outputs_sections(chain: Chain, made: MadeOutputs) -> dict[str, Section]:
    """Return the section by its anchor; none where the firmware that the report is of is all there is."""
    return {"outputs": _outputs_section(made)} if _beside_firmware(made, chain) or made.others else {}


def _beside_firmware(made: MadeOutputs, chain: Chain) -> list[MadeOutput]:
    """Return the outputs other than the firmware that the report is of, on which its verdict speaks already."""
    firmware = chain.places.get("firmware")
    return [each for each in made.listed if firmware is None or each.sha256 != firmware.sha256]


def _outputs_section(made: MadeOutputs) -> Section:
    """Return a row for each output; its check is of the bytes whose hash stands beside it."""
    table = None
    if made.listed:
        table = table_of(
            "Every output made of this compensator.json, with the SHA-256 of its manifest, or of a file alone",
            made.listed,
            ("output", lambda each: Cell(text=each.kind, more=each.settings)),
            ("folder or file", lambda each: each.place),
            ("SHA-256", lambda each: Cell(text=each.sha256, kind="hash")),
            ("check", _check),
        )
    return Section(tables=(table,), groups=(("Not listed here", made.others),))


def _check(output: MadeOutput) -> Cell:
    if output.changed:
        return Cell(text="✗ CHANGED", kind="bad", more=output.changed)
    if output.holds is None and not output.evidence:
        return Cell(text="? NOT VERIFIED", kind="open")
    tried = f"{counted(output.inputs, 'input').replace(str(output.inputs), whole(output.inputs), 1)} tried"
    more = "; ".join(filter(None, [output.fault, tried, output.evidence]))
    return replace(verdict(output.holds), more=more)


def with_outputs(headline: Headline, made: MadeOutputs, chain: Chain) -> Headline:
    """Return the verdict of a report, which speaks of a C firmware, with what is to be said of the outputs.

    It is not good if one of them is wrong, or was not verified; each is named. Where there is no C firmware and no
    evidence of one, the verdict is of the outputs.
    """
    wrong = [each for each in _beside_firmware(made, chain) if each.is_wrong]
    if not wrong:
        only_these = made.listed and not (chain.faults or chain.firmware or chain.evidence)
        return _of_outputs_alone(headline, made) if only_these else _with_untried(headline, made, chain)
    reasons = tuple(f"{each.verdict}: {each.place} ({each.kind}): {each.changed or each.fault}" for each in wrong)
    text, names = headline.text, ", ".join(each.place for each in wrong)
    if headline.kind != "bad":
        text = f"{counted(len(wrong), 'output')} NOT to be used: {names}. {text}"
    return replace(headline, kind="bad", text=text, reasons=(*headline.reasons, *reasons))


def _with_untried(headline: Headline, made: MadeOutputs, chain: Chain) -> Headline:
    """Return a good verdict as open where an output that `verify` takes was not verified; it takes no file alone."""
    untried = [each for each in _beside_firmware(made, chain) if each.holds is None and each.place.endswith("/")]
    if headline.kind != "good" or not untried:
        return headline
    return replace(headline, kind="open", text=f"{_named(untried)}. {headline.text}", reasons=_open_reasons(untried))


def _named(untried: Sequence[MadeOutput]) -> str:
    """Return the outputs by their verdict, those without evidence first."""
    by_verdict = {verdict: [each.place for each in untried if each.verdict == verdict]
                  for verdict in ("NOT VERIFIED", verdict_words(None))}  # fmt: skip
    return "; ".join(f"{verdict}: {', '.join(places)}" for verdict, places in by_verdict.items() if places)


def _open_reasons(untried: Sequence[MadeOutput]) -> tuple[str, ...]:
    return tuple(f"{each.verdict}: {each.place} ({each.kind}): {each.fault}" for each in untried if each.fault)


def _of_outputs_alone(headline: Headline, made: MadeOutputs) -> Headline:
    held = ", ".join(each.place for each in made.listed if each.holds)
    untried = [each for each in made.listed if each.holds is None]
    if untried:
        text = _named(untried) + (f"; every requirement holds of {held}" if held else "")
        return replace(headline, kind="open", text=text, reasons=_open_reasons(untried))
    return replace(headline, kind="good", text=f"Every requirement holds of {held}; no C firmware is here")
