"""What the user asked for: the command line, with an options file behind it, as a command's arguments."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dzdesign.command_line.options_file import Value, options_from_file
from dzdesign.command_line.parser import (
    COMMANDS,
    arguments_of_command,
    build_parser,
    command_module,
    is_unknown_option,
    unknown_words,
)
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.options import Argument, arguments_of, flag_of


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
    declared, options_file = arguments_of(command_module(name).Arguments), given.pop("config", "")
    values = _meant_values(name, options_file, declared) if options_file else {}
    from_file = {key: value for key, value in values.items() if key not in given}
    for argument in declared:
        key = argument.name
        if argument.option.by_entry and (key in given or key in values):
            given[key] = merged_entries(argument.flag, values.get(key), given.get(key, []))
        elif key == "columns" and key in given and key in values:
            given[key] = merged_columns(options_file, values[key], given[key])
        elif key in from_file:
            value = values[key]
            given[key] = [value] if argument.is_repeatable and isinstance(value, str) else value
        elif key not in given and argument.option.command_default:
            given[key] = argument.option.command_default
        if argument.is_path:
            _refuse_empty(argument, given.get(key), options_file if key in from_file else "")
    return Invocation(
        command=name, arguments=command_module(name).Arguments(**given), json=json, quiet=quiet, verbose=verbose,
        options_file=options_file, from_file=from_file,
    )  # fmt: skip


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
    for name in getattr(command_module(command), "ONE_VALVE", ()):
        if name in values:
            raise InputError(
                f"'{path}': {flag_of(name).removeprefix('--')} is of one valve, and {command} has no such option; "
                "take it out, and identify that valve by itself"
            )
    return {key: value for key, value in values.items() if key in own and _is_meant(value, own[key])}


def _is_meant(value: Value, argument: Argument) -> bool:
    """Tell whether a value of the file is for this command: `dp` is a list for simulate, a table for identify."""
    return argument.is_table if isinstance(value, dict) else argument.is_repeatable or isinstance(value, str)


def merged_columns(path: str, of_file: Value, given: str) -> dict[str, str]:
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
