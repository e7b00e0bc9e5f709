"""What is made again to be compared: a firmware or output from its compensator.json, a valve from its recordings.

This is here and not in verify, which shares no code with what it checks: it is handed the results as values.
Thresholds, bounds and hashes that were edited together fit one another; the recordings do not fit them.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import differences
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, MissingToolError, RequirementError, and_more, one_line, quoted
from dzdesign.core.options import Paths
from dzdesign.stages.identify import IdentifyArguments, identify_again, read_again, stated_options
from dzdesign.stages.recordings import expand

if TYPE_CHECKING:
    from dzdesign.codegen.other_targets import Output
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.folder import Regenerated
    from dzdesign.verify.requirements import Check

    Manifest = FirmwareManifest | OutputManifest


def regenerated(folder: Path) -> "Regenerated":
    """Design a folder's compensator.json again, and generate what the manifest names; a bad file is an `InputError`.

    Nothing can be said where another version of dzdesign made the folder, or one with other targets, or where a
    compiler is missing.
    """
    from dzdesign.verify.folder import (
        Regenerated,
        holds_output,
        read_compensator,
        read_firmware_manifest,
        read_output_manifest,
    )

    manifest: Manifest = read_output_manifest(folder) if holds_output(folder) else read_firmware_manifest(folder)
    compensator = read_compensator(folder)
    if unknown := _unknown_origin(manifest):
        return Regenerated(unknown=unknown)
    try:
        unknown = _not_derived(compensator)
        made = _made(folder, manifest, compensator)
    except MissingToolError as error:
        return Regenerated(unknown=str(error))
    except InputError as error:
        return Regenerated(fault=str(error))
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in made.contents.items()}
    return Regenerated(
        files={**contents, MANIFEST_NAME: to_json_bytes(made.manifest)},
        board=frozenset(getattr(made.manifest, "board", ())),
        unknown=unknown,
    )


@contextmanager
def generated_code(folder: Path) -> Iterator[Path]:
    """Give a folder with the generated text of a firmware; of one that differs from it a `RequirementError`."""
    from dzdesign.verify.folder import reproduced

    again = regenerated(folder)
    check = reproduced(folder, again)
    if check.holds is False or not again.files:
        raise RequirementError(f"nothing of '{folder}' was compiled or run: {check.text}")
    with again.written() as code:
        yield code


def _not_derived(compensator: "Compensator") -> str:
    """Design a compensator again; return why it is not known whether its numbers follow, nothing where they do.

    A number that does not follow is an `InputError`; another version of dzdesign may have chosen it just as well.
    """
    from dzdesign.design.redesign import prove_derived, refuse_without_options

    try:
        prove_derived(compensator)
    except InputError as error:
        if compensator.tool == THIS_TOOL:
            raise
        version = quoted(compensator.tool.version)
        return f"designed by dzdesign {version}, and this is {THIS_TOOL.version}: {error}"
    try:
        refuse_without_options(compensator, compensator.FILE_NAME)
    except InputError as error:
        return str(error)
    return ""


def _made(folder: Path, manifest: "Manifest", compensator: "Compensator") -> "Firmware | Output":
    from importlib import import_module

    from dzdesign.codegen.other_targets import OTHER_TARGETS, generate_output, settings_of
    from dzdesign.codegen.project import generate
    from dzdesign.design.firmware_manifest import FirmwareManifest

    if isinstance(manifest, FirmwareManifest):
        return generate(compensator, manifest.target, manifest.calibration, manifest.vectors)
    settings = settings_of(manifest.target, manifest.settings)
    module = import_module(OTHER_TARGETS[manifest.target].module)
    if compiled := getattr(module, "made_by_another_compiler", None):
        there = {name: (folder / name).read_bytes() for name in manifest.files if (folder / name).is_file()}
        if reason := compiled(there):
            raise MissingToolError(f"{reason}; verify it with the one that made it")
    return generate_output(compensator, manifest.target, settings)


def _unknown_origin(manifest: "Manifest") -> str:
    """Return why this version can't generate a folder again, and what to do; nothing where it can."""
    from dzdesign.codegen.other_targets import OTHER_TARGETS
    from dzdesign.codegen.project import TARGET_NAMES

    known: Collection[str] = TARGET_NAMES if hasattr(manifest, "board") else OTHER_TARGETS.keys()
    tool = f"{manifest.tool.name} {manifest.tool.version}"
    this = f"{THIS_TOOL.name} {THIS_TOOL.version}"
    if manifest.tool != THIS_TOOL:
        found = f"generated by {quoted(tool)}, and this is {this}"
    elif manifest.target not in known:
        found = f"generated for {quoted(manifest.target)}, which is no target of {this}"
    else:
        return ""
    return f"{found}; make it again with `dzdesign codegen`, or verify it with the version that made it"


