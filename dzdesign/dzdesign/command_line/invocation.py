"""What the user asked for: the command line, with an options file in TOML behind it, as a command's arguments."""

import datetime
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.command_line.parser import (
    COMMANDS,
    arguments_of_command,
    build_parser,
    command_module,
    is_unknown_option,
    unknown_words,
)
from dzdesign.core.documents import read_bytes, read_toml
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.options import BOARD, MACHINE, AnyPath, Argument, arguments_of, flag_of
from dzdesign.terminal.progress import say

#: Characters of a key to which the nearest known one is looked for.
LONGEST_KEY = 80
#: Groups of options that stand in a table of their own.
TABLES = (MACHINE, BOARD)
#: The table of any names, for people.
RECORD = "record"
#: Entries of it that `init` proposes, though other commands have options of these names.
PROPOSED = ("serial", "oil")
#: Of an option in the file: text, a list of texts, or a table.
Value = str | list[str] | dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Invocation:
    """One call of the command line; `arguments` are of the command's class ``Arguments``."""

    command: str
    arguments: Any
    json: bool
    quiet: bool
    verbose: bool
    #: Of --config, empty if none was given; and the options whose value is that of the file.
    options_file: str
    from_file: dict[str, Value]


def parse(argv: list[str]) -> Invocation:
    """Parse a command line; what an options file says stands in for the defaults."""
    word = _command_in(argv)
    if word and word not in COMMANDS:
        raise InputError(f"there is no command '{word}'{nearest(word, COMMANDS)}; see `dzdesign --help`")
    parser, commands = build_parser(only=word or "")
    words = _with_signed_values(argv)
    try:
        namespace, unknown = parser.parse_known_args(words)
    except InputError:  # what else is missing matters less than an option that does not exist
        known = commands[word] if word else parser
        if strange := [each for each in words if is_unknown_option(each, (parser, known))]:
            raise unknown_words(strange, known) from None
        raise
    given = vars(namespace)
    name = given.pop("command")
    if unknown:
        raise unknown_words(unknown, commands[name])
    json, quiet, verbose = (given.pop(key, False) for key in ("json", "quiet", "verbose"))
    if quiet and verbose:
        raise InputError("--quiet and --verbose contradict each other; give one of them")
    declared, options_file = arguments_of(command_module(name).Arguments), given.pop("config", None)
    from_file = completed(name, declared, given, options_file) if options_file is not None else {}
    for argument in declared:
        key = argument.name
        if argument.option.by_entry and isinstance(given.get(key), list):
            given[key] = merged_entries(argument.flag, None, given[key])
        elif key not in given and argument.option.command_default:
            given[key] = argument.option.command_default
        if argument.is_path:
            _refuse_empty(argument, given.get(key), options_file if key in from_file else "")
    return Invocation(
        command=name, arguments=command_module(name).Arguments(**given), json=json, quiet=quiet, verbose=verbose,
        options_file=options_file or "", from_file=from_file,
    )  # fmt: skip


def completed(
    command: str, declared: tuple[Argument, ...], given: dict[str, Any], options_file: AnyPath
) -> dict[str, Value]:
    """Put what an options file says behind the options that were given; return those whose value is that of the file.

    A given table of columns, or of entries of the record, stands on top of the file's, entry by entry.
    """
    path = os.fspath(options_file)
    if not path:
        raise InputError("--config is empty, expected the name of a file")
    values = _meant_values(command, path, declared)
    from_file = {key: value for key, value in values.items() if key not in given}
    for argument in (each for each in declared if each.name in values):
        key, value = argument.name, values[argument.name]
        if argument.option.by_entry:
            entries = given.get(key, [])
            texts = [f"{name} = {text}" for name, text in entries.items()] if isinstance(entries, Mapping) else entries
            given[key] = merged_entries(argument.flag, value, texts)
        elif key == "columns" and key in given:
            given[key] = merged_columns(path, value, given[key])
        elif key in from_file:
            given[key] = [value] if argument.is_repeatable and isinstance(value, str) else value
    return from_file


def _with_signed_values(argv: Sequence[str]) -> list[str]:
    """Return the words with a value such as ``-10..10V`` tied to its option, which argparse takes for an option."""
    words: list[str] = []
    for word in argv:
        if words and re.fullmatch(r"--[a-z][^=]*", words[-1]) and re.match(r"-\.?\d", word):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _refuse_empty(argument: Argument, value: Value | None, options_file: str) -> None:
    """Refuse a path without a letter, such as of a shell's variable that is not set: it would be the folder '.'."""
    if "" in (value if isinstance(value, list) else [value]):
        name = argument.option.metavar if argument.is_positional else argument.flag
        where = f"'{options_file}': {name.removeprefix('--')}" if options_file else name
        raise InputError(f"{where} is empty, expected the name of a file or folder")


def _command_in(argv: list[str]) -> str | None:
    """Return the first word that is neither an option nor the file that --config names."""
    before = ""
    for word in argv:
        if before != "--config" and not (word.startswith("-") and len(word) > 1):
            return word
        before = word
    return None


def _meant_values(command: str, path: str, declared: tuple[Argument, ...]) -> dict[str, Value]:
    """Return the options of a file that are for a command; the file may have those of every command."""
    every = [argument for name in COMMANDS for argument in arguments_of_command(name)]
    named = [argument for argument in every if not argument.is_positional and bool not in argument.kinds]
    values = options_from_file(path, named)
    own = {argument.name: argument for argument in declared if argument in named}
    for name in getattr(command_module(command).Arguments, "ONE_VALVE", ()):
        if name in values:
            raise InputError(
                f"'{path}': {flag_of(name).removeprefix('--')} is of one valve, and {command} has no such option; "
                "take it out, and identify that valve by itself"
            )
    return {key: value for key, value in values.items() if key in own and _is_meant(value, own[key])}


def _is_meant(value: Value, argument: Argument) -> bool:
    """Tell whether a value of the file is for this command: `dp` is a list for simulate, a table for identify."""
    return argument.is_table if isinstance(value, dict) else argument.is_repeatable or isinstance(value, str)


def merged_columns(path: str, of_file: Value, given: str | Mapping[str, str]) -> dict[str, str]:
    """Return the columns of the command line on top of those of the options file; pressures replace all pressures."""
    from dzdesign.identify.reading.column_labels import PRESSURES, parse_columns

    named = parse_columns(given)
    try:
        kept = parse_columns(of_file if isinstance(of_file, dict) else str(of_file))
    except InputError as error:
        raise InputError(f"'{path}': {error}") from error
    if any(quantity in PRESSURES for quantity in named):
        kept = {quantity: label for quantity, label in kept.items() if quantity not in PRESSURES}
    return kept | named


def merged_entries(flag: str, value: Value | None, entries: list[str]) -> dict[str, str]:
    """Return entries of the command line, ``name = text``, each name once, on top of those of the options file."""
    from dzdesign.identify.valve.test_record import checked_record

    table = checked_record(value.items(), "the record") if isinstance(value, dict) else {}
    texts = [value] if isinstance(value, str) else value if isinstance(value, list) else []
    pairs = []
    for text in (*texts, *entries):
        name, equals, entry = text.partition("=")
        if not equals:
            raise InputError(f'{flag} is {quoted(text)}, expected a name and a text such as "serial = 4711"')
        pairs.append((name.strip(), entry.strip()))
    return checked_record((table | checked_record(pairs, flag)).items(), "the record")


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
