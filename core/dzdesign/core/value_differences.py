"""Differences between two values of the same structure, such as two artefacts of one type."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A place such as ``sides.positive.tests[2].dp_MPa``, what is stated there and what follows."""

    place: str
    stated: object
    follows: object


def differences(stated: object, follows: object, *, rounding: float = 0.0, place: str = "") -> Iterator[Difference]:
    """Yield each place where two values differ, the first one first.

    Two floats are one if they differ by `rounding` at most, or by that share of the larger one; without it only equal
    ones are. A key that one of both lacks is None there.

    Examples
    --------
    >>> [each.place for each in differences({"a": [1.0, 2.0]}, {"a": [1.0, 2.1], "b": 1})]
    ['.a[1]', '.b']
    >>> list(differences(1.0, 1.0 + 1e-9, rounding=1e-6)), len(list(differences(1.0, 1.0 + 1e-9)))
    ([], 1)
    """
    if stated == follows:
        return
    if is_dataclass(stated) and type(stated) is type(follows):
        for field in fields(stated):
            path = f"{place}.{field.name}" if place else field.name
            one, other = getattr(stated, field.name), getattr(follows, field.name)
            yield from differences(one, other, rounding=rounding, place=path)
    elif isinstance(stated, Mapping) and isinstance(follows, Mapping):
        for key in {**follows, **stated}:
            yield from differences(stated.get(key), follows.get(key), rounding=rounding, place=f"{place}.{key}")
    elif _are_rows(stated, follows):
        for index, (one, other) in enumerate(zip(stated, follows, strict=True)):  # type: ignore[call-overload]
            yield from differences(one, other, rounding=rounding, place=f"{place}[{index}]")
    elif not _are_near(stated, follows, rounding):
        yield Difference(place=place, stated=stated, follows=follows)


def _are_rows(stated: object, follows: object) -> bool:
    rows = isinstance(stated, Sequence) and isinstance(follows, Sequence) and not isinstance(stated, str)
    return rows and len(stated) == len(follows)  # type: ignore[arg-type]


def _are_near(stated: object, follows: object, rounding: float) -> bool:
    """Tell whether two numbers are one but for rounding; True and False are none."""
    if not (isinstance(stated, float) and isinstance(follows, float)):
        return False
    return math.isclose(stated, follows, rel_tol=rounding, abs_tol=rounding)
