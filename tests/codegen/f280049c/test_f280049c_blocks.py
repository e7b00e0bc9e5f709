"""The F280049C folder in block form, with the core that belongs to it, on the model behind the stand-in for DriverLib.

A block goes into the program as an end-of-line tool puts it into flash: its octets in the place of those linked.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from dzdesign.codegen.calibration.files import FINDINGS
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.f280049c.target import TARGET
from dzdesign.codegen.project import generate
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.signals import Signals
from tests.support.c2000_devices import Edit, column, compiled, model_of, model_options, periods, seeded, write
from tests.support.core_variants import BOTH
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL, full_options, golden_compensator, golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]
FAULT_CALIBRATION = 0x40
#: Bits of dz_state.calibration.
BIT = {name: 1 << place for place, name in enumerate(FINDINGS)}
#: Zero command for the interlock and the current's offset; all commands with failed sensors and with sound ones; zero
#: again, and one command; then the trip pin in use.
EVENTS = "{zero}" + "." * 170 + "n" + "." * 90 + "p" + "." * 170 + "{zero}" + "." * 20 + "n" + "." * 30 + "T...t...."
#: What else may come: samples that fail, a trip pin at the start, codes above 12 bits, faults of the coil.
OTHER_EVENTS = (
    "p{zero}" + "." * 190 + "n" + "." * 9 + "xxxxxxxxxxxx....",
    "T......t" + "{zero}" + "." * 9 + "n" + "." * 20, "h" * 12,
    *("p{zero}" + "." * 190 + "n" + "." * 40 + event + "." * 210 for event in "osvqeKT"),
)  # fmt: skip
#: What a person may try to get the output back: samples, trip pin, no samples, other commands.
TRIED = "p" + "." * 40 + "T...t....z....n....c....n....xxxxxxxxxxxx....m......h...b..." + "." * 200


def two_solenoids() -> Compensator:
    """Return a design with ramps, dither and transition for both solenoids; plain sensors, as the model has them."""
    ramps = {"ramp_up_s": (0.02, 0.03), "ramp_down_s": (0.01, 0.0)}
    signals = Signals(command=BOTH, compare_max=TARGET.compare_max)
    return design(golden_valve(FULL), full_options(signals=signals, negative_dp="wired", **ramps))


MADE: dict[str, Callable[[], Compensator]] = {
    "one solenoid": partial(golden_compensator, "f280049c"),
    "two solenoids": two_solenoids,
    "current": lambda: with_current(golden_compensator("f280049c"), TARGET, SENSORS["supply unknown"]),
}


class Firmware:
    """The generated firmware of a form, all of it compiled with the model; in block form with its block."""

    def __init__(self, folder: Path, made: Compensator, calibration: str, edit: Edit | None = None):
        firmware = generate(made, "f280049c", calibration)
        self.linked, self._folder = firmware.block, folder
        texts = {Path(path).name: text for path, text in firmware.files.items() if path.endswith((".c", ".h"))}
        folder.mkdir()
        write(seeded(texts, edit) if edit else texts, folder)
        # driver.c includes main.c.
        sources = [folder / name for name in texts if name.endswith(".c") and name != "main.c"]
        self.program = folder / "program"
        model = model_of("f280049c", "driver.c")
        compiled(*model_options("f280049c", folder), *sources, *model, "-lm", "-o", self.program)

    def flashed(self, block: bytes) -> Path:
        """Return the program with these octets in the place of its block."""
        image = self.program.read_bytes()
        assert image.count(self.linked) == 1 and len(block) == len(self.linked), "dz_block.c is calibration.bin"
        other = self._folder / "flashed"
        other.unlink(missing_ok=True)
        other.write_bytes(image.replace(self.linked, block))
        other.chmod(0o755)
        return other


@pytest.fixture(scope="module")
def in_blocks(tmp_path_factory) -> dict[str, Firmware]:
    """The firmware in block form of each of `MADE`."""
    folder = tmp_path_factory.mktemp("blocks")
    return {name: Firmware(folder / name.replace(" ", "_"), made(), "block") for name, made in MADE.items()}


def of_another_firmware(block: bytes) -> dict[str, tuple[bytes, int]]:
    """Return blocks with a right CRC that belong to other firmware, and what must be found."""
    sound = unpack(block)
    return {
        "of f28335: 60000 counts": (pack(replace(sound, compare_max=60_000)), BIT["FIRMWARE"]),
        "other wiring": (pack(replace(sound, shape=sound.shape ^ 2)), BIT["FIRMWARE"]),
        "other rate": (pack(replace(sound, tick_Hz=5_000)), BIT["FIRMWARE"]),
        "other layout": (pack(replace(sound, layout=sound.layout + 1)), BIT["FORMAT"]),
    }


def refused(block: bytes) -> dict[str, tuple[bytes, int]]:
    """Return what may stand in the block's flash and is no valid block, and a bit that must be found."""
    middle = len(block) // 2
    return {
        "erased": (b"\xff" * len(block), BIT["FORMAT"] | BIT["CRC"]),
        "all zero": (bytes(len(block)), BIT["FORMAT"] | BIT["CRC"]),
        "wrong CRC": (block[:-1] + bytes((block[-1] ^ 0x80,)), BIT["CRC"]),
        "one bit": (block[:middle] + bytes((block[middle] ^ 1,)) + block[middle + 1 :], BIT["CRC"]),
        "half written": (block[:middle] + b"\xff" * (len(block) - middle), BIT["CRC"]),
        **of_another_firmware(block),
    }


