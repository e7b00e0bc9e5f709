"""What the device models of the C2000 targets must do with current control: sampling, start, control, faults.

A check takes the function that runs the firmware through PWM periods, an event each, and the figures of its board.
"""

from collections.abc import Callable
from dataclasses import dataclass

from tests.support.c2000_devices import column

#: One dictionary of facts a PWM period.
Run = Callable[[str], list[dict]]
#: PWM periods in which the current dies away, and those of the calibration.
REST, CALIBRATION = 97, 64
START = "." * (REST + CALIBRATION + 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """Counts between two codes; set point of half the rated current; sums without current and with half of it."""

    apart: int
    half: int
    offset: int
    half_sum: float


def board_of(apart: int, half: int, full_V: float) -> Board:
    """Return the figures of a board whose converter has 12 bits over a range."""
    offset, half_codes = (volts * 4096 / full_V for volts in (0.15, 1.15))
    return Board(apart=apart, half=half, offset=8 * int(offset), half_sum=8 * half_codes)


def check_sampling(run: Run, board: Board) -> None:
    """Eight codes a period, 50 us apart, each in the middle of its part; seven of them before the interrupt."""
    ticks = run("." * 6)
    for tick in ticks:
        assert (tick["converted"], tick["before"], tick["served"]) == (8, 7, 1)
        assert abs(tick["first"] - board.apart // 2) <= 1 and tick["apart"] == board.apart


def check_start(run: Run, board: Board) -> None:
    """The output stays off while the current dies away and its offset is taken; then it is released."""
    ticks = run(START + "." * 4)
    released = column(ticks, "released")
    first = released.index(1)
    assert first in (REST + CALIBRATION - 1, REST + CALIBRATION), "at the first sample from the calibration on"
    assert not any(column(ticks, "duty")[:first]) and {tick["forced"] for tick in ticks[:first]} == {1}
    assert ticks[0]["current"] > 900 and ticks[REST - 1]["current"] == 0
    assert ticks[-1]["offset"] == board.offset and not any(column(ticks, "fault"))
    assert ticks[REST + CALIBRATION - 2]["current_faults"] == 1 and ticks[-1]["current_faults"] == 0


def check_control(run: Run, board: Board) -> None:
    """Half of the rated current, at the solenoid itself; and back to zero."""
    ticks = run(START + "m" + "." * 300 + "nz" + "." * 150)
    held = ticks[len(START) + 240 : len(START) + 300]
    assert {tick["set_point"] for tick in held} == {board.half} and not any(column(ticks, "fault"))
    assert all(abs(tick["current"] - 500) <= 3 and abs(tick["sum"] - board.half_sum) <= 40 for tick in held)
    assert ticks[-1]["current"] == 0 and ticks[-1]["duty"] == 0


def check_faults(run: Run, board: Board) -> None:
    """What each fault does: the trip zone holds the output low, and the fault stays."""
    running = START + "m" + "." * 60
    for event, fault, within, bits in (
        ("o", 0x20, 200, 4),  # open: the wire breaks
        ("s", 0x20, 2, 8),  # short
        ("v", 0x20, 8, 16),  # over-current for 2 ms
        ("q", 0x10, 3, 0),  # no conversion
        ("K", 0x02, 1, 0),  # the driver's comparator
        ("T", 0x02, 1, 0),  # trip input
        ("x" * 9, 0x01, 9, 0),  # no sample
    ):
        ticks = run(running + event + "." * within + "k" + "t" + "." * 20)
        before, after = ticks[: len(running)], ticks[len(running) + len(event) + within :]
        assert not any(column(before, "fault")) and before[-1]["duty"] > 0, event
        assert {(tick["fault"], tick["duty"], tick["forced"], tick["cmpa"]) for tick in after} == {(fault, 0, 1, 0)}
        assert {tick["current_faults"] for tick in after} == {bits}, event


def check_wrong_sensor(run: Run, board: Board) -> None:
    """A zero that is 0.1 V too high is no offset: the output is never released."""
    ticks = run("e" + START + "." * 10)
    assert not any(column(ticks, "duty") + column(ticks, "released"))
    assert (ticks[-1]["fault"], ticks[-1]["current_faults"]) == (0x20, 2)


def check_closed_comparator(run: Run, board: Board) -> None:
    ticks = run("K" + START + "." * 10 + "k" + "." * 5)
    assert column(ticks, "released")[-6:-1] == [0, 1, 1, 1, 1] or column(ticks, "released")[-5:] == [1] * 5
    assert not any(column(ticks, "released")[: len(START) + 10]) and not any(column(ticks, "fault"))


CHECKS = (check_sampling, check_start, check_control, check_faults, check_wrong_sensor, check_closed_comparator)
