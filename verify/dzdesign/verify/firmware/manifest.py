"""The firmware's manifest against the firmware: the constants of the C, the law, the target, and where all is from."""

import re
from collections.abc import Iterator
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_types import SourceFile
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.requirements import MANIFEST, Check

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
#: A number as the core writes it: 64u, UINT32_C(64), (-INT32_C(64)).
NUMBER = r"(?P<sign>\(-)?(?:U?INT(?:32|64)_C\()?(?P<digits>\d+)u?\)*"
DEFINE = re.compile(rf"^#define[ \t]+(?P<name>\w+)[ \t]+(?:{NUMBER}|(?P<other>\S.*?))[ \t]*$", re.MULTILINE)
TABLE = re.compile(r"\bconst\b[^;={]*?(?P<name>\w+)\[\d*\][^;={]*=\s*\{(?P<rows>[^;]*)\}\s*;")
ROW = re.compile(r"\{([^{}]*)\}")
BANNER = re.compile(r"Compensator SHA-256: (\w+)")
#: In the target's folder: the calibration block as C.
BLOCK_SOURCE = "dz_block.c"
Value = int | tuple[tuple[int, ...], ...] | str


def manifest_follows(folder: Path, manifest: FirmwareManifest, compensator: Compensator) -> Check:
    """Tell whether the manifest says what is in the folder; its words on a constant are not read."""
    faults = [*_faults_of_origin(folder, manifest, compensator), *_faults_of_constants(folder, manifest)]
    if faults:
        more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
        return MANIFEST.check(holds=False, text=f"{faults[0]}{more}; make the firmware again with `dzdesign codegen`")
    text = f"law, target, hashes and {len(manifest.constants)} constants in {len(manifest.core)} files agree with it"
    if compensator.target and compensator.target.name != manifest.target:  # both may count alike
        text += f"; the compensator was designed for {compensator.target.name}, this is for {manifest.target}"
    return MANIFEST.check(holds=True, text=text)


def _faults_of_origin(folder: Path, manifest: FirmwareManifest, compensator: Compensator) -> Iterator[str]:
    """Yield what the manifest says of the compensator and the valve, and is otherwise."""
    digest = sha256_of((folder / "compensator.json").read_bytes())
    if manifest.law != compensator.law:
        yield f"the manifest's law is {manifest.law}, the compensator's {compensator.law}"
    targets = {name.partition("/")[0].replace("_", "-") for name in manifest.files if "/" in name} - {"core"}
    if targets != {manifest.target}:
        there = " and ".join(sorted(targets)) or "no target"
        yield f"the manifest's target is {manifest.target}, but the files are those of {there}"
    for key, stated, value in (
        ("made_from", manifest.made_from, (SourceFile(source="compensator.json", sha256=digest),)),
        ("origin.compensator_json", manifest.origin.compensator_json, digest),
        ("origin.valve_json", manifest.origin.valve_json, compensator.valve_json_sha256),
        ("origin.ramp_tests", manifest.origin.ramp_tests, compensator.valve.made_from),
    ):
        if stated != value:
            yield f"the manifest's {key} is not that of compensator.json"
    # The core in block form is the same for every valve: the file with its block names the compensator.
    block = [name for name in manifest.files if name.endswith(f"/{BLOCK_SOURCE}")]
    for name in block if manifest.calibration == "block" else manifest.core:
        written = BANNER.search(_text(folder / name))
        if written is None or written[1] != digest:
            yield f"{name} does not name this compensator.json in its first lines"


def _faults_of_constants(folder: Path, manifest: FirmwareManifest) -> Iterator[str]:
    """Yield the constants that stand otherwise in the C, or in one of both only."""
    stated = {(entry.file, entry.symbol): entry.value for entry in manifest.constants}
    found = {(name, symbol): value for name in manifest.core for symbol, value in constants_in(_text(folder / name))}
    for (name, symbol), value in found.items():
        if (name, symbol) not in stated:
            yield f"{symbol} of {name} is not in the manifest"
        elif stated[name, symbol] != value:
            yield f"{symbol} of {name} is {_words(value)}, the manifest says {_words(stated[name, symbol])}"
    for name, symbol in stated.keys() - found.keys():
        yield f"the manifest's {symbol} is not in {name}"


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def constants_in(text: str) -> Iterator[tuple[str, Value]]:
    """Yield name and value of the constants in C: of a table its rows, of what is not a number its text.

    A number of a table without rows is a row that does not change.

    Examples
    --------
    >>> list(constants_in("#define SHIFT 6u" + chr(10) + "static const struct s t[2] = {{UINT32_C(5), 0u}, {1, 2},};"))
    [('SHIFT', 6), ('t', ((5, 0), (1, 2)))]
    """
    code = COMMENT.sub(" ", text)
    for one in DEFINE.finditer(code):
        sign = -1 if one["sign"] else 1
        yield one["name"], sign * int(one["digits"]) if one["digits"] else one["other"]
    for one in TABLE.finditer(code):
        rows = tuple(_row(row[1]) for row in ROW.finditer(one["rows"]))
        yield one["name"], rows or tuple((number, 0) for number in _row(one["rows"]))  # or plain numbers


def _row(text: str) -> tuple[int, ...]:
    return tuple(
        (-1 if one["sign"] or text[: one.start()].rstrip().endswith("-") else 1) * int(one["digits"])
        for one in re.finditer(NUMBER, text)
    )


def _words(value: Value) -> str:
    return f"a table of {len(value)} rows" if isinstance(value, tuple) else str(value)[:40]
