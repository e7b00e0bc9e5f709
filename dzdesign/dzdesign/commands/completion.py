"""`dzdesign completion SHELL`: the script by which a shell completes commands, options, targets and files, by shtab."""

import argparse

from dzdesign.core.errors import InputError, nearest

#: How the help calls a value that is a file.
FILES = ("FILE", "AFTER", "TOML", "PLANT.toml", "TOL.toml")


def run_completion(args: argparse.Namespace) -> int:
    """Print the script of a shell."""
    import shtab

    shells = shtab.SUPPORTED_SHELLS
    if args.shell not in shells:
        raise InputError(
            f"there is no completion for '{args.shell}'{nearest(args.shell, shells)}; known: {', '.join(shells)}"
        )
    print(shtab.complete(_parser(), args.shell), end="")
    return 0


def _parser() -> argparse.ArgumentParser:
    """Return the parser of the command line, each option with the words or files that it takes."""
    import shtab

    from dzdesign.codegen.project import TARGET_NAMES
    from dzdesign.command_line.command_spec import language
    from dzdesign.command_line.parsing import build_parser
    from dzdesign.commands.schema import SCHEMAS
    from dzdesign.derivation.law import LAW_NAMES
    from dzdesign.derivation.presentation.report import FORMATS
    from dzdesign.design.options import ACCEPTABLE, GUARDS
    from dzdesign.design.request import CHOICES

    words = {
        "--target": TARGET_NAMES,
        "--law": LAW_NAMES,
        "--guard": GUARDS,
        "--accept": ACCEPTABLE,
        "--format": FORMATS,
        "--below-dp0": ("hold", "extend"),
        "shell": shtab.SUPPORTED_SHELLS,
        "name": SCHEMAS,
        **{f"--{name.replace('_', '-')}": known for name, known in CHOICES.items()},
    }
    parser, commands = build_parser(language())
    for command in commands.values():
        for action in command._actions:
            name = action.option_strings[-1] if action.option_strings else action.dest
            if action.nargs == 0:
                continue
            if name in words:
                action.choices = tuple(words[name])
            elif action.metavar == "DIR":
                action.complete = shtab.DIRECTORY
            elif not action.option_strings or action.metavar in FILES:
                action.complete = shtab.FILE
    return parser
