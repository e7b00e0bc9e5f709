"""The options of `design` on the command line, turned into `DesignOptions`."""

import argparse

from dzdesign.core.errors import InputError
from dzdesign.design.request import DEFAULTS, option_name


def given_design_options(args: argparse.Namespace) -> list[str]:
    """Return the design's options that were given, as they are written."""
    return [option_name(name) for name in DEFAULTS if getattr(args, name) is not None]


def design_options(args: argparse.Namespace, target: "TargetInputs") -> "DesignOptions":  # noqa: F821
    """Return the engineer's choices.

    Parameters
    ----------
    args : argparse.Namespace
        Of `design` or `codegen`.
    target : TargetInputs
        Converter and timer of the target that is designed for.

    Raises
    ------
    InputError
        If an option can't be read; it is named.
    """
    from dzdesign.design.option_texts import options_of

    options = options_of({name: getattr(args, name) or "" for name in DEFAULTS}, target)
    if options.signals.command.negative_full_code is None:
        _refuse_what_needs_both_signs(args, dict(options.request.options)["command_signal"])
    return options


def _refuse_what_needs_both_signs(args: argparse.Namespace, command: str) -> None:
    """Refuse options of negative commands where the command has none, and would leave them without effect."""
    given = [option_name(name) for name in ("negative_dp", "zero_window") if getattr(args, name) is not None]
    given += [
        f"the second time of {option_name(name)}"
        for name in ("ramp_up", "ramp_down")
        if "/" in (getattr(args, name) or "")
    ]
    if given:
        raise InputError(
            f"{given[0]} is for a command of both signs, but {command!r} has one; leave it out, or give "
            "a --command-signal such as '-10..10 V x 0.15 + 1.5 V'"
        )
