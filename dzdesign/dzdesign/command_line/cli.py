"""The program: exit statuses and the handling of errors; the commands are listed in `parser`.

Exit status: 0 holds, 1 a requirement does not hold (the message says which) or dzdesign refuses its own result, 2 bad
input or usage. Every heavy import happens inside the stage that needs it.
"""

import errno
import os
import signal
import sys

from dzdesign.core.errors import DzdesignError, InternalError, RequirementError, clear_line
from dzdesign.terminal.progress import lead_nowhere, reporting, say_on_stderr

#: What the system says of an output that takes no more: full, beyond a quota, closed, a device that fails.
UNPRINTABLE = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EBADF, errno.EIO, errno.EFBIG)
DOES_NOT_HOLD, BAD_INPUT, INTERRUPTED, PIPE_CLOSED = 1, 2, 130, 141


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    # The matrices here are small: threads of NumPy's BLAS would only wait for each other, to a tenth of the speed.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a console that can't print a character prints a ? instead
            stream.reconfigure(errors="replace")
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (as long as the process lives)
    if sys.stdout is None:
        say_on_stderr("the standard output is closed, and results go there; leave it open")
        return BAD_INPUT
    call = None
    try:
        argv = sys.argv[1:] if argv is None else argv
        if argv in (["--help"], ["-h"]):
            from dzdesign.command_line.parser import build_parser

            print(build_parser(only="")[0].format_help(), end="", flush=True)
            return 0
        from dzdesign.command_line.invocation import parse
        from dzdesign.command_line.parser import command_module

        call = parse(argv)
        with reporting(quiet=call.quiet, verbose=call.verbose):
            status: int = command_module(call.command).run(call.arguments, call.json)
            sys.stdout.flush()  # what can't be printed is said here and not when Python ends
            return status
    except RequirementError as error:
        say_on_stderr(f"does not hold: {clear_line(str(error))}")
        return DOES_NOT_HOLD
    except InternalError as error:
        say_on_stderr(clear_line(str(error)))
        return DOES_NOT_HOLD
    except DzdesignError as error:
        text = str(error)
        if call is not None and call.from_file:
            from dzdesign.command_line.invocation import in_words_of_the_file

            text = in_words_of_the_file(text, call.options_file, call.from_file)
        say_on_stderr(clear_line(text))
        return BAD_INPUT
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one would end the clearing away behind this function
        say_on_stderr(f"interrupted; nothing half-written was left{_what_was_written()}")
        return INTERRUPTED
    except BrokenPipeError:
        lead_nowhere(sys.stdout)
        return PIPE_CLOSED
    except (MemoryError, OSError, ImportError) as error:
        if (reason := _reason_in_the_system(error)) is None:
            raise
        lead_nowhere(sys.stdout)
        say_on_stderr(f"{reason}{_what_was_written() or '; nothing was written'}")
        return BAD_INPUT


def _reason_in_the_system(error: Exception) -> str | None:
    """Return in words why the machine ended a command; None for an error that is a fault of dzdesign."""
    if isinstance(error, MemoryError) or (isinstance(error, ImportError) and "failed to map" in str(error)):
        return "memory ran out; close other programs, or raise the limit (ulimit -v)"
    if isinstance(error, OSError) and error.errno in UNPRINTABLE and error.filename is None:
        if _is_of_a_file(error):
            return f"a temporary file can't be written: {error.strerror}; make room, or set TMPDIR to another folder"
        return f"the results can't be printed: {error.strerror}"
    return None


def _is_of_a_file(error: OSError) -> bool:
    """Tell whether an error without a name is of a file: nothing is printed by these modules."""
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    module = "" if frame is None else str(frame.tb_frame.f_globals.get("__name__"))
    return module.partition(".")[0] in ("pathlib", "shutil", "tempfile")


def _what_was_written() -> str:
    from dzdesign.core.artefact_files import written

    names = ", ".join(f"'{path}'" for path in written)
    return clear_line(f"; written before that: {names}") if names else ""
