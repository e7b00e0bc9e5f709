"""The valves of a common setting in its compensator.json: written, read, and that nobody changed them in between."""

from collections.abc import Sequence
from types import NoneType
from typing import Any

from dzdesign.core.artefact_files import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.shape import Number
from dzdesign.design.lot import LotSide, LotValve

SIDE = {
    "trend": (str, NoneType),
    "confidence": Number(0.5, 1),
    "dp_MPa": [Number(0, 1e6)],
    "u_lower_V": [Number(-1e6, 1e6)],
}
#: What compensator.json holds of a lot; that of one valve, or from before lots were kept, has neither key.
LOT = {
    "lot_sha256": str,
    "lot": [{"name": str, "valve_sha256": str, "sides": {"positive": SIDE, "negative": (SIDE, NoneType)}}],
}


def lot_document(lot: Sequence[LotValve]) -> dict[str, Any]:
    """Return the keys of compensator.json; none of a valve's own setting."""
    if not lot:
        return {}
    valves = [_valve_document(valve) for valve in lot]
    return {"lot_sha256": _hash_of(valves), "lot": valves}


def lot_from_document(document: dict[str, Any]) -> tuple[LotValve, ...]:
    """Read the lot of a compensator.json of the right shape."""
    valves = []
    for each in document.get("lot", ()):
        positive, negative = (each["sides"][name] for name in ("positive", "negative"))
        valves.append(
            LotValve(
                name=each["name"],
                valve_sha256=each["valve_sha256"],
                positive=_side(positive),
                negative=_side(negative) if negative else None,
            )
        )
    return tuple(valves)


def check_lot_hash(document: dict[str, Any], source: str) -> None:
    """Refuse bounds that somebody has edited: no proof would tell that one had been raised.

    Raises
    ------
    InputError
        If the lot and its hash do not belong together.
    """
    if document.get("lot_sha256") != (_hash_of(document["lot"]) if "lot" in document else None):
        raise InputError(
            f"'{source}': 'lot', the valves of the common setting, is not as it was written ('lot_sha256' is of "
            "another); make it again with `dzdesign batch`"
        )


def _hash_of(valves: list[dict[str, Any]]) -> str:
    return sha256_of(to_json(valves).encode())


def _valve_document(valve: LotValve) -> dict[str, Any]:
    return {
        "name": valve.name,
        "valve_sha256": valve.valve_sha256,
        "sides": {
            "positive": _side_document(valve.positive),
            "negative": _side_document(valve.negative) if valve.negative else None,
        },
    }


def _side_document(side: LotSide) -> dict[str, Any]:
    return {
        "trend": side.trend,
        "confidence": side.confidence,
        "dp_MPa": list(side.dp_MPa),
        "u_lower_V": list(side.lower_V),
    }


def _side(document: dict[str, Any]) -> LotSide:
    return LotSide(
        trend=document["trend"],
        confidence=document["confidence"],
        dp_MPa=tuple(document["dp_MPa"]),
        lower_V=tuple(document["u_lower_V"]),
    )
