"""The commands, and the command line as argparse reads it, made of what they declare: grouped help, errors of one line.

A module of `dzdesign.commands` bears a command's name, or a row of `dzdesign.commands.relays`. Such a module has
``Arguments``, a dataclass of `dzdesign.core.options`, ``EXAMPLES``, lines for the help, and ``run(arguments, json)``,
which returns the exit status. `dzdesign --help` imports no command's.
"""

import argparse
import re
import shutil
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, NoReturn

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import GROUPS, AnyPath, Argument, Option, arguments_of
from dzdesign.core.version import __version__

if TYPE_CHECKING:
    from dzdesign.commands.relays import Relay


class Command(NamedTuple):
    """A command of the command line: the heading of `dzdesign --help` under which it stands, and its line there."""

    group: str
    help: str


PIPELINE, EVIDENCE, SETUP = "from ramps to firmware", "evidence", "getting started and diagnostics"

COMMANDS = {
    "init": Command(PIPELINE, "inspect recordings and write a commented dzdesign.toml"),
    "run": Command(PIPELINE, "identify, design, codegen and verify, with the options of one file"),
    "identify": Command(PIPELINE, "fit the valve to its ramp tests: gain, thresholds and beta(dP), in valve.json"),
    "design": Command(PIPELINE, "compute the certified law with exact coefficients, in compensator.json"),
    "codegen": Command(PIPELINE, "write C firmware, or Structured Text, FMUs, a MATLAB function, an amplifier's file"),
    "calibration": Command(PIPELINE, "write one valve's calibration block, or read one back"),
    "verify": Command(PIPELINE, "check a firmware on every input and in closed loop, and write the evidence"),
    "batch": Command(PIPELINE, "calibrate many valves with the options of one file, in one table and one report"),
    "assess": Command(EVIDENCE, "compare ramp tests without and with the compensator, with limits"),
    "report": Command(EVIDENCE, "write report.html from the artefacts in a folder"),
    "derive": Command(EVIDENCE, "derive the paper's equations again: premises, steps and a verdict for each"),
    "reproduce": Command(EVIDENCE, "compute the paper's numbers and figures again, and compare them"),
    "demo": Command(SETUP, "run the whole chain on the bundled example"),
    "simulate": Command(SETUP, "simulate ramp tests of a valve; the files are marked as simulated"),
    "monitor": Command(SETUP, "record the telemetry of a running firmware as a ramp file"),
    "load": Command(SETUP, "load a calibration block into an amplifier over its serial line"),
    "explain": Command(SETUP, "explain a warning or a requirement by its code"),
    "doctor": Command(SETUP, "list compilers and simulators, and how to install what is missing"),
}
#: Of the front page.
EXAMPLES = (
    "dzdesign demo demo                       run the whole chain on the bundled example",
    "dzdesign init ramps/*.csv                inspect recordings and write dzdesign.toml",
    "dzdesign run dzdesign.toml               from the recordings to checked firmware and a report",
)


#: The widest that help is set, in columns: longer lines are hard to read.
WIDEST = 100
ABOUT = "Dead-zone compensators for proportional valves without a spool sensor: from ramp tests to checked C."
EXIT_STATUS = """exit status:
  0    every requirement holds
  1    a requirement does not hold, or could not be checked; the message says which
  2    bad input or usage
  130  interrupted"""


@dataclass(frozen=True, kw_only=True)
class CommonArguments:
    """Options of every command, before it or after it."""

    config: Annotated[AnyPath, Option("TOML")] = ""
    """File with options of the same names. `dzdesign init` writes one."""
    json: Annotated[bool, Option()] = False
    """Print the result as JSON."""
    quiet: Annotated[bool, Option(short="-q")] = False
    """Print results and errors only."""
    verbose: Annotated[bool, Option(short="-v")] = False
    """Log times, files and the solver's output."""


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

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage."""
        raise InputError(f"{message}; see `{self.prog} --help`")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print help or version; an output that is full is an error here, which argparse keeps to itself."""
        print(message, end="", file=file or sys.stdout, flush=True)


class FrontParser(Parser):
    """The parser of `dzdesign` itself, whose help has the commands in groups."""

    commands: "argparse._SubParsersAction[Parser]"

    def format_help(self) -> str:
        """Return the help."""
        page = self._get_formatter()
        page.add_text("usage: dzdesign COMMAND [OPTIONS]")
        page.add_text(self.description)
        commands = {action.dest: action for action in self.commands._choices_actions}
        for group in dict.fromkeys(command.group for command in COMMANDS.values()):
            page.start_section(group)
            page.add_arguments([commands[name] for name, command in COMMANDS.items() if command.group == group])
            page.end_section()
        page.start_section("options")
        page.add_arguments(self._optionals._group_actions)
        page.end_section()
        for text in (_lines("examples", EXAMPLES), EXIT_STATUS, "`dzdesign COMMAND --help` explains each command."):
            page.add_text(text)
        page.add_text(f"Documentation: index.html in dzdesign-{__version__}-docs.zip, beside the wheel.")
        return page.format_help()


@cache
def command_module(name: str) -> "ModuleType | Relay":
    """Return what has a command's ``Arguments``, ``EXAMPLES`` and ``run``: its module, or its row of the relays."""
    from dzdesign.commands.relays import RELAYS

    if name in RELAYS:
        return RELAYS[name]
    return import_module(f"dzdesign.commands.{name}")


