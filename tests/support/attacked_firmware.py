"""Edits of a firmware folder by hand, and `dzdesign verify` with all that takes long taken as held."""

import json
from dataclasses import replace
from functools import cache

from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.report import valve_report
from dzdesign.verify import verification
from dzdesign.verify.requirements import REPRODUCED, Tried, checks_of
from tests.support.evidence import ALWAYS


def edit(folder, name, old, new):
    """Replace one passage of a file, which must be there."""
    path = folder / name
    text = path.read_bytes().decode()
    assert old in text, f"{old!r} is not in {name}"
    path.write_bytes(text.replace(old, new, 1).encode())


def add(folder, name, text=""):
    """Put a file into a firmware."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8", newline="")


def change_json(path, change):
    """Change an artefact, written as dzdesign writes it."""
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_bytes(to_json(document).encode())


def sealed(valve):
    """Give an edited document of a valve the hash of its content, as `identify` would write it."""
    content = {key: value for key, value in valve.items() if key != "content_sha256"}
    valve["content_sha256"] = sha256_of(to_json(content).encode())
    return valve


def take_the_rest_as_held(monkeypatch):
    """Let `verify` design, generate and compare, and try nothing that compiles or runs C."""
    held = Tried(ALWAYS[1:], lambda _: [each.check(holds=True, text="taken as held") for each in ALWAYS[1:]], is_next)
    assert ALWAYS[0] is REPRODUCED
    monkeypatch.setattr(verification, "REQUIREMENTS", (verification.REQUIREMENTS[0], held))
    monkeypatch.setattr(verification, "host_compiler", lambda: "")
    monkeypatch.setattr(valve_report, "with_report", lambda found, *_: verification.evidence_files(found))


def is_next(firmware):
    return firmware.is_as_generated


#: What running a core leaves, for the evidence and for what is tried next.
LEFT = ("scenes", "inputs", "curves", "current", "loop")
#: Rows of requirements that run the core, up to the closed loop.
CORE = verification.REQUIREMENTS[2:8]


@cache
def _runs():
    return {}


def run_each_core_once(monkeypatch):
    """Let `verify` run a core once of those that are equal, with equal compensators, plants and ramps.

    For tests of what stands around that: the files of the target, recordings, report and command.
    """

    def once(firmware):
        core = tuple((path.name, path.read_bytes()) for path in sorted((firmware.code / "core").iterdir()))
        asked = replace(firmware.asked, ramps=None, blocks=None)
        key = (core, tuple(firmware.manifest.core), to_json_bytes(firmware.compensator), repr(asked))
        if key not in _runs():
            checks = checks_of(CORE, firmware)
            _runs()[key] = checks, {name: getattr(firmware, name) for name in LEFT}
        checks, left = _runs()[key]
        for name, value in left.items():
            setattr(firmware, name, value)
        return checks

    at = verification.REQUIREMENTS.index(CORE[0])
    others = [row for row in verification.REQUIREMENTS if row not in CORE]
    rows = (*others[:at], Tried(ALWAYS[1:], once, is_next), *others[at:])
    monkeypatch.setattr(verification, "REQUIREMENTS", rows)
