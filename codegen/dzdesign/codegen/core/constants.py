"""A `#define` of the generated C, and where it is from; C's comment and the manifest's entry print it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from dzdesign.core.errors import DzdesignError
from dzdesign.design.firmware_manifest import FirmwareConstant

#: What a template prints: texts, and objects of `design` and of this room whose fields it prints.
Values = Mapping[str, object]
#: Longest line of a comment in the generated C.
COLUMNS = 120
#: C99's macros and suffixes: each gives the same number whatever the width of `int` and `long`.
LITERALS: Mapping[str, str] = {"plain": "{}u", "uint32": "UINT32_C({})", "int64": "INT64_C({})"}
EXACT = "exact"


@dataclass(frozen=True, slots=True, kw_only=True)
class Define:
    """One `#define`: its fields are those of `FirmwareConstant`; `literal` is one of `LITERALS`."""

    symbol: str
    value: int
    equation: str
    engineering: str
    rounding: str = EXACT
    #: Keys of compensator.json that it was computed from, dotted; none for what codegen chooses itself.
    data: tuple[str, ...] = ()
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

    def entry(self, file: str) -> FirmwareConstant:
        """Return the manifest's entry of the constant in a file of the firmware."""
        return FirmwareConstant(
            file=file, symbol=self.symbol, value=self.value, equation=self.equation, engineering=self.engineering,
            rounding=self.rounding, compensator_json=self.data, valve_json=(),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CoreFile:
    """One file of the core: its template, what this prints, and the constants among it, for the manifest."""

    template: str
    values: Values
    constants: tuple[FirmwareConstant, ...] = ()


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
