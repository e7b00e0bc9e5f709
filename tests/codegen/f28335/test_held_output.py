"""What may run while a block is written into flash, and that nothing lets the output go meanwhile."""

import re
from functools import cache

import pytest

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.loading.session import LoadSession
from dzdesign.codegen.project import target_files
from dzdesign.codegen.telemetry.frame import FRAME_OCTETS
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.loading.device import Device, DeviceLine, build_device, firmware_files
from tests.support.loading.exchanges import crc_of_block, origin_of_block
from tests.support.loading.files import COMPILER, DIGEST, blocks

FUNCTION = re.compile(r"^(?:static |interrupt )+\w+ (\w+)\([^;]*?\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
IN_RAM = re.compile(r'#pragma CODE_SECTION\((\w+), "\.TI\.ramfunc"\)')
#: What dz_isr() calls besides while the output is not held; a store may be busy only while it is.
NOT_HELD = {"calibrate", "control_current", "release_output", "dz_current_init", "dz_drive_sample", "dz_drive_tick"}


@cache
def interrupt_of(sensor: str) -> str:
    """Return dz_isr.c of block form."""
    made = golden_compensator("f28335", GOLDENS if sensor else FULL)
    made = with_current(made, TARGET, SENSORS[sensor]) if sensor else made
    return target_files(made, TARGET, Banner(digest=DIGEST), block_of(made, DIGEST))["f28335/dz_isr.c"]


def check_in_ram(text: str) -> None:
    functions, in_ram = dict(FUNCTION.findall(text)), set(IN_RAM.findall(text))
    assert {"dz_isr", "force_output_low", "rest", "show_drive", "take_sample"} <= functions.keys()
    assert set(functions) == in_ram, "every function of the interrupt, and no other"
    reached, wanted = set(), {"dz_isr"}
    while wanted:
        name = wanted.pop()
        reached.add(name)
        called = set(re.findall(r"\b([a-z]\w+)\(", functions[name])) - {"if", "while", "for", "switch", "sizeof"}
        called -= NOT_HELD if name == "dz_isr" else set()
        assert called <= in_ram, f"{name} calls what lies in flash"
        wanted |= called - reached
    assert not any("block->" in functions[name] or "*dz_active" in functions[name] for name in reached)


@pytest.mark.parametrize("sensor", ["", *(pytest.param(name, marks=pytest.mark.slow) for name in SENSORS)])
def test_all_that_runs_while_the_output_is_held_lies_in_ram(sensor):
    check_in_ram(interrupt_of(sensor))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('#pragma CODE_SECTION(rest, ".TI.ramfunc");\n', ""),
        ("    show_drive();\n    write_compare_a(0u);", "    dz_drive_init(dz_active, &drive);\n    show_drive();"),
    ],
)
def test_a_function_in_flash_is_found(old, new):
    text = interrupt_of("")
    assert text.count(old) == 1
    with pytest.raises(AssertionError):
        check_in_ram(text.replace(old, new))


@pytest.fixture(scope="module")
def device(tmp_path_factory):
    if not COMPILER:
        pytest.skip("no C compiler (cc, gcc or clang) on the path")
    program = build_device(firmware_files(), tmp_path_factory.mktemp("device"))
    device = Device(program, blocks()[0])
    yield device
    device.end()


class Eventful(DeviceLine):
    """A line on which the drive is told something after so many looks at it, and noise stands between requests."""

    def __init__(self, device, told: str, at: int, noise: bytes = b"") -> None:
        super().__init__(device)
        self.told, self.at, self.noise = told, at, noise

    def write(self, octets: bytes) -> None:
        if len(self.seen) >= self.at and self.told:
            self.device.tell(self.told)
            self.told = ""
        super().write(self.noise + octets)


@pytest.mark.slow
def test_a_drive_that_is_enabled_on_the_way_stays_held_until_the_load_is_over(device):
    zero = 2048
    device.tell("trip 1")
    device.tell(f"command {zero}")
    assert device.run(20)["released"] == 0
    line = Eventful(device, "trip 0", 20)
    LoadSession(line).load(blocks()[1], crc_of_block(blocks()[1]), origin_of_block(blocks()[1]))
    assert not line.told, "the trip input was closed on the way"
    first = next(place for place, state in enumerate(line.seen) if state["held"])
    during = [state for state in line.seen[first:-1]]
    assert all(state["held"] and state["ost"] and not state["released"] for state in during)
    assert not any(state["duty"] or state["duty_b"] for state in line.seen)
    state = device.run(20)
    assert (state["held"], state["released"], state["used"], state["wrong_reads"], state["fault"]) == (0, 1, 0, 0, 0)


@pytest.mark.slow
def test_telemetry_that_comes_back_between_requests_spoils_no_load(device):
    """As from a line that echoes, or a monitor that sends what it read: frames, their beginnings, and zeros."""
    frame = bytes.fromhex("a55a02") + bytes(range(FRAME_OCTETS - 3))
    for noise in (frame, frame[:7], b"\xc3", b"\xc3\x3c\x01\x05\xff", bytes(40)):
        line = Eventful(device, "", 0, noise)
        LoadSession(line).load(blocks()[2], crc_of_block(blocks()[2]), origin_of_block(blocks()[2]))
        assert device.run(6)["wrong_reads"] == 0
