"""Command to drive of one sign, without pressure: straight parts, and a jump where a device has one."""

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

Node = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True, kw_only=True)
class Characteristic:
    """Drive over full drive as straight parts over the command, a share of full command, exact.

    Up to and with `rest` the drive is zero; behind it, it begins at the first node's drive and ends at full command.
    """

    rest: Fraction
    #: Command and drive: the first command is `rest`, the last one 1, and both numbers never fall.
    nodes: tuple[Node, ...]

    def __post_init__(self) -> None:
        commands, drives = zip(*self.nodes, strict=True)
        if commands[0] != self.rest or commands[-1] != 1 or not 0 <= self.rest < 1:
            raise ValueError("a characteristic runs from where it leaves its rest to full command")
        if any(left >= right for left, right in pairwise(commands)):
            raise ValueError("the commands of a characteristic rise")
        if any(left > right for left, right in pairwise(drives)) or drives[0] < 0 or drives[-1] > 1:
            raise ValueError("the drive of a characteristic never falls, and is 0 to 1")

    @property
    def offset(self) -> Fraction:
        """Largest drive of a command that counts as zero: where it leaves its rest, or at the end of a first ramp."""
        return self.nodes[0][1] or self.nodes[1][1]

    def drive(self, command: Fraction) -> Fraction:
        """Return the drive at a command, 0 to 1."""
        if command <= self.rest:
            return Fraction(0)
        for (left, low), (right, high) in pairwise(self.nodes):
            if command <= right:
                return low + (high - low) * (command - left) / (right - left)
        return self.nodes[-1][1]

    def command_at(self, drive: Fraction) -> Fraction | None:
        """Return the command behind which the drive is at least this: the dead zone to a threshold; None: never."""
        if drive <= self.nodes[0][1]:
            return self.rest
        for (left, low), (right, high) in pairwise(self.nodes):
            if drive <= high:
                return left + (right - left) * (drive - low) / (high - low)
        return None


def jump(offset: Fraction, full: Fraction, rest: Fraction) -> Characteristic:
    """Return the drive that jumps to an offset behind its rest, and runs straight from there to full command."""
    return Characteristic(rest=rest, nodes=((rest, offset), (Fraction(1), full)))


def added(offset: Fraction) -> Characteristic:
    """Return the drive of a device that adds an offset to every command but zero, and is limited to full drive."""
    none, one = Fraction(0), Fraction(1)
    limited: tuple[Node, ...] = ((1 - offset, one),) if offset else ()
    return Characteristic(rest=none, nodes=((none, offset), *limited, (one, one)))
