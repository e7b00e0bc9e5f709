"""How an option is declared: once, as an annotated field of a frozen dataclass of arguments.

Command line, options file, keywords of `dzdesign.api`, help and reference pages are made of it.

>>> from typing import Annotated
>>> from dzdesign.core.option_readers import quantity
>>> @dataclass(frozen=True, kw_only=True)
... class Pump:
...     lag: Annotated[str, Option("T", example="0.5 s", read=quantity("time"))] = "100 ms"
...     '''Lag of the pump.'''
>>> read_options(Pump(), ["lag"])
{'lag': 0.1}
"""

import ast
import inspect
import itertools
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any, ForwardRef, get_args, get_origin

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
MACHINE, BOARD, OUTPUTS = "machine", "board", "outputs other than a C firmware"
GROUPS = (RECORDINGS, METER, FIT, LAW, CONNECTIONS, DRIVE, MACHINE, BOARD, OUTPUTS, CHECKS)


@dataclass(frozen=True, slots=True)
class Option:
    """What is declared of an option, in the annotation of a field; its help is the docstring below the field."""

    #: How the help calls the value.
    metavar: str = ""
    #: Heading in the help, one of `GROUPS`.
    group: str = ""
    #: Text that stands for an option that was not given, where the field's own default is None.
    default: str = ""
    #: A right text with its unit, for the message about a value of another kind.
    example: str = ""
    #: Turns text into the value that a stage works with; its second argument names the option for messages.
    read: Callable[[Any, str], Any] | None = None
    #: What stands for an option that was not given on the command line, where Python has another default.
    command_default: str = ""
    #: Words that the option takes, for its help.
    choices: tuple[str, ...] = ()
    #: Spelling of one letter on the command line, such as ``-o``.
    short: str = ""
    #: The command line names it although Python takes it by position.
    named: bool = False
    #: A mapping that the command line takes an entry at a time, ``NAME = TEXT``, on top of the options file's table.
    by_entry: bool = False
    #: A repeatable option that takes several values at once, as a shell makes them of a pattern.
    several: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    """A field of a dataclass of arguments, and the option that it declares."""

    name: str
    option: Option
    help: str
    #: Types that a value may have, such as str, PathLike, Mapping, Iterable.
    kinds: frozenset[Any]
    #: Names of the classes whose instances may be handed in place of a file, "A | B"; empty if there is none.
    result_class: str
    #: Whether Python takes it by position.
    by_position: bool
    required: bool
    default: Any

    @property
    def flag(self) -> str:
        """The option as written on the command line."""
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
        return self.option.command_default or self.option.default or str(self.default or "")

    def described(self, default: str) -> str:
        """Return the help with the words that it takes and its default, both in its first sentence."""
        words = self.option.choices
        notes = [", ".join(words)] if any(word not in self.help for word in words) else []
        notes += [f"default: {default}"] if default else []
        first, stop, others = self.help.partition(". ")
        return f"{first.removesuffix('.')} ({'; '.join(notes)}).{stop[1:]}{others}" if notes else self.help


def flag_of(name: str) -> str:
    """Return an option as written on the command line.

    Examples
    --------
    >>> flag_of("below_dp0")
    '--below-dp0'
    >>> flag_of("from_")  # a word of Python
    '--from'
    """
    return f"--{name.rstrip('_').replace('_', '-')}"


@cache
def arguments_of(declaration: type) -> tuple[Argument, ...]:
    """Return what a dataclass of arguments declares, those by position first."""
    found, helps = [], field_docstrings(declaration)
    for field in fields(declaration):
        annotation, option = get_args(field.type)[:2]
        result_class = ""
        if isinstance(annotation, ForwardRef):  # "ValveModel | AnyPath": a class that is imported when it is needed
            result_class, annotation = annotation.__forward_arg__.rpartition(" | ")[0], AnyPath
        kinds = get_args(annotation) if get_origin(annotation) not in (Iterable, Mapping) else (annotation,)
        found.append(
            Argument(
                name=field.name,
                option=option,
                help=helps.get(field.name, ""),
                kinds=frozenset(get_origin(kind) or kind for kind in kinds or (annotation,)),
                result_class=result_class,
                by_position=not field.kw_only,
                required=field.default is MISSING,
                default=None if field.default is MISSING else field.default,
            )
        )
    return tuple(sorted(found, key=lambda argument: not argument.by_position))


def field_docstrings(declaration: type) -> dict[str, str]:
    """Return the docstring that stands below each field of a class and of its bases; in the field's source alone."""
    helps: dict[str, str] = {}
    for each in reversed(declaration.__mro__):
        helps |= _docstrings_in(each.__module__).get(each.__qualname__.rpartition(".")[2], {})
    return helps


@cache
def _docstrings_in(module: str) -> dict[str, dict[str, str]]:
    """Return the docstrings below the fields of a module's classes; none where there is no source."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    found: dict[str, dict[str, str]] = {}
    for each in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        for field, below in itertools.pairwise(each.body):
            match field, below:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                    found.setdefault(each.name, {})[name] = " ".join(text.split())
    return found


def read_options(arguments: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return options by name, each read; None where one is not given and has no default."""
    declaration: type = type(arguments)
    known, values = {argument.name: argument for argument in arguments_of(declaration)}, {}
    for name in names:
        option, value = known[name].option, getattr(arguments, name)
        value = (option.default or None) if value is None else value
        values[name] = option.read(value, flag_of(name)) if option.read and value is not None else value
    return values


def paths_of(paths: Paths) -> list[AnyPath]:
    """Return one path, or several, as a list."""
    return [paths] if isinstance(paths, str | os.PathLike) else list(paths)


def texts_of(texts: Texts) -> list[str]:
    """Return one text, or several, as a list."""
    return [texts] if isinstance(texts, str) else list(texts)
