"""Where a file places a block, in words: at the sector that a target's firmware reads, or elsewhere.

A programmer writes there whatever the firmware reads: at another address the drive keeps its old block, or another
part of its program is lost.
"""

from collections.abc import Mapping

from dzdesign.codegen.calibration.places import Place

ELSEWHERE = "right only if your linker file places it there"


def place_in_words(place: Place, sectors: Mapping[str, Place]) -> str:
    """Say where a file places a block; `sectors` are where targets' firmware has it, by their names.

    Examples
    --------
    >>> sectors = {"f28335": Place(address=0x33_0000, unit_octets=2)}
    >>> place_in_words(Place(address=0x33_0000, unit_octets=2), sectors)
    "word 0x330000, where f28335's firmware has its block"
    >>> place_in_words(Place(address=0x30_0000, unit_octets=2), sectors)
    'word 0x300000, WHERE NO GENERATED FIRMWARE HAS ITS BLOCK: right only if your linker file places it there'
    """
    where = f"{'word' if place.unit_octets > 1 else 'octet'} {place.address:#x}"
    for target, sector in sectors.items():
        if place == sector:
            return f"{where}, where {target}'s firmware has its block"
    return f"{where}, WHERE NO GENERATED FIRMWARE HAS ITS BLOCK: {ELSEWHERE}"


def elsewhere(target: str, address: int, sector: Place) -> str:
    """Say that an address, in the target's units, is not where its firmware has the block; empty where it is.

    Examples
    --------
    >>> sector = Place(address=0x33_0000, unit_octets=2)
    >>> elsewhere("f28335", 0x33_0000, sector)
    ''
    >>> elsewhere("f28335", 0x30_0000, sector)
    "NOT 0x330000, where f28335's firmware has its block: right only if your linker file places it there"
    """
    if sector.address == address:
        return ""
    return f"NOT {sector.address:#x}, where {target}'s firmware has its block: {ELSEWHERE}"
