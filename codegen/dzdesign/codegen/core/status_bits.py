"""The status words of law, drive and current controller: a bit for each fault, by a convention and from no datum."""

from collections.abc import Iterable

from dzdesign.codegen.core.constants import Define

#: Bits of the law's status word, and what each says.
STATUS_BITS = {
    "COMMAND": "command outside its valid codes, so the valve is let go",
    "PRESSURE_A": "pressure A outside its valid codes, so the smallest beta is used",
    "PRESSURE_B": "pressure B outside its valid codes, so the smallest beta is used",
    "DIFFERENCE": "valid pressures, but their drop too far below zero, so the smallest beta is used",
    "ABOVE": "pressure drop above the highest tested one: no fault, but no recording either",
}
#: Bits that the drive adds to those of the law, each with its place.
DRIVE_BITS = {
    "WAITING": (5, "the drive waits: for valid commands, and with the interlock for zero command"),
    "HELD": (6, "the smallest beta is used until the pressures have been valid for long enough"),
    "LATCHED": (7, "a fault that stays until dz_drive_init()"),
}
#: The drive's bit of a block that was refused.
CALIBRATION_BIT = {"CALIBRATION": (8, "dz_calibration_check() refused the block: the output is released")}
#: Bits of the current controller's word of faults.
FAULT_BITS = {
    "NO_OFFSET": "the offset of the current's codes is not calibrated yet",
    "SENSOR": "that offset is too far from the designed one",
    "OPEN": "no current where one must flow: wire or coil open",
    "SHORT": "the current is beyond the converter's range",
    "OVER": "the current stayed above its limit",
}


def status_constants() -> list[Define]:
    """Return the bits of the law's status word."""
    return [*_bits("DZ_STATUS", ((place, *each) for place, each in enumerate(STATUS_BITS.items())), "the status word")]


def drive_status_constants(*, block: bool) -> list[Define]:
    """Return the bits that the drive adds."""
    bits = DRIVE_BITS | (CALIBRATION_BIT if block else {})
    return [*_bits("DZ_STATUS", ((place, name, text) for name, (place, text) in bits.items()),
                   "the drive's status word")]  # fmt: skip


def current_fault_bits() -> list[Define]:
    """Return the bits of the controller's word of faults."""
    return [*_bits("DZ_CURRENT", ((place, *each) for place, each in enumerate(FAULT_BITS.items())), "the faults")]


def difference_place() -> Define:
    """Return the place of a status bit, by which the one above it is shifted down to be masked with it."""
    place = list(STATUS_BITS).index("DIFFERENCE")
    return Define(symbol="DIFFERENCE_PLACE", value=place, equation="place of DZ_STATUS_DIFFERENCE in the status word",
                  engineering=f"bit {place}", rounding="a convention")  # fmt: skip


def _bits(prefix: str, bits: Iterable[tuple[int, str, str]], of: str) -> Iterable[Define]:
    for place, name, text in bits:
        yield Define(symbol=f"{prefix}_{name}", value=1 << place, equation=f"bit {place} of {of}",
                     engineering=text, rounding="a convention")  # fmt: skip
