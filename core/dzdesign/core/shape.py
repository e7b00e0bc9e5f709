"""Shape of a JSON artefact: the keys that it must have and the values that fit, so that a bad one is named."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import NoneType
from typing import Any

from dzdesign.core.errors import InputError, quoted

#: A mapping has (at least) these keys, a list holds any number of one shape, a tuple is a choice of shapes,
#: a type is a value of that type (``float``: a number), `Number` and `Exactly` say more.
Shape = Any

NAMES = {float: "a number", int: "a whole number", str: "text", bool: "true or false", dict: "an object"}


@dataclass(frozen=True, slots=True)
class Number:
    """A number from `low` to `high`; a whole one if `whole`. The ends keep arithmetic on it from overflowing."""

    low: float
    high: float
    whole: bool = False

    def __str__(self) -> str:
        kind = "a whole number" if self.whole else "a number"
        return f"{kind} from {self.low:.12g} to {self.high:.12g}"


@dataclass(frozen=True, slots=True)
class Exactly:
    """A list of `count` items of one shape."""

    count: int
    item: Shape


def check_shape(document: Any, shape: Shape, source: str, remedy: str) -> None:
    """Check that a document has a shape; more keys than the shape's are welcome.

    Parameters
    ----------
    document : object
        Parsed JSON.
    shape : Shape
        What it must look like.
    source : str
        File name, for the message.
    remedy : str
        What to do, for the message.

    Raises
    ------
    InputError
        Naming the first key that is missing or whose value does not fit.

    Examples
    --------
    >>> check_shape({"u_max_V": 10.0, "notes": "bench 2"}, {"u_max_V": float}, "valve.json", "make it again")
    """
    _check(document, shape, "", f"'{source}'", remedy)


def _check(value: Any, shape: Shape, place: str, source: str, remedy: str) -> None:
    if isinstance(shape, Mapping) and isinstance(value, dict):
        for key, its_shape in shape.items():
            path = f"{place}.{key}" if place else key
            if key not in value:
                raise InputError(f"{source} lacks the key '{path}'; {remedy}")
            _check(value[key], its_shape, path, source, remedy)
    elif isinstance(shape, list | Exactly) and isinstance(value, list):
        if isinstance(shape, Exactly) and len(value) != shape.count:
            raise InputError(f"{source}: '{place}' has {len(value)} items, expected {shape.count}; {remedy}")
        for index, item in enumerate(value):
            _check(item, shape[0] if isinstance(shape, list) else shape.item, f"{place}[{index}]", source, remedy)
    elif isinstance(shape, tuple):
        # Of a choice, the one that is not null says more about what is wrong.
        if not (value is None and NoneType in shape):
            _check(value, next(one for one in shape if one is not NoneType), place, source, remedy)
    elif not _fits(value, shape):
        raise InputError(f"{source}: '{place}' is {quoted(value)}, expected {_named(shape)}; {remedy}")


def _fits(value: Any, shape: Shape) -> bool:
    if isinstance(shape, Number):
        right_type = type(value) is int or (type(value) is float and not shape.whole)
        return right_type and shape.low <= value <= shape.high
    if shape is float:
        return type(value) in (int, float) and abs(value) <= 1e300
    return isinstance(shape, type) and type(value) is shape


def _named(shape: Shape) -> str:
    if isinstance(shape, Number):
        return str(shape)
    if isinstance(shape, Mapping):
        return f"an object with {', '.join(shape)}"
    if isinstance(shape, list | Exactly):
        return "a list"
    return NAMES[shape]
