"""A `#define` of the generated C, with what its comment says of it.

Those of the status words of law, drive and current controller are here: a bit for each fault, by a convention and from
no datum.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from dzdesign.core.errors import DzdesignError

#: What a template prints: texts, and objects of `design` and of this room whose fields it prints.
Values = Mapping[str, object]
#: Longest line of a comment in the generated C.
COLUMNS = 120
#: C99's macros and suffixes: each gives the same number whatever the width of `int` and `long`.
LITERALS: Mapping[str, str] = {"plain": "{}u", "uint32": "UINT32_C({})", "int64": "INT64_C({})"}
EXACT = "exact"


@dataclass(frozen=True, slots=True, kw_only=True)
class Define:
    """One `#define`: what the number is, in engineering units, and how it was rounded; `literal` is of `LITERALS`."""

    symbol: str
    value: int
    equation: str
    engineering: str
    rounding: str = EXACT
    literal: str = "plain"

    def __post_init__(self) -> None:
        if self.value < 0:
            raise DzdesignError(f"constant {self.symbol} is {self.value}, which its unsigned type can't hold")

    def comment(self) -> list[str]:
        """Return the comment in C that says what the number is."""
        text = f"{self.equation}: {self.engineering} ({self.rounding})."
        return c_comment(text[0].upper() + text[1:])

    def lines(self) -> list[str]:
        """Return the comment and the `#define`."""
        return [*self.comment(), f"#define {self.symbol} {LITERALS[self.literal].format(self.value)}"]


def c_comment(text: str, columns: int = COLUMNS) -> list[str]:
    """Return a comment of C, its lines no longer than `columns`.

    Examples
    --------
    >>> c_comment("Full command.")
    ['/* Full command. */']
    """
    lines = wrap(text, columns - 6, break_long_words=False, break_on_hyphens=False)
    return [f"{' *' if number else '/*'} {line}" for number, line in enumerate(lines[:-1])] + [
        f"{' *' if len(lines) > 1 else '/*'} {lines[-1]} */"
    ]


def defines(constants: Sequence[Define]) -> list[str]:
    """Return the lines of several `#define`s, each with its comment."""
    return [line for constant in constants for line in constant.lines()]


#: Bits of the law's status word, and what each says.
STATUS_BITS = {
    "COMMAND": "command outside its valid codes, so the valve is let go",
    "PRESSURE_A": "pressure A outside its valid codes, so the smallest beta is used",
    "PRESSURE_B": "pressure B outside its valid codes, so the smallest beta is used",
    "DIFFERENCE": "valid pressures, but their drop too far below zero, so the smallest beta is used",
    "ABOVE": "pressure drop above the highest tested one: no fault, but no recording either",
}
#: The law's bit of a third pressure input.
THIRD_BIT = {"PRESSURE_C": (9, "pressure C outside its valid codes, so the smallest beta is used where it counts")}
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
#: The one that only two solenoids have; and by how many places those of solenoid B stand higher.
HELD_BIT = {"HELD": "the current does not end as the other solenoid is asked for: the switch does not open"}
OF_B = 8


def status_constants(inputs: str) -> list[Define]:
    """Return the bits of the law's status word, for the pressure inputs of these names."""
    bits = {name: (place, text) for place, (name, text) in enumerate(STATUS_BITS.items())} | THIRD_BIT
    if "C" not in inputs:
        bits.pop(*THIRD_BIT)
    return [*_bits("DZ_STATUS", ((place, name, text) for name, (place, text) in bits.items()), "the status word")]


def drive_status_constants(*, block: bool) -> list[Define]:
    """Return the bits that the drive adds."""
    bits = DRIVE_BITS | (CALIBRATION_BIT if block else {})
    return [*_bits("DZ_STATUS", ((place, name, text) for name, (place, text) in bits.items()),
                   "the drive's status word")]  # fmt: skip


def current_faults(*, two: bool) -> dict[str, str]:
    """Return the faults of a controller of one solenoid, or of two, in the order of their bits."""
    return FAULT_BITS | (HELD_BIT if two else {})


def current_fault_bits(*, two: bool) -> list[Define]:
    """Return the bits of the controller's word of faults."""
    bits = enumerate(current_faults(two=two).items())
    return [*_bits("DZ_CURRENT", ((place, *each) for place, each in bits), "the faults")]


def _bits(prefix: str, bits: Iterable[tuple[int, str, str]], of: str) -> Iterable[Define]:
    for place, name, text in bits:
        yield Define(symbol=f"{prefix}_{name}", value=1 << place, equation=f"bit {place} of {of}",
                     engineering=text, rounding="a convention")  # fmt: skip
