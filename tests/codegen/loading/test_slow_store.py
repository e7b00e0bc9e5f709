"""A store whose erase returns late, as TI's Flash API does: seconds in which the drive answers nobody."""

import pytest

from dzdesign.codegen.loading.protocol import ERASE_S
from dzdesign.codegen.loading.session import LoadSession
from tests.support.loading.bench import TICK_HZ, VirtualLine
from tests.support.loading.exchanges import load
from tests.support.loading.files import blocks, drive_files, new_bench

FIFO_OCTETS = 16


class DeafLine(VirtualLine):
    """While the drive erases, time goes by and the PC goes on; of what it sends the receiver's FIFO is kept."""

    def __init__(self, drive) -> None:
        super().__init__(drive)
        self.until_s, self.held = 0.0, b""

    def write(self, octets: bytes) -> None:
        if self.time_s < self.until_s:
            self.held = (self.held + octets)[:FIFO_OCTETS]
            self.time_s += 0.002
        else:
            super().write(octets)

    def read(self, limit_s: float) -> bytes:
        if self.time_s < self.until_s:
            self.time_s += min(limit_s, 0.05, self.until_s - self.time_s + 1e-9)
            return b""
        if self.held:
            held, self.held = self.held, b""
            self.drive.code.drive_feed(held, len(held))
        return super().read(limit_s)

    def _pass(self, time_s: float, passes: int) -> None:
        super()._pass(time_s, passes)
        if late := self.drive.get("late_ticks"):
            self.drive.set(late_ticks=0)
            self.until_s = self.time_s + late / TICK_HZ


def loaded(bench, erase_s: float) -> str:
    drive = bench.drive
    drive.erase()
    drive.power_on()
    drive.set(erase_ticks=round(erase_s * TICK_HZ))
    return load(LoadSession(DeafLine(drive)), blocks()[1])


@pytest.mark.parametrize("erase_s", [0.0, 0.25, 1.9, 2.1, 3.5, 10.0, ERASE_S - 1])
def test_a_load_waits_for_a_slow_erase_and_erases_once(bench, erase_s):
    assert loaded(bench, erase_s) == "done"
    assert bench.drive.get("erases") == 1 and bench.drive.block() == blocks()[1] == bench.drive.power_on()


def test_an_erase_that_never_ends_is_given_up(bench):
    assert loaded(bench, 2 * ERASE_S) == "no reply"


@pytest.mark.slow
def test_a_time_that_counts_from_before_the_erase_is_found(bench, tmp_path):
    """`bench` skips without a compiler."""
    text = drive_files()["dz_load.c"]
    assert text.count("load->since = ticks;\n        load->anew") == 1
    faulty = new_bench(tmp_path, {"dz_load.c": text.replace("load->since = ticks;\n        load->anew", "load->anew")})
    assert loaded(faulty, 3.5) != "done"
