"""Codes and counts in the words of a comment: a share of command or drive, and what that is in the user's unit."""

from dzdesign.design.compensator import Compensator


def share_of_command(compensator: Compensator, codes: int, sign: int = 1) -> str:
    """Return so many codes of command as a share of full command, and in the unit that a person sees."""
    share = codes / compensator.signals.command.span(sign)
    return f"{share:.2%} of command" + in_unit(compensator, share)


def in_unit(compensator: Compensator, share: float) -> str:
    """Return a share of full command or drive in the unit that a person sees, behind a comma; nothing in percent."""
    units = compensator.valve.recorded_units.of_controller
    if units.command.unit == "%":
        return ""
    return f", {units.text(share * float(compensator.u_max_V), '.4g dV')}"
