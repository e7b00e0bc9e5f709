"""Edits of a firmware folder by hand, and `dzdesign verify` with all that takes long taken as held.

What runs the C (every input, the drive, the closed loop) can only add to what does not hold; an attack must be seen
without it. The untouched firmware goes the same way and holds.
"""

import json
from functools import cache

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of, to_json
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.report import valve_report
from dzdesign.verify import verification
from dzdesign.verify.firmware.compilation import BoardCompiled
from dzdesign.verify.requirements import ALWAYS, CERTIFICATE, FILES, LAW, MANIFEST, REGENERATED, VALVE

#: What is tried in earnest; all others of the list are taken as held.
TRIED = (FILES, MANIFEST, CERTIFICATE, LAW, VALVE, REGENERATED)


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


def seal(folder, change=lambda manifest: None):
    """Make the manifest's hashes those of the files as they are."""

    def with_hashes(manifest):
        change(manifest)
        manifest["files"] = {
            name: digest if name in manifest["board"] else sha256_of((folder / name).read_bytes())
            for name, digest in manifest["files"].items()
        }

    change_json(folder / MANIFEST_NAME, with_hashes)


def take_the_rest_as_held(monkeypatch):
    """Let `verify` try files, manifest, compensator and generating again, and nothing that compiles or runs C."""
    held = tuple(each.check(holds=True, text="taken as held") for each in ALWAYS if each not in TRIED)
    monkeypatch.setattr(verification, "_try_core", lambda *_: verification._Core(checks=held))
    monkeypatch.setattr(verification, "scenes_of", lambda *_: None)
    monkeypatch.setattr(verification, "board_compiles", lambda *_: BoardCompiled())
    monkeypatch.setattr(valve_report, "with_report", lambda found, *_: verification.evidence_files(found))
    for name in ("law_follows", "certificate_follows"):
        monkeypatch.setattr(verification, name, _once(getattr(verification, name)))


@cache
def _runs():
    return {}


def run_each_core_once(monkeypatch):
    """Let `verify` run a core once of those that are equal, with equal compensators, plants and ramps.

    For tests of what stands around that: the manifest, the files of the target, recordings, report and command.
    """
    run = verification._run_core

    def once(folder, manifest, compensator, given, *watching):
        core = tuple((path.name, path.read_bytes()) for path in sorted((folder / "core").iterdir()))
        key = (core, tuple(manifest.core), to_json_bytes(compensator), repr(given))
        if key not in _runs():
            _runs()[key] = run(folder, manifest, compensator, given, *watching)
        return _runs()[key]

    monkeypatch.setattr(verification, "_run_core", once)


@cache
def _once(check):
    """Check equal compensators once: designing one again takes a second."""
    found = {}

    def checked(compensator):
        key = to_json_bytes(compensator)
        if key not in found:
            found[key] = check(compensator)
        return found[key]

    return checked
