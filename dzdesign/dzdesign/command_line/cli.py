"""The command line: what an error or a failed requirement becomes; what can be said stands in `command_spec`.

Exit status: 0 holds, 1 a requirement does not hold (said which), 2 bad input or usage. Every heavy import happens
inside the command that needs it (`dzdesign.commands.pipeline`), and argparse only once there is something to parse
(`dzdesign.command_line.parsing`), so that `--help` costs next to nothing.
"""

import os
import sys

from dzdesign.command_line.command_spec import COMMAND_GROUPS, COMMANDS, EXAMPLES, language
from dzdesign.command_line.front_page import front_page
from dzdesign.core.errors import DzdesignError, RequirementError, clear_line

DOES_NOT_HOLD, BAD_INPUT, INTERRUPTED, PIPE_CLOSED = 1, 2, 130, 141


def parse(argv: list[str]) -> "argparse.Namespace":  # noqa: F821
    """Parse the command line; what a TOML file says stands in for the defaults.

    Raises
    ------
    InputError
        If the command line is wrong, or the file can't be read or names no option.
    """
    from dzdesign.command_line import parsing

    return parsing.parse(argv, language())


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    # The matrices here are small: threads of NumPy's BLAS would only wait for each other, to a tenth of the speed.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a console that can't print a character prints a ? instead
            stream.reconfigure(errors="replace")
    args = None
    try:
        argv = sys.argv[1:] if argv is None else argv
        if argv in (["--help"], ["-h"]):
            print(front_page(COMMANDS, COMMAND_GROUPS, EXAMPLES[""]), end="")
            return 0
        args = parse(argv)
        from importlib import import_module

        from dzdesign.terminal.progress import talking

        module, function = args.run.split(":")
        with talking(quiet=args.quiet, verbose=args.verbose):
            return getattr(import_module(module), function)(args)
    except RequirementError as error:
        print(f"dzdesign: does not hold: {clear_line(str(error))}", file=sys.stderr)
        return DOES_NOT_HOLD
    except DzdesignError as error:
        print(f"dzdesign: {clear_line(_said(error, args))}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("dzdesign: interrupted; nothing half-written was left", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED


def _said(error: DzdesignError, args: "argparse.Namespace | None") -> str:  # noqa: F821
    """Return what an error says; an option that stands in the TOML file is named as it stands there."""
    values = getattr(args, "from_file", None)
    if not values:
        return str(error)
    from dzdesign.command_line.toml_options import in_words_of_the_file

    return in_words_of_the_file(str(error), args.config, values)
