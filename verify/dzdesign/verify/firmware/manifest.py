"""The firmware's manifest against the firmware: the constants of the C, the law, the target, and where all is from."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.shape import check_shape
from dzdesign.verify.evidence import Check
from dzdesign.verify.requirements import MANIFEST

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
#: A number as the core writes it: 64u, UINT32_C(64), (-INT32_C(64)).
NUMBER = r"(?P<sign>\(-)?(?:U?INT(?:32|64)_C\()?(?P<digits>\d+)u?\)*"
DEFINE = re.compile(rf"^#define[ \t]+(?P<name>\w+)[ \t]+(?:{NUMBER}|(?P<other>\S.*?))[ \t]*$", re.MULTILINE)
TABLE = re.compile(r"\bconst\b[^;={]*?(?P<name>\w+)\[\d*\][^;={]*=\s*\{(?P<rows>[^;]*)\}\s*;")
ROW = re.compile(r"\{([^{}]*)\}")
BANNER = re.compile(r"Compensator SHA-256: (\w+)")
Value = int | list[list[int]] | str


def manifest_follows(folder: Path, manifest: dict[str, Any]) -> Check:
    """Tell whether the manifest says what is in the folder; its words on a constant are not read.

    Parameters
    ----------
    folder : Path
        Of the firmware.
    manifest : dict
        Of `read_firmware_manifest`.

    Raises
    ------
    InputError
        If its constants have no shape.
    """
    says = "constants" in manifest  # one of an older version does not
    if says:
        shape = {"constants": [{"file": str, "symbol": str}]}
        check_shape(manifest, shape, str(folder / MANIFEST_NAME), "make it again with `dzdesign codegen`")
    faults = [*_faults_of_origin(folder, manifest), *(_faults_of_constants(folder, manifest) if says else ())]
    if says:
        text = f"law, target, hashes and {len(manifest['constants'])} constants in {len(manifest['core'])} files"
        text += f" as it says{_other_target(folder, manifest)}"
    else:
        text = "law, target and hashes as it says, but it lists no constants, as those of older versions; make the "
        text += "firmware again with `dzdesign codegen`"
    if faults:
        more = f", and {len(faults) - 1} more" if len(faults) > 1 else ""
        text = f"{faults[0]}{more}; make the firmware again with `dzdesign codegen`"
    holds = False if faults else True if says else None
    return MANIFEST.check(holds=holds, text=text)


def _faults_of_origin(folder: Path, manifest: dict[str, Any]) -> Iterator[str]:
    """Yield what the manifest says of the compensator and the valve, and is otherwise."""
    content = (folder / "compensator.json").read_bytes()
    document, digest = json.loads(content), sha256_of(content)
    if manifest.get("law") != document["law"]:
        yield f"the manifest's law is {manifest.get('law')}, the compensator's {document['law']}"
    targets = {name.partition("/")[0].replace("_", "-") for name in manifest["files"] if "/" in name} - {"core"}
    if targets != {manifest.get("target")}:
        there = " and ".join(sorted(targets)) or "no target"
        yield f"the manifest's target is {manifest.get('target')}, but the files are those of {there}"
    recordings = [{key: str(each[key]) for key in ("source", "sha256")} for each in document["valve"]["made_from"]]
    stated = {
        "made_from": [{"source": "compensator.json", "sha256": digest}],
        "origin.compensator_json": digest,
        "origin.valve_json": document["made_from"][0]["sha256"],
        "origin.ramp_tests": recordings,
    }
    origin = manifest.get("origin")
    for key, value in stated.items():
        outer, _, inner = key.partition(".")
        said = manifest.get(outer) if not inner else origin.get(inner) if isinstance(origin, dict) else None
        if said != value:
            yield f"the manifest's {key} is not that of compensator.json"
    for name in manifest["core"]:
        written = BANNER.search(_text(folder / name))
        if written is None or written[1] != digest:
            yield f"{name} does not name this compensator.json in its first lines"


def _other_target(folder: Path, manifest: dict[str, Any]) -> str:
    """Return that the compensator names another target, which `codegen --target` allows where both count alike."""
    designed_for = (json.loads((folder / "compensator.json").read_bytes()).get("target") or {}).get("name")
    if designed_for in (None, manifest.get("target")):
        return ""
    return f"; the compensator was designed for {designed_for}, this is for {manifest.get('target')}"


def _faults_of_constants(folder: Path, manifest: dict[str, Any]) -> Iterator[str]:
    """Yield the constants that stand otherwise in the C, or in one of both only."""
    said = {(entry["file"], entry["symbol"]): entry.get("value") for entry in manifest["constants"]}
    found = {(name, symbol): value for name in manifest["core"] for symbol, value in constants_in(_text(folder / name))}
    for (name, symbol), value in found.items():
        if (name, symbol) not in said:
            yield f"{symbol} of {name} is not in the manifest"
        elif said[name, symbol] != value or isinstance(said[name, symbol], bool):
            yield f"{symbol} of {name} is {_words(value)}, the manifest says {_words(said[name, symbol])}"
    for name, symbol in said.keys() - found.keys():
        yield f"the manifest's {symbol} is not in {name}"


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def constants_in(text: str) -> Iterator[tuple[str, Value]]:
    """Yield name and value of the constants in C: of a table its rows, of what is no number its text.

    Parameters
    ----------
    text : str
        Of a file of the core.

    Examples
    --------
    >>> list(constants_in("#define SHIFT 6u" + chr(10) + "static const struct s t[2] = {{UINT32_C(5), 0u}, {1, 2},};"))
    [('SHIFT', 6), ('t', [[5, 0], [1, 2]])]
    """
    code = COMMENT.sub(" ", text)
    for one in DEFINE.finditer(code):
        sign = -1 if one["sign"] else 1
        yield one["name"], sign * int(one["digits"]) if one["digits"] else one["other"]
    for one in TABLE.finditer(code):
        yield one["name"], [_row(row[1]) for row in ROW.finditer(one["rows"])]


def _row(text: str) -> list[int]:
    return [
        (-1 if one["sign"] or text[: one.start()].rstrip().endswith("-") else 1) * int(one["digits"])
        for one in re.finditer(NUMBER, text)
    ]


def _words(value: Any) -> str:
    return f"a table of {len(value)} rows" if isinstance(value, list) else str(value)[:40]
