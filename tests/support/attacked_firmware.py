"""Edits of a firmware folder by hand, and `dzdesign verify` with all that takes long taken as held."""

import json
from functools import cache

from dzdesign.core.artefact_files import sha256_of, to_json
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.report import valve_report
from dzdesign.verify import verification
from dzdesign.verify.firmware.compilation import BoardCompiled
from dzdesign.verify.requirements import ALWAYS, REPRODUCED


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
    held = tuple(each.check(holds=True, text="taken as held") for each in ALWAYS if each is not REPRODUCED)
    run = verification._Run(core=verification._Core(checks=held))
    monkeypatch.setattr(verification, "_run_core", lambda *_: run)
    monkeypatch.setattr(verification, "own_block_accepted", lambda *_: ())
    monkeypatch.setattr(verification, "board_compiles", lambda *_: BoardCompiled())
    monkeypatch.setattr(valve_report, "with_report", lambda found, *_: verification.evidence_files(found))


@cache
def _runs():
    return {}


def run_each_core_once(monkeypatch):
    """Let `verify` run a core once of those that are equal, with equal compensators, plants and ramps.

    For tests of what stands around that: the files of the target, recordings, report and command.
    """
    run = verification._run_core

    def once(folder, manifest, compensator, given, *watching):
        core = tuple((path.name, path.read_bytes()) for path in sorted((folder / "core").iterdir()))
        key = (core, tuple(manifest.core), to_json_bytes(compensator), repr(given))
        if key not in _runs():
            _runs()[key] = run(folder, manifest, compensator, given, *watching)
        return _runs()[key]

    monkeypatch.setattr(verification, "_run_core", once)
