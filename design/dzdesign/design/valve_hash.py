"""SHA-256 of a valve as `identify` writes it, computed once for all that is made of one valve."""

from threading import local

from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.identify.valve.model import ValveModel

#: The last valve and its hash: a design makes several compensators of one valve, each of which states the hash.
LAST = local()


def sha256_of_valve(valve: ValveModel) -> str:
    """Return the SHA-256 of the valve.json of a valve; known again by its identity, for a valve never changes."""
    if getattr(LAST, "valve", None) is not valve:
        LAST.sha256, LAST.valve = sha256_of(to_json_bytes(valve)), valve
    digest: str = LAST.sha256
    return digest
