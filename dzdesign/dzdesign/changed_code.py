"""Code of a folder is compiled and run only if it equals, byte for byte, what `codegen` makes of its compensator.json.

The manifest has no say in that: whoever changes a file can change its hash. What is then compiled and run is not read
from the folder again but written from the generated text into a private one, so a file that is replaced meanwhile, a
header beside the sources, a makefile or a link has no part in it.

Code is what a compiler of this machine, Octave or a loader takes: of a firmware every C file in core/, and the
calibration block as C; of another output its C, its functions of MATLAB and its FMUs. A file that is the user's to fill
in is none, nor are the user's own in board/: those are compiled to objects for another processor, and nothing of them
is run.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.scratch import scratch_folder

if TYPE_CHECKING:
    from dzdesign.regeneration import OutputAgain

#: What else to do.
OWN_CODE = ", or write a target for code of your own"
#: Endings of code in an output other than a C firmware.
OF_OUTPUTS = (".c", ".h", ".m", ".mex", ".fmu")
#: Files that a sentence names.
MOST_NAMED = 3
AGAIN = "make the folder again with `dzdesign codegen`"


@contextmanager
def code_of_firmware(folder: Path) -> Iterator[Path]:
    """Give a private copy of the code of a firmware that may be compiled and run; changed: a `RequirementError`."""
    with _written(refuse_changed_firmware(folder)) as code:
        yield code


@contextmanager
def code_of_output(folder: Path, again: "OutputAgain | None") -> Iterator[Path]:
    """Do the same for an output other than a C firmware, of which `again` is what is generated now.

    It is None of an output of which nothing is run as it is: that is read from its own folder.
    """
    if again is None:
        yield folder
        return
    with _written(refuse_changed_output(folder, again)) as code:
        yield code


def refuse_changed_firmware(folder: Path) -> dict[str, bytes]:
    """Return the code of a firmware, path to content, with the data that it is run on; of changed code an error."""
    from dzdesign.codegen.project import TARGET_NAMES
    from dzdesign.design.firmware_manifest import BLOCK_FILE
    from dzdesign.regeneration import firmware_again, not_generated_here
    from dzdesign.verify.firmware.folder import read_compensator, read_firmware_manifest

    manifest = read_firmware_manifest(folder)
    read_compensator(folder)  # one that can't be read is no changed code
    reason = not_generated_here(manifest, TARGET_NAMES)
    if manifest.target not in TARGET_NAMES:
        raise _refusal(folder, reason)
    try:
        firmware = firmware_again(folder, manifest)
    except InputError as error:
        raise _refusal(folder, str(error)) from error
    code = {name: text.encode() for name, text in firmware.files.items() if _is_firmware_code(name)}
    there = (path.relative_to(folder).as_posix() for path in (folder / "core").rglob("*"))
    if others := _differing(folder, code, filter(_is_firmware_code, [*manifest.files, *manifest.core, *there])):
        raise _refusal(folder, reason or _words(others))
    if (block := folder / BLOCK_FILE).is_file():  # data, and tried as such
        code[BLOCK_FILE] = read_bytes(block, "calibration block")
    return {**code, "compensator.json": firmware.files["compensator.json"].encode()}


def refuse_changed_output(folder: Path, again: "OutputAgain") -> dict[str, bytes]:
    """Return the code of an output other than a C firmware, and its compensator.json; of changed code an error."""
    if again.output is None:
        raise _refusal(folder, again.reason)
    contents = again.output.contents
    code = {name: content for name, content in contents.items() if name.lower().endswith(OF_OUTPUTS)}
    there = (path.relative_to(folder).as_posix() for path in folder.rglob("*"))
    if others := _differing(folder, code, (name for name in there if name.lower().endswith(OF_OUTPUTS))):
        raise _refusal(folder, _words(others))
    return {**code, "compensator.json": contents["compensator.json"]}


def _is_firmware_code(name: str) -> bool:
    """Tell whether a compiler of this machine may take a file of a firmware."""
    from dzdesign.verify.firmware.own_block import OF_BLOCK

    path = PurePosixPath(name)
    in_core = path.parts[0] == "core" and path.suffix.lower() in (".c", ".h")
    return in_core or path.name in OF_BLOCK


def _differing(folder: Path, code: Mapping[str, bytes], there: Iterable[str]) -> list[str]:
    """Return which files are not the generated code, or missing, and which of those that are there are not of it."""
    changed = {name for name, content in code.items() if _bytes_of(folder / name) != content}
    return sorted(changed | ({*there} - code.keys()))


def _bytes_of(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _words(names: list[str]) -> str:
    this = f"{THIS_TOOL.name} {THIS_TOOL.version}"
    verb = "is" if len(names) == 1 else "are"
    return f"{and_more(names, MOST_NAMED)} {verb} not what {this} generates from its compensator.json"


def _refusal(folder: Path, reason: str) -> RequirementError:
    words = f"the code in '{folder}' was neither compiled nor run: {reason}"
    return RequirementError(f"{words}; {AGAIN}{OWN_CODE}")


@contextmanager
def _written(files: Mapping[str, bytes]) -> Iterator[Path]:
    with scratch_folder() as temporary:
        for name, content in files.items():
            path = temporary / "code" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        yield temporary / "code"
