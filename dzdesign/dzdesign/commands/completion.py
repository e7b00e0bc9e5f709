"""`dzdesign completion SHELL`: the script by which a shell completes commands, options, targets and files, by shtab."""

import argparse
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Annotated

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.options import Option

EXAMPLES = (
    'eval "$(dzdesign completion bash)"                       # in ~/.bashrc',
    "dzdesign completion zsh > ~/.zfunc/_dzdesign             # a folder of fpath",
    "dzdesign completion fish > ~/.config/fish/completions/dzdesign.fish",
    "dzdesign completion powershell | Out-String | Invoke-Expression   # in $PROFILE",
)
#: Where shtab looks for what a value completes to.
COMPLETE = "complete"


@dataclass(frozen=True)
class Arguments:
    """Arguments of `completion`."""

    shell: Annotated[str, Option("SHELL", choices="shtab:SUPPORTED_SHELLS")]
    """Shell to complete in: bash, zsh, fish, powershell or tcsh."""


def run(arguments: Arguments, json: bool) -> int:
    """Print the script of a shell."""
    import shtab

    shells = shtab.SUPPORTED_SHELLS
    if arguments.shell not in shells:
        raise InputError(
            f"there is no completion for '{arguments.shell}'{nearest(arguments.shell, shells)}; known: "
            f"{', '.join(shells)}"
        )
    print(shtab.complete(parser_with_values(), arguments.shell), end="")
    return 0


def parser_with_values() -> argparse.ArgumentParser:
    """Return the parser of the command line, each option with the words or files that it takes."""
    import shtab

    from dzdesign.command_line.parser import arguments_of_command, build_parser

    parser, commands = build_parser()
    for name, command in commands.items():
        declared = {argument.name: argument for argument in arguments_of_command(name)}
        for action in command._actions:
            argument = declared.get(action.dest)
            if argument is not None and argument.option.choices:
                choices = argument.option.choices
                action.choices = tuple(resolve_name(choices) if isinstance(choices, str) else choices)
            elif action.metavar == "DIR":
                setattr(action, COMPLETE, shtab.DIRECTORY)
            elif action.dest == "config" or (argument is not None and argument.is_path):
                setattr(action, COMPLETE, shtab.FILE)
    return parser
