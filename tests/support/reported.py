"""A reported demo that somebody changed afterwards."""

import json
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.documents import sha256_of, to_json


def change_json(path: Path, change) -> bytes:
    """Change a JSON file; return its new content."""
    document = json.loads(path.read_bytes())
    change(document)
    content = to_json(document).encode()
    path.write_bytes(content)
    return content


def change_evidence(folder: Path, change) -> None:
    """Change verification.json as if `verify` had found it so: the folder's manifest fits."""
    content = change_json(folder / "evidence" / "verification.json", change)
    change_json(
        folder / "evidence" / MANIFEST_NAME,
        lambda manifest: manifest["files"].update({"verification.json": sha256_of(content)}),
    )
