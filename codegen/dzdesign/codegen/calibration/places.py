"""Where a calibration block lies in a target's memory, and how that target's tools count addresses."""

from dataclasses import dataclass

from dzdesign.core.errors import InputError

#: Octets that addresses of 32 bits tell apart.
ADDRESSES = 1 << 32
#: Numbers of 32 bits must begin where the processor can read them.
ALIGNED_OCTETS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """An address, in the units of the target: octets, or words of 16 bits on a C28x, where no octet has an address."""

    address: int = 0
    unit_octets: int = 1

    def at(self, address: int, octets: int) -> "Place":
        """Return the same memory at another address, where so many octets must have room."""
        last, step = (ADDRESSES - octets) // self.unit_octets, ALIGNED_OCTETS // self.unit_octets
        if not 0 <= address <= last or address % step:
            unit = "words of 16 bits" if self.unit_octets > 1 else "octets"
            raise InputError(
                f"--address is {address:#x}, expected a multiple of {step} up to {last - last % step:#x}, in {unit}"
            )
        return Place(address=address, unit_octets=self.unit_octets)
