"""A stage as a function with keywords: typed and documented by the dataclass of its arguments.

By hand, and not by pydantic or typeguard: both end in a NameError at the annotations of classes that are imported only
when they are needed ("ValveModel | AnyPath"), and their messages have several lines and no example.
"""

import inspect
import os
import re
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, ForwardRef, ParamSpec, TypeVar, get_args

from dzdesign.command_line.invocation import Value, completed, in_words_of_the_file
from dzdesign.command_line.parser import CommonArguments
from dzdesign.core.errors import DzdesignError, InputError, nearest, quoted
from dzdesign.core.options import AnyPath, Argument, arguments_of
from dzdesign.terminal.progress import reporting

P = ParamSpec("P")
A = TypeVar("A")
R = TypeVar("R")

#: The heading of a section of a docstring, before which that of the parameters is put.
SECTION = re.compile(r"( *)\w+\n *-+\n")


def with_keywords(declaration: Callable[P, A], stage: Callable[[A], R], command: str = "") -> Callable[P, R]:
    """Return a stage as a function of the fields of its arguments, which reports no progress.

    It refuses, in one sentence, an option that the stage lacks, and a value of another kind than is declared. That of
    a command also takes ``config``, an options file: what it says stands behind the keywords, as on the command line.

    Examples
    --------
    >>> from dzdesign.stages.simulate import SimulateArguments, simulate
    >>> with_keywords(SimulateArguments, simulate)(ramp_time=5)
    Traceback (most recent call last):
    dzdesign.core.errors.InputError: ramp_time: expected text with a unit such as '100 s', got 5
    """
    signature, name = inspect.signature(declaration), stage.__name__
    own = {argument.name: argument for argument in arguments_of(declaration)}
    common = {argument.name: argument for argument in arguments_of(CommonArguments) if command}
    declared = own | {key: common[key] for key in ("config",) if key in common}

    @wraps(stage)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for key in kwargs:
            if key not in declared:
                raise InputError(f"{name} has no option {quoted(key)}{nearest(key, declared)}; see help({name})")
        config = kwargs.pop("config", None)
        bound = (signature.bind if config is None else signature.bind_partial)(*args, **kwargs)
        for key, value in bound.arguments.items():
            bound.arguments[key] = _checked(own[key], value)
        from_file: dict[str, Value] = {}
        try:
            with reporting(quiet=True, verbose=False):
                if config is not None:
                    path = _checked(declared["config"], config)
                    from_file = completed(command, tuple(own.values()), bound.arguments, path)
                return stage(declaration(*bound.args, **bound.kwargs))
        except DzdesignError as error:
            message = in_words_of_the_file(str(error), str(config), from_file)
            raise type(error)(_in_keywords(message, declared)) from error

    plain = [each.replace(annotation=_plain(each.annotation)) for each in signature.parameters.values()]
    if command:
        plain.append(inspect.Parameter("config", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=AnyPath))
    result = inspect.signature(stage).return_annotation
    call.__signature__ = inspect.Signature(plain, return_annotation=result)  # type: ignore[attr-defined]
    call.__doc__ = SECTION.sub(lambda found: _parameters(declared, found[1]) + found[0], stage.__doc__ or "", count=1)
    return call


def _in_keywords(message: str, declared: Mapping[str, Argument]) -> str:
    """Return a message with options as keywords: stages name them as the command line does, by which most call them."""
    keywords = {argument.flag: argument.name for argument in declared.values()}
    keywords |= {argument.option.short: argument.name for argument in declared.values() if argument.option.short}
    for argument in (each for each in declared.values() if each.is_table):  # [from] of the options file is from_ too
        table = re.escape(f"[{argument.flag.removeprefix('--')}]")
        message = re.sub(rf"(?:{argument.flag} or )?{table}(?: or {argument.flag}\b)?", argument.name, message)
    return re.sub(r"(?<![\w-])--?[a-z][\w-]*", lambda found: keywords.get(found[0], found[0]), message)


def _plain(annotation: Any) -> Any:
    """Return the type of an annotation without its option."""
    kind = get_args(annotation)[0]
    return kind.__forward_arg__ if isinstance(kind, ForwardRef) else kind


def _parameters(declared: Mapping[str, Argument], indent: str) -> str:
    """Return the section of a docstring that documents the options."""
    lines = ["Parameters", "----------"]
    for argument in declared.values():
        optional = "" if argument.required else ", optional"
        default = argument.option.default or str(argument.default or "")
        lines += [f"{argument.name} : {_kind(argument)}{optional}", f"    {argument.described(default)}"]
    return "\n".join(f"{indent}{line}" for line in lines) + "\n\n"


def _kind(argument: Argument) -> str:
    """Return what a value may be, in words."""
    if bool in argument.kinds:
        return "bool"
    words = argument.result_class.split(" | ") if argument.result_class else []
    words += ["path" if argument.is_path else "str"] if str in argument.kinds else []
    words += [kind.__name__ for kind in (int, float) if kind in argument.kinds]
    words += ["mapping"] if Mapping in argument.kinds else []
    words += ["iterable of them"] if Iterable in argument.kinds else []
    return " or ".join(words)


def _checked(argument: Argument, value: Any) -> Any:
    """Return a value, an iterable as a list, a zero as text; refuse one that does not fit."""
    kinds, name = argument.kinds, argument.name
    if type(value) in (int, float) and value == 0 and argument.option.example and not argument.is_path:
        return "0" if str in kinds else value  # zero needs no unit
    # A number is read by what it is for, which refuses what can't be one.
    if argument.is_path and value == "":  # which would be the folder '.'
        raise _of_another_kind(name, value, argument)
    fits = bool({int, float} & kinds) or isinstance(value, tuple(kinds - {Mapping, Iterable}))
    if fits or set(argument.result_class.split(" | ")) & {one.__name__ for one in type(value).__mro__}:
        return value
    if isinstance(value, Mapping) and argument.is_table:
        items = {} if argument.option.by_entry else {f"{name}[{key!r}]": item for key, item in value.items()}
        wanted: tuple[type, ...] = (str,)
    elif Iterable in kinds and isinstance(value, Iterable) and not isinstance(value, bytes | bytearray | Mapping):
        value = list(value)
        items, wanted = {f"{name}[{index}]": item for index, item in enumerate(value)}, (str, os.PathLike)
    else:
        items, wanted = {name: value}, ()
    for place, item in items.items():
        if not isinstance(item, wanted) or (argument.is_path and item == ""):
            raise _of_another_kind(place, item, argument)
    return value


def _of_another_kind(place: str, value: object, argument: Argument) -> InputError:
    if argument.is_path:
        words = "a path"
    elif argument.option.example:
        words = f"text with a unit such as '{argument.option.example}'"
    else:
        words = "text" if str in argument.kinds else "a mapping of names to values"
    return InputError(f"{place}: expected {words}, got {quoted(value)}")
