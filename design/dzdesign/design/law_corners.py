"""The law at one pressure drop as straight parts: what drive a command makes, and what command a drive needs."""

from dataclasses import dataclass, replace

from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class LawCorners:
    """The law at one pressure drop, two straight parts behind the zero band, all over full command and full drive."""

    #: Drive in the zero band, at the transition's end and at full command.
    offset: float
    at_end: float
    full: float
    #: Command at the ends of zero band and transition, 0 without one; and beyond which the drive leaves its rest.
    zero_band: float
    end: float
    leaves: float

    def lowered(self, at_end: float, at_full: float) -> "LawCorners":
        """Return the branch of a falling command: lower by so much at the transition's end, and at full command."""
        return replace(self, at_end=self.at_end - at_end, full=self.full - at_full)

    def command_at(self, drive: float) -> float:
        """Return the command at which the drive reaches a threshold."""
        if drive <= self.at_end and self.end:
            passed = (drive - self.offset) / (self.at_end - self.offset) if self.at_end > self.offset else 0.0
            return self.zero_band + (self.end - self.zero_band) * passed
        return self.end + (1 - self.end) * (drive - self.at_end) / (self.full - self.at_end)


def corners_of(compensator: Compensator, dp_code: int, sign: int) -> LawCorners:
    """Return the law's corners at a difference of pressure codes."""
    command, end = compensator.signals.command, compensator.transition_end
    span = command.span(sign)
    at = (command.zero_code + command.direction(sign) * from_zero for from_zero in (0, end, span))
    offset, at_end, full = (float(compensator.drive(code, dp_code, sign)) for code in at)
    leaves = compensator.drive_functions.leave_zero_codes / span if compensator.zero_band_codes else 0.0
    zero_band = compensator.zero_band_codes / span
    return LawCorners(offset=offset, at_end=at_end, full=full, zero_band=zero_band, end=end / span, leaves=leaves)