def arguments_of_command(name: str) -> tuple[Argument, ...]:
    """Return what a command takes on the command line; see `in_file`."""
    declared = arguments_of(command_module(name).Arguments)
    return tuple(argument for argument in declared if argument not in in_file(name))


def in_file(name: str) -> tuple[Argument, ...]:
    """Return what a command takes from the options file alone: what its arguments inherit from classes ``IN_FILE``."""
    declaration = command_module(name).Arguments
    inherited = {key for each in getattr(declaration, "IN_FILE", ()) for key in each.__dataclass_fields__}
    inherited -= declaration.__annotations__.keys()
    return tuple(argument for argument in arguments_of(declaration) if argument.name in inherited)


def build_parser(only: str | None = None) -> tuple[Parser, dict[str, Parser]]:
    """Return the parser and those of its commands; with `only` no other command's module is imported."""
    parser = FrontParser(prog="dzdesign", description=ABOUT, formatter_class=HelpFormatter, add_help=False)
    parser.add_argument("-h", "--help", action="help", help="Show this page and exit.")
    parser.add_argument("--version", action="version", version=f"dzdesign {__version__}", help="Print the version.")
    for argument in arguments_of(CommonArguments):
        _add_option(parser, argument)
    parser.commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    commands = {}
    for name, command in COMMANDS.items():
        wanted = only in (None, name)
        arguments = arguments_of_command(name) if wanted else ()
        commands[name] = parser.commands.add_parser(
            name,
            help=command.help,
            description=f"{command.help[0].upper()}{command.help[1:]}.",
            epilog=_lines("examples", command_module(name).EXAMPLES) if wanted else None,
            usage=usage_of(name, arguments),
            formatter_class=HelpFormatter,
            add_help=False,
        )
        if wanted:
            _add_options(commands[name], arguments)
    return parser, commands


def usage_of(name: str, arguments: Iterable[Argument]) -> str:
    """Return a command with the words that it must or may be given; options are listed below it, in groups."""
    words = [f"dzdesign {name}"]
    for argument in arguments:
        word = argument.option.metavar + (" ..." if argument.is_repeatable else "")
        if argument.is_positional:
            words.append(word if argument.required else f"[{word}]")
        elif argument.required:
            words.append(f"{argument.flag} {word}")
    return " ".join([*words, "[OPTIONS]"])


def _lines(heading: str, lines: tuple[str, ...]) -> str:
    return "\n  ".join((f"{heading}:", *lines))


def _add_options(command: Parser, arguments: tuple[Argument, ...]) -> None:
    """Add a command's options in their groups, the common ones last."""
    command._positionals.title = "arguments"
    used = [group for group in GROUPS if any(argument.option.group == group for argument in arguments)]
    groups = {group: command.add_argument_group(group) for group in used}
    for argument in arguments:
        _add_option(groups.get(argument.option.group, command), argument)
    common = command.add_argument_group("options of every command")
    for argument in arguments_of(CommonArguments):
        _add_option(common, argument)
    common.add_argument("-h", "--help", action="help", help="Show this help and exit.")


def _add_option(place: argparse._ActionsContainer, argument: Argument) -> None:
    """Add an option, without a default: what was given is told from what was not, and what stands before stays."""
    option, text = argument.option, argument.described(argument.default_text).replace("%", "%%")
    names = [name for name in (option.short, argument.flag) if name]
    nargs = None
    if argument.by_position and argument.is_repeatable:
        nargs = "+" if argument.required else "*"
    if bool in argument.kinds:
        place.add_argument(*names, action="store_true", default=argparse.SUPPRESS, help=text)
    elif argument.is_positional:
        nargs = nargs or (None if argument.required else "?")
        place.add_argument(argument.name, nargs=nargs, default=argparse.SUPPRESS, metavar=option.metavar, help=text)
    else:
        action = "append" if argument.is_repeatable and nargs is None else "store"
        if option.several:
            action, nargs = "extend", "+"
        place.add_argument(
            *names, action=action, nargs=nargs, required=argument.required, default=argparse.SUPPRESS,
            metavar=option.metavar, help=text, dest=argument.name,
        )  # fmt: skip


def is_unknown_option(word: str, parsers: Iterable[Parser]) -> bool:
    """Tell whether a word looks like an option, and none of the parsers has one that begins so."""
    name = word.partition("=")[0]
    known = [option for parser in parsers for option in parser._option_string_actions]
    return bool(re.match(r"--?[A-Za-z]", word)) and not any(each.startswith(name) for each in known)


def unknown_words(words: list[str], command: Parser) -> InputError:
    """Return the error for words that are no option of a command: the nearest that is one, or whose option it is."""
    wrong = next((word for word in words if word.startswith("-")), words[0]).partition("=")[0]
    if not wrong.startswith("-"):
        return InputError(f"'{wrong}' is one word too many; see `{command.prog} --help`")
    name = command.prog.rpartition(" ")[2]
    if name in COMMANDS and any(wrong == each.flag for each in in_file(name)):
        return InputError(f"`{command.prog}` takes {wrong} from the file of --config; write it there, for every valve")
    hint = nearest(wrong, command._option_string_actions)
    owners = [other for other in COMMANDS if any(wrong == each.flag for each in arguments_of_command(other))]
    if owners:
        hint = f" (it is an option of `dzdesign {'`, `'.join(owners)}`)"
    return InputError(f"`{command.prog}` has no option {wrong}{hint}; see `{command.prog} --help`")
