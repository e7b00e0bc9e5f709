"""What the functions of `dzdesign.api` are handed: what is no text, path or mapping is refused before all else.

By hand, and not by pydantic or typeguard: both end in a NameError at the annotations of classes that are imported only
when they are needed ("ValveModel | AnyPath"), and what they say of a wrong kind has several lines and no example.
"""

import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar, get_args, get_origin

from dzdesign.core.errors import InputError, nearest, quoted

P = ParamSpec("P")
R = TypeVar("R")

#: Of texts with a unit.
EXAMPLES = {
    "meter_floor": "0.6 L/min", "meter_lag": "0.1 s", "meter_zero": "0.1 L/min", "u_max": "10 V", "after_u_max": "10 V",
    "dp0": "1 MPa", "dp": "1 MPa", "x_max": "1.8 mm", "edge": "1 %", "pressure_span": "20 MPa", "zero_window": "1 %",
    "ramp_up": "0.5 s", "ramp_down": "0.5 s", "dither": "150 Hz 1 %", "output_max": "95 %", "ramp_time": "100 s",
    "level": "0.6 L/min", "limits": "5 %", "command_signal": "0..10 V x 0.3", "pressure_a": "4..20 mA on 150 ohm",
    "pressure_b": "4..20 mA on 150 ohm",
}  # fmt: skip
#: Read by what they are for, which refuses what can't be a number.
ELSEWHERE = (int, float, bool)


def takes_text(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function refuse, in a sentence, an option that it lacks, or one of another kind than its annotation says.

    Parameters
    ----------
    function : callable
        With annotations of text, paths, mappings and iterables of them; numbers are left to itself.

    Examples
    --------
    >>> @takes_text
    ... def wait(*, ramp_time: str = "1 s") -> str:
    ...     return ramp_time
    >>> wait(ramp_time=5)
    Traceback (most recent call last):
    dzdesign.core.errors.InputError: ramp_time: expected text with a unit such as '100 s', got 5
    """
    signature = inspect.signature(function)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in signature.parameters:
                mine, hint = function.__name__, nearest(name, signature.parameters)
                raise InputError(f"{mine} has no option {quoted(name)}{hint}; see help({mine})")
        bound = signature.bind(*args, **kwargs)
        for name, value in bound.arguments.items():
            bound.arguments[name] = _checked(name, value, signature.parameters[name].annotation)
        return function(*bound.args, **bound.kwargs)

    return checked


def _checked(name: str, value: Any, annotation: Any) -> Any:
    """Return an argument, an iterable as a list; refuse one that does not fit."""
    if isinstance(annotation, str):  # such as "ValveModel | AnyPath": a class that is imported when it is needed
        kinds: tuple[Any, ...] = (str, os.PathLike)
        if annotation.partition(" ")[0] in (one.__name__ for one in type(value).__mro__):
            return value
    else:
        kinds = get_args(annotation) if get_origin(annotation) not in (None, Mapping, Iterable) else (annotation,)
    if any(kind in ELSEWHERE for kind in kinds):
        return value
    whole = {get_origin(kind) or kind: get_args(kind) for kind in kinds}
    if isinstance(value, Mapping) and Mapping in whole:
        if whole[Mapping][1] is str:
            for key, item in value.items():
                _refuse_unless(isinstance(item, str), f"{name}[{key!r}]", item, {str: ()}, name)
        return value
    if isinstance(value, tuple(one for one in whole if one not in (Mapping, Iterable))):
        return value
    several = Iterable in whole and isinstance(value, Iterable) and not isinstance(value, bytes | bytearray)
    _refuse_unless(several, name, value, whole, name)
    items = list(value)
    for index, item in enumerate(items):
        _refuse_unless(isinstance(item, str | os.PathLike), f"{name}[{index}]", item, {**whole, Iterable: ()}, name)
    return items


def _refuse_unless(fits: bool, place: str, value: object, whole: Mapping[Any, Any], name: str) -> None:
    if fits:
        return
    if os.PathLike in whole:
        words = "a path"
    elif name in EXAMPLES:
        words = f"text with a unit such as '{EXAMPLES[name]}'"
    else:
        words = "text" if str in whole else "a mapping of names to values"
    raise InputError(f"{place}: expected {words}, got {quoted(value)}")
