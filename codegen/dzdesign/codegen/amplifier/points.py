"""The points of a table for both directions of a command, rising, as a device takes them."""

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise

from dzdesign.design.fixed_offset import Characteristic, Node

NO_NODE: Node = (Fraction(0), Fraction(0))


def rising_points(characteristics: Mapping[int, Characteristic]) -> tuple[Node, ...]:
    """Return command and drive from full negative command to full positive one; both are negative of the one side."""
    other_side = characteristics[-1].nodes if -1 in characteristics else ()
    negative = [(-command, -drive) for command, drive in reversed(other_side)]
    return tuple(dict.fromkeys([*negative, NO_NODE, *characteristics[1].nodes]))


def with_odd_count(points: tuple[Node, ...], *, least: Node) -> tuple[Node, ...]:
    """Return points that reach full negative command, an odd number of them: of an even one the largest rise is halved.

    `least` stands at full negative command where the points begin at zero.
    """
    if points[0] == NO_NODE:
        points = (least, *points)
    if len(points) % 2:
        return points
    rises = [right[1] - left[1] for left, right in pairwise(points)]
    place = rises.index(max(rises)) + 1  # of a short one half a step of the device would be lost
    (left, low), (right, high) = points[place - 1 : place + 1]
    return (*points[:place], ((left + right) / 2, (low + high) / 2), *points[place:])