#: valve.json has seven decimals: on another machine the last one may differ. Of a larger number the same share.
ROUNDING = 1e-6
#: Files, and options, that a sentence names.
MOST_NAMED = 6


def given_files(patterns: Paths) -> dict[str, Path]:
    """Return the files that patterns name, by the SHA-256 of their content; refuse one that is given twice."""
    paths: dict[str, Path] = {}
    for path in expand(patterns):
        digest = sha256_of(read_bytes(path, "ramp file"))
        if digest in paths:
            raise InputError(f"--ramps: '{path}' is the same recording as '{paths[digest]}'; give it once")
        paths[digest] = path
    return paths


def identified_again(
    compensator: "Compensator", given: Mapping[str, Path], identified: "ValveModel | None" = None
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
    if foreign := [path for digest, path in given.items() if digest not in stated]:
        return _check(holds=False, text=_about_foreign(foreign[0], given, stated))
    if missing := [name for digest, name in stated.items() if digest not in given]:
        text = f"valve.json was made from {len(stated)} files, and --ramps lacks {and_more(missing, MOST_NAMED)}"
        return _check(holds=None, text=f"{text}; give all of them")
    if valve.options is None:
        text = "valve.json does not say with which options it was identified; make it again with `dzdesign identify`"
        return _check(holds=None, text=text)
    if len({each.source for each in valve.made_from}) < len(valve.made_from):
        return _check(holds=False, text="valve.json names two of its files alike; make it again")
    files = {each.source: given[each.sha256] for each in valve.made_from}
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


def inputs_again(compensator: "Compensator", given: Mapping[str, Path]) -> "list[Check]":
    """Tell whether the pressure inputs of a compensator for both signs, wired as recorded, give the recorded drop."""
    from dzdesign.verify.exhaustive.recorded_inputs import recorded_inputs_follow
    from dzdesign.verify.requirements import PRESSURE_INPUTS

    valve = compensator.valve
    if not compensator.two_sided:
        return []
    stated = {each.sha256: each.source for each in valve.made_from}
    if set(stated) != set(given) or valve.options is None:
        return [PRESSURE_INPUTS.check(holds=None, text="--ramps are not the files that valve.json was made from")]
    files = {each.source: given[each.sha256] for each in valve.made_from}
    try:
        tests = read_again(valve.options, files).tests
    except InputError as error:
        return [PRESSURE_INPUTS.check(holds=False, text=one_line(f"the recordings can't be read: {error}"))]
    return [recorded_inputs_follow(compensator, tests)]


def _check(*, holds: bool | None, text: str) -> "Check":
    from dzdesign.verify.requirements import RAMPS

    return RAMPS.check(holds=holds, text=one_line(text))  # names and options of a file that anyone may have written


def _about_foreign(path: Path, given: Mapping[str, Path], stated: Mapping[str, str]) -> str:
    """Say of a file that valve.json was not made from it, or that it is another one of the same name."""
    digest = next(digest for digest, other in given.items() if other == path)
    namesakes = [known for known, name in stated.items() if name.rpartition("/")[2] == path.name]
    if namesakes and not any(known in given for known in namesakes):
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
