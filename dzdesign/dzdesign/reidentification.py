"""Comparison of a firmware's valve with a new identification of its ramp tests, which also reveals edited files.

Thresholds, bounds and hashes that were edited together fit one another; the recordings do not fit them. Stands here and
not in verify, which shares no code with what it checks: this one check asks `identify` itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_reading import differences
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, and_more, one_line, quoted
from dzdesign.core.options import Paths
from dzdesign.stages.identify import IdentifyArguments, identify_again, read_again, stated_options
from dzdesign.stages.recordings import expand

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.requirements import Check

#: valve.json has seven decimals: on another machine the last one may differ. Of a larger number the same share.
ROUNDING = 1e-6
#: Files, and options, that a sentence names.
MOST_NAMED = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenFiles:
    """The files that are said to be a valve's recordings, by the SHA-256 of their content."""

    paths: Mapping[str, Path]

    @classmethod
    def read(cls, patterns: Paths) -> "GivenFiles":
        """Hash the files that patterns name; refuse one that can't be read or is given twice."""
        paths: dict[str, Path] = {}
        for path in expand(patterns):
            digest = sha256_of(read_bytes(path, "ramp file"))
            if digest in paths:
                raise InputError(f"--ramps: '{path}' is the same recording as '{paths[digest]}'; give it once")
            paths[digest] = path
        return cls(paths=paths)


def identified_again(
    compensator: "Compensator", given: GivenFiles, identified: "ValveModel | None" = None
) -> "Check":
    """Tell whether identifying again, from the recordings that a compensator's valve names, gives the same valve.

    Which file is which its hash decides, whatever its name, its folder and the order. What this very run has
    `identified` from them is compared as it is.
    """
    from dzdesign.verify.requirements import AS_STATED

    valve = compensator.valve
    if valve.tool != THIS_TOOL:
        text = (
            f"identified by {quoted(f'{valve.tool.name} {valve.tool.version}')}, and this is {THIS_TOOL.name} "
            f"{THIS_TOOL.version}; make valve.json and all that follows from it again, or verify with that version"
        )
        return _check(holds=None, text=text)
    stated = {each.sha256: each.source for each in valve.made_from}
    if foreign := [path for digest, path in given.paths.items() if digest not in stated]:
        return _check(holds=False, text=_about_foreign(foreign[0], given, stated))
    if missing := [name for digest, name in stated.items() if digest not in given.paths]:
        text = f"valve.json was made from {len(stated)} files, and --ramps lacks {and_more(missing, MOST_NAMED)}"
        return _check(holds=None, text=f"{text}; give all of them")
    if valve.options is None:
        text = "valve.json does not say with which options it was identified; make it again with `dzdesign identify`"
        return _check(holds=None, text=text)
    if len({each.source for each in valve.made_from}) < len(valve.made_from):
        return _check(holds=False, text="valve.json names two of its files alike; make it again")
    files = {each.source: given.paths[each.sha256] for each in valve.made_from}
    try:
        found = identified or identify_again(valve.options, valve.record, files)
    except InputError as error:
        return _check(holds=False, text=f"from the same files nothing can be identified with its options: {error}")
    # A last decimal that is another on this machine gives another hash.
    differing = [each for each in differences(valve, found, rounding=ROUNDING) if each.place != "content_sha256"]
    text = f"from {len(files)} files, with {_options_in_words(valve)}"
    if differing:
        first = differing[0]
        more = f" (and {len(differing) - 1} more)" if len(differing) > 1 else ""
        one, other = _words(first.stated), _words(first.follows)
        text = f"'{first.place}' of valve.json is {one}, but {other} follows {text}{more}"
        return _check(holds=False, text=f"{text}; make it again with `dzdesign identify`")
    text = f"identified {'again' if identified is None else 'in this run'} {text}: every number is the same"
    if others := len(compensator.lot) - 1 if compensator.lot else 0:
        text += f"; of the lot's other {others} valves {AS_STATED}"
    return _check(holds=True, text=text)


def inputs_again(compensator: "Compensator", given: GivenFiles) -> "list[Check]":
    """Tell whether the pressure inputs of a compensator for both signs, wired as recorded, give the recorded drop."""
    from dzdesign.verify.exhaustive.recorded_inputs import recorded_inputs_follow
    from dzdesign.verify.requirements import PRESSURE_INPUTS

    valve = compensator.valve
    if compensator.negative is None:
        return []
    stated = {each.sha256: each.source for each in valve.made_from}
    if set(stated) != set(given.paths) or valve.options is None:
        return [PRESSURE_INPUTS.check(holds=None, text="--ramps are not the files that valve.json was made from")]
    files = {each.source: given.paths[each.sha256] for each in valve.made_from}
    try:
        tests = read_again(valve.options, files).tests
    except InputError as error:
        return [PRESSURE_INPUTS.check(holds=False, text=one_line(f"the recordings can't be read: {error}"))]
    return [recorded_inputs_follow(compensator, tests)]


def _check(*, holds: bool | None, text: str) -> "Check":
    from dzdesign.verify.requirements import RAMPS

    return RAMPS.check(holds=holds, text=one_line(text))  # names and options of a file that anyone may have written


def _about_foreign(path: Path, given: GivenFiles, stated: Mapping[str, str]) -> str:
    """Say of a file that valve.json was not made from it, or that it is another one of the same name."""
    digest = next(digest for digest, other in given.paths.items() if other == path)
    namesakes = [known for known, name in stated.items() if name.rpartition("/")[2] == path.name]
    if namesakes and not any(known in given.paths for known in namesakes):
        return f"'{path}' has the SHA-256 {digest}, but valve.json was made from a {path.name} of {namesakes[0]}"
    return (
        f"valve.json was not made from '{path}' (SHA-256 {digest}), but from {len(stated)} other files; leave it out, "
        "or identify again with it"
    )


def _options_in_words(valve: "ValveModel") -> str:
    """Name the options that are not the default: recordings read otherwise give another valve just as faithfully."""
    default = stated_options(IdentifyArguments([]))
    stated = valve.options or default
    other = [f"{name} = {text}" for name, text in stated.texts.items() if default.texts.get(name) != text]
    other += [f"{name} = {dict(table)}" for name, table in stated.tables.items()]
    other += [f"{name} = {', '.join(texts)}" for name, texts in stated.lists.items()]
    return f"its options ({'; '.join(other)})" if other else "the default options"


def _words(value: object) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"{len(value)} entries"
    return "nothing" if value is None else quoted(value)
