"""Whether the compensator of a firmware follows: its certificate and its law from its valve, its valve from a file."""

import contextlib
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.errors import InputError
from dzdesign.design.certificate import prove_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.redesign_check import prove_derived
from dzdesign.identify.valve.model import SCHEMA, ValveModel
from dzdesign.verify.requirements import CERTIFICATE, LAW, VALVE, Check

#: The schema stands in the first bytes of an artefact; a valve.json is far smaller than the limit.
HEAD, LARGEST_FILE = 512, 32 * 2**20
#: So many folders beside the firmware, and files in each, are looked at.
MOST = 500


def certificate_follows(compensator: Compensator) -> Check:
    """Tell whether what the header promises follows from the valve that the compensator was made from."""
    try:
        prove_certificates(compensator)
    except InputError as error:
        return CERTIFICATE.check(holds=False, text=str(error))
    certificate = compensator.positive.certificate
    valves = len(compensator.lot)
    common = f"of {valves} valves the one in compensator.json: " if valves else ""
    text = f"{common}the proof was repeated: the offset lies below the {100 * certificate.confidence:.6g}% "
    low, high = map(float, certificate.dp_MPa)
    tested = compensator.valve.recorded_units.span(low, high, ".2f MPa")
    text += f"lower bound of the {certificate.guard} threshold {tested}, at every pressure-difference code"
    return CERTIFICATE.check(holds=True, text=text)


def law_follows(compensator: Compensator) -> Check:
    """Tell whether designing again gives the same numbers, which a file without its options does not let anyone do.

    Another version of dzdesign may have chosen other tables, and none the worse.
    """
    if compensator.target is None:
        text = "compensator.json does not say for which target and with which options it was designed, so no number of "
        return LAW.check(holds=None, text=f"{text}it can be derived again; make it again with `dzdesign design`")
    try:
        prove_derived(compensator)
    except InputError as error:
        version = compensator.tool.version
        known = version == THIS_TOOL.version
        text = str(error) if known else f"designed by dzdesign {version}, and this is {THIS_TOOL.version}: {error}"
        return LAW.check(holds=False if known else None, text=text)
    target = compensator.target.name
    text = f"designed again from the valve and the options in compensator.json, for {target}: every number is the same"
    return LAW.check(holds=True, text=text)


def valve_follows(folder: Path, compensator: Compensator) -> Check:
    """Tell whether the valve in a compensator is that of the file it names; not checked where that is not at hand.

    It is looked for in the firmware's folder, beside it and in the folders beside it. The name alone says nothing: a
    valve.json of another hash and another content is a stranger's.
    """
    (source,), valve = compensator.made_from, compensator.valve
    stated = source.sha256
    around = tuple(_valves_around(folder))
    named = (each for each in around if each.name == source.source and each.sha256 != stated)
    other = "".join(
        f"{each.name} beside the firmware is ANOTHER valve, SHA-256 {each.sha256}, and not used; "
        for each in named
        if each.valve != valve
    )
    if stated == compensator.valve_sha256:  # as `identify` writes it: no file is needed
        text = f"the valve data in compensator.json, written as valve.json, have the SHA-256 in made_from: {stated}"
        return VALVE.check(holds=True, text=other + text)
    for each in around:
        if each.sha256 == stated:
            same = each.valve == valve
            text = f"compared with {each.name}, which has the SHA-256 {stated} in made_from"
            text += "" if same else ", but is another valve; make the compensator again with `dzdesign design`"
            return VALVE.check(holds=same, text=other + text)
        if each.valve == valve:
            text = f"{each.name} is that valve, but its SHA-256 is {each.sha256} and compensator.json names {stated}; "
            return VALVE.check(holds=False, text=f"{text}make the compensator again with `dzdesign design`")
    text = f"compensator.json names a valve.json of SHA-256 {stated}, the valve in it has {compensator.valve_sha256} "
    text += "as `identify` writes it; put the valve.json that it names beside the firmware"
    return VALVE.check(holds=None, text=other + text)


class _ValveFile:
    """A valve.json near the firmware, whatever its name is; read only where its hash does not decide."""

    def __init__(self, name: str, content: bytes) -> None:
        self.name, self.sha256, self._content = name, sha256_of(content), content

    @cached_property
    def valve(self) -> ValveModel | None:
        """The valve, or None if it can't be read."""
        with contextlib.suppress(InputError):
            return read_artefact(self._content, ValveModel, self.name)
        return None


def _valves_around(folder: Path) -> Iterator[_ValveFile]:
    """Yield each valve.json of the firmware's folder, the one around it and those in that; none that can't be read."""
    folder = folder.resolve()
    root = folder.parent
    with contextlib.suppress(OSError):
        within = sorted(place for place in root.iterdir() if place.is_dir() and not place.name.startswith("."))
        for place in dict.fromkeys((root, *within[:MOST], folder)):
            with contextlib.suppress(OSError):
                for path in sorted(place.glob("*.json"))[:MOST]:
                    content = path.read_bytes() if path.is_file() and path.stat().st_size <= LARGEST_FILE else b""
                    if f'"{SCHEMA}"'.encode() in content[:HEAD]:
                        yield _ValveFile(path.relative_to(root).as_posix(), content)
