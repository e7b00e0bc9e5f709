"""The words of a command line: help in groups with examples, and errors of one line that name the nearest word."""

import argparse
from collections import namedtuple
from collections.abc import Mapping

from dzdesign.command_line.front_page import ABOUT, COMMON, front_page, page_width
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.version import __version__

#: All that can be said, as `command_spec` declares it. No dataclass: to import those takes longer than to parse.
#:
#: commands: command -> (one line of help, function that runs it, its options)
#: command_groups: heading -> commands under it; one that is nowhere stands under the last
#: option_groups: heading -> options under it
#: examples: command -> lines; "" for dzdesign itself
#: tables: options that may be a table in the TOML file
#: by_entry: of them those that are given an entry at a time, which goes before the file's of the same name
Language = namedtuple("Language", "commands command_groups option_groups examples tables by_entry")


class _Help(argparse.RawDescriptionHelpFormatter):
    """Help as wide as the terminal, or as COLUMNS says, but no wider than can be read."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26, width=page_width())

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        """Wrap what is one line, and leave alone what has lines of its own: examples."""
        fill = argparse.RawDescriptionHelpFormatter if "\n" in text else argparse.HelpFormatter
        return fill._fill_text(self, text, width, indent)

    def _format_action_invocation(self, action: argparse.Action) -> str:
        """Return ``-o, --output FILE``, not ``-o FILE, --output FILE``."""
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        return f"{', '.join(action.option_strings)} {self._format_args(action, action.dest.upper())}"


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, as every other error."""

    #: The help, where argparse does not make it.
    page = ""

    def error(self, message: str) -> None:
        """Raise instead of printing the usage."""
        raise InputError(f"{message}; see `{self.prog} --help`")

    def format_help(self) -> str:
        """Return the help: that of `dzdesign` itself is a page of its own."""
        return self.page or super().format_help()


def build_parser(language: Language, only: str | None = None) -> tuple[Parser, dict[str, Parser]]:
    """Return the parser and those of its commands.

    Parameters
    ----------
    language : Language
        All that can be said.
    only : str, optional
        The one command whose options are wanted: the others' would cost half of the start. None: all of them.
    """
    parser = Parser(prog="dzdesign", description=ABOUT)
    parser.page = front_page(language.commands, language.command_groups, language.examples[""])
    parser.add_argument("--version", action="version", version=f"dzdesign {__version__}", help="print the version")
    for names, keywords in COMMON:
        parser.add_argument(*names, **keywords)
    choices = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    commands = {}
    for name, (help_line, run, options) in language.commands.items():
        command = choices.add_parser(
            name,
            help=help_line,
            formatter_class=_Help,
            description=f"{help_line[0].upper() if help_line.split()[0].isalpha() else help_line[0]}{help_line[1:]}.",
            epilog=_examples(language.examples.get(name, ())),
            add_help=False,
            usage=_usage(name, options),
        )
        if only in (None, name):
            _add_options(command, options, language.option_groups)
            command.set_defaults(run=run)
        commands[name] = command
    return parser, commands


def _usage(name: str, options: tuple) -> str:
    """Return a command with the words that it takes; its options are listed below it, in groups."""
    words = []
    for names, keywords in options:
        if names[0][0] != "-" or keywords.get("required"):
            flag = f"{names[0]} " if names[0][0] == "-" else ""
            word = flag + keywords["metavar"] + (" ..." if keywords.get("nargs") in ("+", "*") else "")
            words.append(f"[{word}]" if keywords.get("nargs") in ("?", "*") else word)
    return " ".join([f"dzdesign {name}", *words, "[OPTIONS]"])


def _examples(lines: tuple[str, ...]) -> str | None:
    return "\n  ".join(("examples:" if len(lines) > 1 else "example:", *lines)) if lines else None


