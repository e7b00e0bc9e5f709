"""How an option is declared: once, as an annotated field of a frozen dataclass of arguments.

Command line, options file, keywords of `dzdesign.api`, help, shell completion and reference pages are made of it.

>>> from typing import Annotated
>>> @dataclass(frozen=True, kw_only=True)
... class Pump:
...     lag: Annotated[str, Option("Lag of the pump.", "T", example="0.5 s", read=quantity("time"))] = "100 ms"
>>> read_options(Pump(), ["lag"])
{'lag': 0.1}
"""

import contextlib
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any, ForwardRef, get_args, get_origin

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import parse_quantity

#: Types of options: text; a file or folder as the standard library takes it, one or several; one or several texts.
Text = str | None
AnyPath = str | os.PathLike[str]
Paths = AnyPath | Iterable[AnyPath]
Texts = str | Iterable[str]
#: Text, or a table of texts, in Python a mapping.
Table = str | Mapping[str, str] | None

#: Headings of the help, in their order; an option without one stands above them.
RECORDINGS, METER, FIT, LAW = "recordings", "flow meter", "fit", "law"
CONNECTIONS, DRIVE, CHECKS = "connections of the firmware", "drive functions", "further checks"
GROUPS = (RECORDINGS, METER, FIT, LAW, CONNECTIONS, DRIVE, CHECKS)


@dataclass(frozen=True, slots=True)
class Option:
    """What is declared of an option, in the annotation of a field.

    Attributes
    ----------
    help : str
        One or two sentences, for the help of the command line and of Python.
    metavar : str
        How the help calls the value.
    group : str
        Heading in the help, one of `GROUPS`.
    default : str
        Text that stands for an option that was not given, where the field's own default is None.
    example : str
        A right text with its unit, for the message about a value of another kind.
    read : callable, optional
        Turns text into the value that a stage works with; its second argument names the option for messages.
    command_default : str
        The same on the command line alone.
    choices : tuple of str or str
        Words that the option takes; where these are costly to import, their place as ``module:NAME``.
    short : str
        Spelling of one letter on the command line, such as ``-o``.
    named : bool
        The command line names it although Python takes it by position.
    by_entry : bool
        A mapping that the command line takes an entry at a time, ``NAME = TEXT``, on top of the options file's table.
    """

    help: str
    metavar: str = ""
    group: str = ""
    default: str = ""
    example: str = ""
    read: Callable[[str, str], Any] | None = None
    command_default: str = ""
    choices: tuple[str, ...] | str = ()
    short: str = ""
    named: bool = False
    by_entry: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    """A field of a dataclass of arguments, and the option that it declares.

    Attributes
    ----------
    name : str
        In Python and, with ``_`` or ``-``, in the options file.
    option : Option
        As declared.
    kinds : frozenset
        Types that a value may have, such as str, PathLike, Mapping, Iterable.
    result_class : str
        Name of the class whose instances may be handed in place of a file; empty if there is none.
    by_position : bool
        Whether Python takes it by position.
    required : bool
        Whether it must be given.
    default : object
        Of the field.
    """

    name: str
    option: Option
    kinds: frozenset[Any]
    result_class: str
    by_position: bool
    required: bool
    default: Any

    @property
    def flag(self) -> str:
        """The option as it is written on the command line."""
        return flag_of(self.name)

    @property
    def is_positional(self) -> bool:
        """Whether the command line takes its value without a name."""
        return self.by_position and not self.option.named

    @property
    def is_repeatable(self) -> bool:
        """Whether it takes several values."""
        return Iterable in self.kinds or self.option.by_entry

    @property
    def is_path(self) -> bool:
        """Whether it names files or folders."""
        return os.PathLike in self.kinds

    @property
    def is_table(self) -> bool:
        """Whether it may be a table of the options file."""
        return Mapping in self.kinds

    @property
    def default_text(self) -> str:
        """What stands for it on the command line if it is not given; empty if nothing does."""
        text = self.option.command_default or self.option.default
        return text or (self.default if isinstance(self.default, str) else "")


def flag_of(name: str) -> str:
    """Return an option as it is written on the command line.

    Examples
    --------
    >>> flag_of("below_dp0")
    '--below-dp0'
    """
    return f"--{name.replace('_', '-')}"