def check_released(firmware: Firmware, block: bytes, bits: int) -> None:
    """The output stays low whatever comes, and the state says why; other faults stand beside it."""
    for start, fault in ((), 0), (("W",), 4), (("C",), 8):
        ticks = periods(firmware.flashed(block), TRIED, *start)
        assert {(tick["output"], tick["duty"], tick["duty_b"], tick["cmpa"]) for tick in ticks} == {("low", 0, 0, 0)}
        assert not any(column(ticks, "released")), "never"
        assert {seen & bits for seen in column(ticks, "calibration")} == {bits}
        assert all(seen & FAULT_CALIBRATION and seen & fault == fault for seen in column(ticks, "fault"))
        assert set(column(ticks, "served")) == {1}, "the interrupt goes on, so the watchdog is served"


@pytest.mark.parametrize("name", MADE)
def test_a_valid_block_runs_as_the_fixed_form(in_blocks, tmp_path, name):
    fixed = Firmware(tmp_path / "fixed", MADE[name](), "fixed").program
    used = {"two solenoids": ("duty", "duty_b"), "current": ("duty", "current")}.get(name, ("duty",))
    for number, events in enumerate((EVENTS, *OTHER_EVENTS)):
        events = events.format(zero="c" if name == "two solenoids" else "z")
        of_block, of_fixed = periods(in_blocks[name].program, events), periods(fixed, events)
        assert {tick.pop("calibration") for tick in of_block} == {0}
        assert of_block == of_fixed
        assert number or all(len(set(column(of_fixed, fact))) > 20 for fact in used), "the output follows the law"


@pytest.mark.parametrize("name", MADE)
def test_without_a_valid_block_the_output_stays_released(in_blocks, name):
    firmware = in_blocks[name]
    for block, bits in refused(firmware.linked).values():
        check_released(firmware, block, bits)


def test_another_valves_block_drives_without_a_new_firmware(in_blocks):
    firmware = in_blocks["one solenoid"]
    other = replace(unpack(firmware.linked), compare_limit=1)
    sides = tuple(replace(side, quotient_limit=0) for side in other.sides)
    ticks = periods(firmware.flashed(pack(replace(other, sides=sides))), EVENTS.format(zero="z"))
    assert set(column(ticks, "calibration")) == {0}
    assert any(column(ticks, "released")) and not any(column(ticks, "cmpa"))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("dz_isr.c", "        state.fault |= DZ_FAULT_CALIBRATION;", ""),
        ("dz_isr.c", "state.calibration = dz_calibration_check(&dz_block)", "state.calibration = 0u"),
        ("dz_calibration.c", "differs(block->crc32, crc_of(block))", "differs(crc_of(block), crc_of(block))"),
        ("dz_calibration.c", "differs(block->compare_max, DZ_COMPARE_MAX) |", ""),
    ],
)
def test_a_seeded_fault_is_caught(tmp_path, name, old, new):
    firmware = Firmware(tmp_path / "faulty", MADE["one solenoid"](), "block", (name, old, new))
    with pytest.raises(AssertionError):
        for block, bits in refused(firmware.linked).values():
            check_released(firmware, block, bits)