def _add_options(command: Parser, options: tuple, headings: Mapping[str, tuple[str, ...]]) -> None:
    """Add a command's options in their groups, the common ones last."""
    group_of = {name: heading for heading, names in headings.items() for name in names}
    suppressed = {"default": argparse.SUPPRESS}  # what stands before the command is not undone
    every = [
        *options,
        *((names, {**keywords, **suppressed}) for names, keywords in COMMON),
        (("-h", "--help"), {"action": "help", "help": "show this help and exit"}),
    ]
    command._positionals.title = "arguments"
    groups: dict[str, argparse._ArgumentGroup] = {}
    for heading in headings:
        if any(group_of.get(names[-1]) == heading for names, _ in every):
            groups[heading] = command.add_argument_group(heading)
    for names, keywords in every:
        groups.get(group_of.get(names[-1], ""), command).add_argument(*names, **keywords)


def parse(argv: list[str], language: Language) -> argparse.Namespace:
    """Parse a command line; what a TOML file says stands in for the defaults.

    Parameters
    ----------
    argv : list of str
        Without the program's name.
    language : Language
        All that can be said.

    Raises
    ------
    InputError
        If the command line is wrong, or the file can't be read or names no option.
    """
    word = _command_in(argv)
    if word and word not in language.commands:
        raise InputError(f"there is no command '{word}'{nearest(word, language.commands)}; see `dzdesign --help`")
    parser, commands = build_parser(language, only=word or "")
    args = _parsed(parser, commands, argv, language)
    if args.quiet and args.verbose:
        raise InputError("--quiet and --verbose contradict each other; give one of them")
    if not args.config:
        return args
    from dzdesign.command_line.toml_options import options_from_file

    declared = [option for _, _, options in language.commands.values() for option in options]
    repeatable = {_dest(names) for names, keywords in declared if keywords.get("action") == "append"}
    known = {
        _dest(names) for names, keywords in declared if names[0][0] == "-" and keywords.get("action") != "store_true"
    }
    command = commands[args.command]
    mine = {action.dest: isinstance(action, argparse._AppendAction) for action in command._actions}
    values = options_from_file(args.config, known, repeatable, language.tables, language.by_entry)
    values = {
        key: value
        for key, value in values.items()
        if key in mine and (key in language.by_entry or _is_meant(value, mine[key]))
    }
    command.set_defaults(**{key: value for key, value in values.items() if not mine[key]})
    given, args = args, _parsed(parser, commands, argv, language)
    for key, value in values.items():
        if key in language.by_entry:
            setattr(args, key, [*(value if isinstance(value, list) else [value]), *(getattr(given, key) or [])])
        elif mine[key]:  # argparse would add to a default instead of standing in for it
            setattr(args, key, getattr(given, key) or ([value] if isinstance(value, str) else value))
    args.from_file = {key: value for key, value in values.items() if getattr(args, key) == value}
    return args


def _command_in(argv: list[str]) -> str | None:
    """Return the first word that is neither an option nor the file that --config names."""
    before = ""
    for word in argv:
        if before != "--config" and not (word.startswith("-") and len(word) > 1):
            return word
        before = word
    return None


def _dest(names: tuple[str, ...]) -> str:
    """Return the key under which argparse keeps an option, and a TOML file names it."""
    return next((name for name in names if name.startswith("--")), names[0]).lstrip("-").replace("-", "_")


def _parsed(parser: Parser, commands: Mapping[str, Parser], argv: list[str], language: Language) -> argparse.Namespace:
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        raise _unknown(unknown, commands[args.command], language)
    return args


def _unknown(words: list[str], command: Parser, language: Language) -> InputError:
    """Return the error for words that are no option of a command: the nearest that is, or whose option it is."""
    wrong = next((word for word in words if word.startswith("-")), words[0]).partition("=")[0]
    if not wrong.startswith("-"):
        return InputError(f"'{wrong}' is one word too many; see `{command.prog} --help`")
    hint = nearest(wrong, command._option_string_actions)
    owners = [
        name for name, (_, _, options) in language.commands.items() if any(wrong in names for names, _ in options)
    ]
    if owners:
        hint = f" (it is one of `dzdesign {owners[0]}`)"
    return InputError(f"{command.prog} has no option {wrong}{hint}; see `{command.prog} --help`")


def _is_meant(value: str | list[str] | dict[str, str], repeatable: bool) -> bool:
    """Tell whether a value of the file is for this command: `dp` is a list for simulate, a table for identify."""
    return not isinstance(value, dict if repeatable else list)