@cache
def arguments_of(declaration: type) -> tuple[Argument, ...]:
    """Return what a dataclass of arguments declares, those by position first.

    Parameters
    ----------
    declaration : type
        A dataclass whose fields are ``Annotated`` with an `Option`.
    """
    found = []
    for field in fields(declaration):
        annotation, option = get_args(field.type)[:2]
        result_class = ""
        if isinstance(annotation, ForwardRef):  # "ValveModel | AnyPath": a class that is imported when it is needed
            result_class, annotation = annotation.__forward_arg__.partition(" ")[0], AnyPath
        kinds = get_args(annotation) if get_origin(annotation) not in (Iterable, Mapping) else (annotation,)
        found.append(
            Argument(
                name=field.name,
                option=option,
                kinds=frozenset(get_origin(kind) or kind for kind in kinds or (annotation,)),
                result_class=result_class,
                by_position=not field.kw_only,
                required=field.default is MISSING,
                default=None if field.default is MISSING else field.default,
            )
        )
    return tuple(sorted(found, key=lambda argument: not argument.by_position))


def read_options(arguments: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return options by name, each read; None where one is not given and has no default.

    Parameters
    ----------
    arguments : dataclass
        Of a class that `arguments_of` knows.
    names : iterable of str
        Fields of it.

    Raises
    ------
    InputError
        If one can't be read; it is named.
    """
    declaration: type = type(arguments)
    known, values = {argument.name: argument for argument in arguments_of(declaration)}, {}
    for name in names:
        option, value = known[name].option, getattr(arguments, name)
        value = (option.default or None) if value is None else value
        values[name] = option.read(value, flag_of(name)) if option.read and value is not None else value
    return values


def quantity(kind: str) -> Callable[[str, str], float]:
    """Return what reads a number with its unit, in SI.

    Parameters
    ----------
    kind : str
        A key of `dzdesign.core.units.SI_UNIT`.
    """
    return lambda text, option: parse_quantity(text, kind, option)


def number(expected: str, between: tuple[float, float] | None = None) -> Callable[[str | float, str], float]:
    """Return what reads a number without a unit.

    Parameters
    ----------
    expected : str
        For the message, such as ``a number such as 0.99``.
    between : tuple of float, optional
        Every number lies between these.
    """

    def read(text: str | float, option: str) -> float:
        with contextlib.suppress(ValueError):
            value = float(text)
            if between is None or between[0] < value < between[1]:
                return value
        raise InputError(f"{option} is {quoted(text)}, expected {expected}")

    return read


def whole_number(expected: str, least: int = 0, digits: int = 6) -> Callable[[str | int, str], int]:
    """Return what reads a whole number.

    Parameters
    ----------
    expected : str
        For the message, such as ``a number of processes such as 4``.
    least, digits : int
        Smallest number, and how many digits the largest has.
    """

    def read(text: str | int, option: str) -> int:
        if not re.fullmatch(rf"\d{{1,{digits}}}", str(text), re.ASCII) or int(text) < least:
            raise InputError(f"{option} is {quoted(text)}, expected {expected}")
        return int(text)

    return read


def percent_range(of: str) -> Callable[[str, str], tuple[float, float]]:
    """Return what reads two percentages such as ``12-50``, as shares.

    Parameters
    ----------
    of : str
        For the message: of what, and an example.
    """
    # Digits and blanks without an end would be matched in the square of their number.
    digits = r"\s{0,9}(\d{1,9}(?:\.\d{0,15})?)\s{0,9}%?\s{0,9}"

    def read(text: str, option: str) -> tuple[float, float]:
        ends = re.fullmatch(f"{digits}-{digits}", text, re.ASCII)
        if ends is None:
            raise InputError(f"{option} is {quoted(text)}, expected two per cents of {of}")
        return float(ends[1]) / 100, float(ends[2]) / 100

    return read


def paths_of(paths: Paths) -> list[AnyPath]:
    """Return one path, or several, as a list.

    Parameters
    ----------
    paths : path or iterable of paths
        As a caller gave them.
    """
    return [paths] if isinstance(paths, str | os.PathLike) else list(paths)


def texts_of(texts: Texts) -> list[str]:
    """Return one text, or several, as a list.

    Parameters
    ----------
    texts : str or iterable of str
        As a caller gave them.
    """
    return [texts] if isinstance(texts, str) else list(texts)
