"""Options in a TOML file: the names of the command line, one file for all commands."""

import datetime
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from dzdesign.core.documents import read_bytes, read_toml
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.options import MACHINE, Argument, flag_of
from dzdesign.terminal.progress import say

#: Characters of a key to which the nearest known one is looked for.
LONGEST_KEY = 80
#: Groups of options that stand in a table of their own.
TABLES = (MACHINE,)
#: The table of any names, for people.
RECORD = "record"
#: Entries of it that `init` proposes, though other commands have options of these names.
PROPOSED = ("serial", "oil")
#: Of an option in the file: text, a list of texts, or a table.
Value = str | list[str] | dict[str, str]


def options_from_file(path: str, declared: Iterable[Argument]) -> dict[str, Value]:
    """Read options; a key may be written ``meter-floor`` or ``meter_floor``, values as on the command line."""
    content = read_bytes(Path(path), "config file")
    # A number with a point stays the text that it is: an oil of viscosity 46.10 stays one.
    document = read_toml(content, path, 'lines such as u-max = "10 V"', lambda number: number.replace("_", ""))
    known: dict[str, list[Argument]] = {}
    for argument in declared:
        known.setdefault(_key(argument.name).replace("-", "_"), []).append(argument)
    options: dict[str, Value] = {}
    for key, value in _without_tables(path, document, known):
        name = key.replace("-", "_")
        if name not in known:
            hint = nearest(name[:LONGEST_KEY], known).replace("_", "-")
            raise InputError(f"'{path}': there is no option {quoted(key)}{hint}; see `dzdesign COMMAND --help`")
        argument_name = known[name][0].name
        if argument_name in options:
            raise InputError(f"'{path}': option '{key}' is given twice, with - and with _; keep one")
        free = any(argument.option.by_entry for argument in known[name])  # text for people: dates may stand there
        if isinstance(value, dict):
            _refuse_options_in(path, key, value, known)
        if not (free and value == {}):
            options[argument_name] = _texts(path, key, value, known[name], free)
    return options


def _without_tables(
    path: str, document: Mapping[str, object], known: Mapping[str, list[Argument]]
) -> Iterator[tuple[str, object]]:
    """Yield the options and, of the table of a group, those in it: they stand nowhere else."""

    def table_of(key: str) -> str:
        group = known[name][0].option.group if (name := key.replace("-", "_")) in known else ""
        return group if group in TABLES else ""

    for key, value in document.items():
        if key not in TABLES:
            if table := table_of(key):
                raise InputError(f"'{path}': option '{key}' belongs in the table [{table}]; move it there")
            yield key, value
            continue
        if not isinstance(value, dict):
            raise InputError(f"'{path}': '{key}' is {quoted(value)}, expected a table [{key}]")
        for inner, text in value.items():
            if inner.replace("-", "_") in known and table_of(inner) != key:
                raise InputError(f"'{path}': option '{inner}' does not belong in [{key}]; move it above all tables")
            yield inner, text


def _refuse_options_in(path: str, table: str, entries: Mapping[str, object], known: Mapping[str, object]) -> None:
    """Refuse an option that was added at the end of the file, below a table of any names: TOML gives it to the table.

    In the record a word that people use too, such as order or target, may be an entry; it is said that it is one.
    """
    for name in (name for name in entries if name.replace("-", "_") in known):
        where = f"'{path}': '{name}' stands in the table [{table}], which goes on to the next table or the end"
        if table == RECORD and "-" not in name and "_" not in name:
            if name not in PROPOSED:
                say(f"{where}, so it is an entry and no option")
            continue
        raise InputError(f"{where}; the option belongs above all tables, move it there")


def _key(name: str) -> str:
    """Return how the file writes an option: as the command line does."""
    return flag_of(name).removeprefix("--")


def _texts(path: str, key: str, value: object, declared: list[Argument], free: bool) -> Value:
    """Return a value as text, or as the list or table of texts that it may be."""
    items: list[object] = [value]
    if isinstance(value, list) and any(argument.is_repeatable for argument in declared):
        items = value
    elif isinstance(value, dict) and any(argument.is_table for argument in declared):
        items = list(value.values())
    if not items or not all(_is_text(item, free) for item in items):
        raise InputError(f"'{path}': option '{key}' is {quoted(value)}, expected text such as \"1 MPa\" or a number")
    if isinstance(value, dict):
        return {name: str(item) for name, item in value.items()}
    return [str(item) for item in items] if isinstance(value, list) else str(value)


def _is_text(item: object, free: bool) -> bool:
    """Tell whether an item is text, or a number (or a date) that is short enough to be written as text."""
    if isinstance(item, int) and (isinstance(item, bool) or item.bit_length() > 64):
        return False
    return isinstance(item, str | int) or (free and isinstance(item, datetime.date | datetime.time))


def in_words_of_the_file(message: str, path: str, values: Mapping[str, Value]) -> str:
    """Return a message about an option as one about the line of the file where it stands; any other as it is.

    Examples
    --------
    >>> in_words_of_the_file("--u-max is '10' without a unit; write for example '10 V'", "dz.toml", {"u_max": "10"})
    '\'dz.toml\': u-max is \'10\' without a unit; write for example u-max = "10 V"'
    """
    for name, value in values.items():
        key = _key(name)
        if re.match(rf"--{re.escape(key)}(?= |:)", message):
            words = message.removeprefix("--") if isinstance(value, str) else message  # a table's lines are its own
            if isinstance(value, str) and words.startswith(f"{key} is '{value}'"):  # not of a part of it
                words = re.sub(r"(write for example|such as) '([^']*)'$", rf'\1 {key} = "\2"', words)
            return f"'{path}': {words}"
    return message
