"""The project file of Code Composer Studio: its user sets where C2000Ware lies, and all else is as generated."""

import os
import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath
from xml.etree import ElementTree

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import quoted
from dzdesign.verify.firmware.build_inputs import SOURCES

ENDING = ".projectspec"
#: The path variable that is the user's.
WARE_VARIABLE = "C2000WARE_ROOT"
#: It stands in options of compiler and linker: a quote, another variable or a blank before an option adds one.
NO_PATH = re.compile(r"[\x00-\x1f\"'`<>|*?$&;]|\s[-@]|^[-@]")
#: Characters of a path in a message.
SHOWN = 40
Element = ElementTree.Element


def is_project(name: str) -> bool:
    """Tell whether a file is compared in its structure."""
    return name.endswith(ENDING)


def project_faults(path: Path, generated: str, firmware: Path) -> Iterator[str]:
    """Yield what is otherwise in a project file than in the generated one, but for the folder of C2000Ware.

    Comments, line ends, blanks between elements and the order of attributes mean nothing to whoever reads it.
    """
    if not path.is_file():
        yield "it is missing"
        return
    builder = _PlainBuilder()
    try:
        found = ElementTree.fromstring(read_bytes(path, "project"), ElementTree.XMLParser(target=builder))
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        yield f"it is not XML ({error})"
        return
    if builder.more:
        yield f"it has {builder.more[0]}, which no project has"
        return
    yield from _differences(found, ElementTree.fromstring(generated))
    for entry in found.iter("pathVariable"):
        if entry.get("name") == WARE_VARIABLE:
            yield from _faults_of_folder(entry.get("path", ""), path.parent, firmware)


class _PlainBuilder(ElementTree.TreeBuilder):
    """Notes what tells whoever reads the file to read more or otherwise, in whichever encoding it stands there."""

    def __init__(self) -> None:
        super().__init__()
        self.more: list[str] = []

    def doctype(self, *_: object) -> None:
        """Note a document type: it may give attributes their values."""
        self.more.append("a document type")

    def pi(self, target: str, *_: object) -> None:  # type: ignore[override]
        """Note an instruction."""
        self.more.append(f"an instruction {quoted(target)}")


def _differences(found: Element, generated: Element) -> Iterator[str]:
    """Yield how an element differs from that of the generated file; of children the first pair that does."""
    if found.tag != generated.tag:
        yield f"{_words(found)} stands where {_words(generated)} was generated"
        return
    is_ware = found.tag == "pathVariable" and found.get("name") == generated.get("name") == WARE_VARIABLE
    for key in sorted({*found.keys(), *generated.keys()} - ({"path"} if is_ware else set())):
        if found.get(key) != generated.get(key):
            yield f"{key} of {_words(generated)} {_difference(found.get(key, ''), generated.get(key, ''))}"
    if _text(found.text) != _text(generated.text) or _text(found.tail) != _text(generated.tail):
        yield f"there is text in or behind {_words(generated)}"
    ours, theirs = list(generated), list(found)
    for one, other in zip(theirs, ours, strict=False):
        if faults := list(_differences(one, other)):
            yield from faults
            return
    for added in theirs[len(ours) :]:
        yield f"{_words(added)} was not generated"
    for gone in ours[len(theirs) :]:
        yield f"{_words(gone)} is missing"


def _faults_of_folder(value: str, place: Path, firmware: Path) -> Iterator[str]:
    """Yield why the user's value is no folder of C2000Ware: it adds an option, or leads into the firmware."""
    if not value.strip() or NO_PATH.search(value) or any(map(_is_file_of_its_own, value.split()[1:])):
        yield f"{WARE_VARIABLE} is {quoted(value)}, expected the name of a folder and nothing else"
        return
    if PureWindowsPath(value).drive and os.name != "nt":  # another machine's
        return
    led = os.path.realpath(place / value.replace("\\", "/"))
    home, led_to = os.path.realpath(firmware).casefold(), led.casefold()  # it is built on Windows
    if led_to == home or led_to.startswith(os.path.join(home, "")):
        yield f"{WARE_VARIABLE} is {quoted(value)}, a folder of this firmware; C2000Ware lies elsewhere"


def _is_file_of_its_own(word: str) -> bool:
    """Tell whether what follows a blank is a file that a compiler would take along: paths in options have no quotes."""
    return word.startswith((".", "/")) or PurePosixPath(word.replace("\\", "/")).suffix.lower() in SOURCES


def _difference(found: str, generated: str) -> str:
    """Say how the words of a value are others: options are many, and a message shows few."""
    words, expected = found.split(), generated.split()
    added = [word for word in words if word not in expected]
    gone = [word for word in expected if word not in words]
    said = [f"has {_end(' '.join(added))}, which was not generated"] if added else []
    said += [f"lacks {_end(' '.join(gone))}"] if gone else []
    return " and ".join(said) or "has its words otherwise than generated"


def _text(text: str | None) -> str:
    return (text or "").strip()


def _words(element: Element) -> str:
    """Return an element as a message names it."""
    name = element.get("path") if element.tag == "file" else element.get("name")
    return f"<{element.tag} {_end(name)}>" if name else f"<{element.tag}>"


def _end(text: str) -> str:
    """Return the end of a text for a message: what tells one path from another stands there."""
    return repr(text) if len(text) <= SHOWN else f"...{quoted(text[-SHOWN:])}"
