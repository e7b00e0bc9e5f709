"""A calibration block as a C initialiser, each member by its name."""

from collections.abc import Iterator
from textwrap import wrap

from dzdesign.codegen.calibration.layout import INNER, CalibrationBlock, Words, entries
from dzdesign.codegen.core.constants import COLUMNS


def block_lines(block: CalibrationBlock) -> list[str]:
    """Return the lines between the braces of a `struct dz_calibration`."""
    return list(_members(block, ""))


def _members(block: object, indent: str) -> Iterator[str]:
    own = entries(type(block))
    for name in block.__dataclass_fields__:  # type: ignore[attr-defined]
        value = getattr(block, name)
        if name in own:
            yield from _entry(name, own[name], value, indent)
        elif INNER[name][1] > 1:
            yield f"{indent}.{name} = {{"
            for each in value:
                yield f"{indent}    {{"
                yield from _members(each, f"{indent}        ")
                yield f"{indent}    }},"
            yield f"{indent}}},"
        else:
            yield f"{indent}.{name} = {{"
            yield from _members(value, f"{indent}    ")
            yield f"{indent}}},"


def _entry(name: str, entry: Words, value: int | tuple[int, ...], indent: str) -> Iterator[str]:
    """Yield one member, the two halves of a number of 64 bits apart and pairs in braces."""
    numbers = value if isinstance(value, tuple) else (value,)
    if entry.bits == 64:
        numbers = tuple(half for number in numbers for half in (number % 2**32, number >> 32))
    printed = [f"{number}u" if entry.bits == 16 else f"UINT32_C({number})" for number in numbers]
    if entry.pairs:
        printed = [f"{{{first}, {second}}}" for first, second in zip(printed[::2], printed[1::2], strict=True)]
    if len(printed) == 1:
        yield f"{indent}.{name} = {printed[0]},"
        return
    # What is zero up to the end needs no words: C sets it so.
    nothing = "{UINT32_C(0), UINT32_C(0)}" if entry.pairs else "0u"
    while len(printed) > 1 and printed[-1] == nothing:
        printed.pop()
    yield f"{indent}.{name} = {{"
    yield from (f"{indent}    {line}" for line in wrap(", ".join(printed), COLUMNS - 16, break_on_hyphens=False))
    yield f"{indent}}},"
