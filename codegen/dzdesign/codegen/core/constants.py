"""A `#define` or a table of the generated C, and where it is from; C's comment and the manifest's entry print it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from dzdesign.core.errors import DzdesignError
from dzdesign.design.firmware_manifest import FirmwareConstant

#: Longest line of a comment in the generated C.
COLUMNS = 120
#: C99's macros and suffixes: each gives the same number whatever the width of `int` and `long`.
LITERALS: Mapping[str, str] = {
    "plain": "{}u",
    "uint32": "UINT32_C({})",
    "uint64": "UINT64_C({})",
    "int32": "INT32_C({})",
}
EXACT = "exact"


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """What a `#define` or a table is, and where it is from: its fields are those of `FirmwareConstant`."""

    symbol: str
    value: int | tuple[tuple[int, int], ...]
    equation: str
    engineering: str
    rounding: str = EXACT
    #: Keys of compensator.json that it was computed from, dotted; none for what codegen chooses itself.
    data: tuple[str, ...] = ()
    generator: str

    def comment(self) -> list[str]:
        """Return the comment in C that says what the number is."""
        text = f"{self.equation}: {self.engineering} ({self.rounding})."
        return c_comment(text[0].upper() + text[1:])

    def entry(self, file: str, valve_keys: Mapping[str, Sequence[str]]) -> FirmwareConstant:
        """Return the manifest's entry of the constant in a file of the firmware.

        `valve_keys` has the keys of valve.json by the key of compensator.json that was designed from them.
        """
        from_valve = [key for datum in self.data for key in valve_keys.get(datum, ())]
        return FirmwareConstant(
            file=file,
            symbol=self.symbol,
            value=self.value,
            equation=self.equation,
            engineering=self.engineering,
            rounding=self.rounding,
            compensator_json=self.data,
            valve_json=tuple(dict.fromkeys(from_valve)),
            generator=self.generator,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Define(Constant):
    """One `#define`; `literal` is one of `LITERALS`."""

    value: int
    literal: str = "plain"

    def __post_init__(self) -> None:
        if self.value < 0 and not self.literal.startswith("int"):
            raise DzdesignError(f"constant {self.symbol} is {self.value}, which its unsigned type can't hold")

    def lines(self) -> list[str]:
        """Return the comment and the `#define`; a negative number stands in brackets."""
        literal = LITERALS[self.literal].format(abs(self.value))
        return [*self.comment(), f"#define {self.symbol} {f'(-{literal})' if self.value < 0 else literal}"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table(Constant):
    """One table; the rows are start and change."""

    value: tuple[tuple[int, int], ...]


def c_comment(text: str) -> list[str]:
    """Return a comment of C, its lines no longer than `COLUMNS`.

    Examples
    --------
    >>> c_comment("Full command.")
    ['/* Full command. */']
    """
    lines = wrap(text, COLUMNS - 6, break_long_words=False, break_on_hyphens=False)
    return [f"{' *' if number else '/*'} {line}" for number, line in enumerate(lines[:-1])] + [
        f"{' *' if len(lines) > 1 else '/*'} {lines[-1]} */"
    ]


def defines(constants: Sequence[Define]) -> list[str]:
    """Return the lines of several `#define`s, each with its comment."""
    return [line for constant in constants for line in constant.lines()]
