"""The command line as argparse reads it, made of what the commands declare: help in groups, errors of one line."""

import argparse
import shutil
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from types import ModuleType

from dzdesign.command_line.command_table import COMMANDS, EXAMPLES
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import GROUPS, Argument, arguments_of
from dzdesign.core.version import __version__

#: The widest that help is set, in columns: longer lines are hard to read.
WIDEST = 100
ABOUT = "Dead-zone compensators for proportional valves without a spool sensor: from ramp tests to checked C."
EXIT_STATUS = """exit status:
  0    every requirement holds
  1    a requirement does not hold, or could not be checked; the message says which
  2    bad input or usage
  130  interrupted"""
#: Options of every command, before it or after it: (spellings, keywords of add_argument).
COMMON = (
    (("--config",), {"metavar": "TOML", "help": "File with options of the same names; dzdesign init writes one."}),
    (("--json",), {"action": "store_true", "help": "Print the result as JSON."}),
    (("-q", "--quiet"), {"action": "store_true", "help": "Print results and errors only."}),
    (("-v", "--verbose"), {"action": "store_true", "help": "Log the work with times, files and the solver's output."}),
)


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Help as wide as the terminal, or as COLUMNS says, but no wider than can be read."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26, width=min(shutil.get_terminal_size().columns - 2, WIDEST))

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

    def error(self, message: str) -> None:
        """Raise instead of printing the usage."""
        raise InputError(f"{message}; see `{self.prog} --help`")


class FrontParser(Parser):
    """The parser of `dzdesign` itself, whose help has the commands in groups."""

    def format_help(self) -> str:
        """Return the help."""
        page = self._get_formatter()
        page.add_text("usage: dzdesign COMMAND [OPTIONS]")
        page.add_text(self.description)
        commands = {action.dest: action for action in self._subparsers._group_actions[0]._choices_actions}
        for group in dict.fromkeys(command.group for command in COMMANDS.values()):
            page.start_section(group)
            page.add_arguments([commands[name] for name, command in COMMANDS.items() if command.group == group])
            page.end_section()
        page.start_section("options")
        page.add_arguments(self._optionals._group_actions)
        page.end_section()
        for text in (_lines("examples", EXAMPLES), EXIT_STATUS, "`dzdesign COMMAND --help` explains each command."):
            page.add_text(text)
        return page.format_help()


@cache
def command_module(name: str) -> ModuleType:
    """Return the module that has a command's ``Arguments``, ``EXAMPLES`` and ``run``."""
    return import_module(COMMANDS[name].module)


def arguments_of_command(name: str) -> tuple[Argument, ...]:
    """Return what a command takes."""
    return arguments_of(command_module(name).Arguments)


def build_parser(only: str | None = None) -> tuple[Parser, dict[str, Parser]]:
    """Return the parser and those of its commands.

    Parameters
    ----------
    only : str, optional
        The one command whose options are wanted: the others' modules are not imported. None: all of them.
    """
    parser = FrontParser(prog="dzdesign", description=ABOUT, formatter_class=HelpFormatter, add_help=False)
    parser.add_argument("-h", "--help", action="help", help="Show this page and exit.")
    parser.add_argument("--version", action="version", version=f"dzdesign {__version__}", help="Print the version.")
    for names, keywords in COMMON:
        parser.add_argument(*names, default=argparse.SUPPRESS, **keywords)
    choices = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    commands = {}
    for name, command in COMMANDS.items():
        keywords = {"formatter_class": HelpFormatter, "add_help": False, "help": command.help}
        if only in (None, name):
            arguments = arguments_of_command(name)
            commands[name] = choices.add_parser(
                name,
                description=f"{command.help[0].upper()}{command.help[1:]}.",
                epilog=_lines("examples", command_module(name).EXAMPLES),
                usage=" ".join([f"dzdesign {name}", *filter(None, map(_usage, arguments)), "[OPTIONS]"]),
                **keywords,
            )
            _add_options(commands[name], arguments)
        else:
            commands[name] = choices.add_parser(name, **keywords)
    return parser, commands


def _usage(argument: Argument) -> str:
    """Return an argument in the usage line; options that may be left out are listed below it, in groups."""
    if not argument.is_positional and not argument.required:
        return ""
    word = argument.option.metavar + (" ..." if argument.is_repeatable else "")
    word = word if argument.is_positional else f"{argument.flag} {word}"
    return word if argument.required else f"[{word}]"


def _lines(heading: str, lines: tuple[str, ...]) -> str:
    return "\n  ".join((f"{heading}:", *lines))


def _add_options(command: Parser, arguments: tuple[Argument, ...]) -> None:
    """Add a command's options in their groups, the common ones last."""
    command._positionals.title = "arguments"
    used = [group for group in GROUPS if any(argument.option.group == group for argument in arguments)]
    groups: Mapping[str, argparse._ActionsContainer] = {group: command.add_argument_group(group) for group in used}
    for argument in arguments:
        names = [argument.name] if argument.is_positional else [argument.option.short, argument.flag]
        place = groups.get(argument.option.group, command)
        place.add_argument(*filter(None, names), default=argparse.SUPPRESS, **_keywords(argument))
    common = command.add_argument_group("options of every command")
    for names, keywords in COMMON:
        common.add_argument(*names, default=argparse.SUPPRESS, **keywords)  # what stands before the command stays
    common.add_argument("-h", "--help", action="help", help="Show this help and exit.")


def _keywords(argument: Argument) -> dict[str, object]:
    """Return the keywords of `add_argument`."""
    keywords: dict[str, object] = {"help": help_of(argument).replace("%", "%%")}
    if bool in argument.kinds:
        return {**keywords, "action": "store_true"}
    keywords["metavar"] = argument.option.metavar
    if argument.by_position and argument.is_repeatable:
        keywords["nargs"] = "+" if argument.required else "*"
    elif argument.is_positional:
        keywords["nargs"] = None if argument.required else "?"
    elif argument.is_repeatable:
        keywords["action"] = "append"
    if not argument.is_positional and argument.required:
        keywords["required"] = True
    return keywords


def help_of(argument: Argument) -> str:
    """Return the help of an option, with its default.

    Parameters
    ----------
    argument : Argument
        As a command declares it.
    """
    default = argument.default_text
    return f"{argument.option.help.removesuffix('.')} (default: {default})." if default else argument.option.help


def unknown_words(words: list[str], name: str, command: Parser) -> InputError:
    """Return the error for words that are no option of a command: the nearest that is one, or whose option it is.

    Parameters
    ----------
    words : list of str
        That argparse left over.
    name : str
        Of the command.
    command : Parser
        Of the command.
    """
    wrong = next((word for word in words if word.startswith("-")), words[0]).partition("=")[0]
    if not wrong.startswith("-"):
        return InputError(f"'{wrong}' is one word too many; see `{command.prog} --help`")
    hint = nearest(wrong, command._option_string_actions)
    owners = (other for other in COMMANDS if any(wrong == each.flag for each in arguments_of_command(other)))
    if owner := next(owners, None):
        hint = f" (it is an option of `dzdesign {owner}`)"
    return InputError(f"`dzdesign {name}` has no option {wrong}{hint}; see `{command.prog} --help`")
