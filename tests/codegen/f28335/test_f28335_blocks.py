"""The f28335 firmware of block form on the model of the device: a block comes over SCI-A while the drive is at rest.

While it is written into flash the output is held, and all that runs lies in RAM.
"""

import itertools
import re
from dataclasses import replace

import pytest

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.loading.protocol import Reason
from dzdesign.codegen.loading.session import LoadSession, RefusedError
from dzdesign.codegen.project import target_files
from dzdesign.codegen.telemetry.frame import FRAME_OCTETS, STATUS_CALIBRATION, STATUS_RELEASED, FrameReader
from tests.support.c2000_devices import seeded
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL as FULL_SET
from tests.support.golden_firmware import GOLDENS, golden_compensator
from tests.support.loading.device import Device, DeviceLine, build_device, firmware_files
from tests.support.loading.exchanges import crc_of_block, origin_of_block
from tests.support.loading.files import COMPILER, DIGEST, blocks

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not COMPILER, reason="no C compiler (cc, gcc or clang) on the path")]
ZERO, INTERLOCK = unpack(blocks()[0]).command_zero, unpack(blocks()[0]).interlock
FULL = 4000
LINKED = 2
DRIVEN = {number: 10_000 + 100 * ord(str(number)) for number in range(6)}


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return build_device(firmware_files(), tmp_path_factory.mktemp("device"))


@pytest.fixture
def start(program):
    running = []

    def start(linked: bytes = blocks()[0], program=program) -> Device:
        running.append(Device(program, linked))
        return running[-1]

    yield start
    for device in running:
        device.end()


def load(device: Device, number: int = 1, line: DeviceLine | None = None) -> DeviceLine:
    line, block = line or DeviceLine(device), blocks()[number]
    list(LoadSession(line).loading(block, crc_of_block(block), origin_of_block(block)))
    return line


def at_command(device: Device, code: int) -> dict[str, int]:
    device.tell(f"command {code}")
    return device.run(6)


def test_the_drive_follows_the_linked_block_and_then_the_loaded_one(start):
    device = start()
    state = at_command(device, FULL)
    assert (state["released"], state["held"], state["duty"], state["used"]) == (1, 0, DRIVEN[0], LINKED)
    at_command(device, ZERO)
    line = load(device)
    held = [state for state in line.seen if state["held"]]
    assert held and all(state["ost"] and state["duty"] == state["duty_b"] == 0 for state in held)
    state = device.run(6)
    assert (state["released"], state["held"], state["used"], state["ost"]) == (1, 0, 0, 0)
    assert at_command(device, FULL)["duty"] == DRIVEN[1] and at_command(device, 100)["duty_b"] == DRIVEN[1]
    at_command(device, ZERO)
    load(device, 2)
    state = at_command(device, FULL)
    assert state["duty"] == DRIVEN[2] and state["used"] == 1
    assert state["wrong_reads"] == state["fault"] == state["missed"] == state["lost"] == 0


def test_a_load_is_refused_away_from_rest(start):
    device = start()
    for code in (FULL, 0, ZERO + INTERLOCK + 1, ZERO - INTERLOCK - 1):
        at_command(device, code)
        with pytest.raises(RefusedError) as caught:
            load(device)
        assert caught.value.reason == Reason.COMMAND and device.run(1)["held"] == 0
    for code in (FULL, 0):
        at_command(device, code)
        device.run(300)
        at_command(device, ZERO)
        with pytest.raises(RefusedError) as caught:
            load(device)
        assert caught.value.reason == Reason.DRIVING, "the ramp runs"
        device.run(300)
        load(device)
    for code in (ZERO + INTERLOCK, ZERO - INTERLOCK):
        at_command(device, code)
        load(device)


def test_with_the_output_held_off_the_command_must_be_zero_too(start):
    device = start()
    device.tell("trip 1")
    assert at_command(device, FULL)["released"] == 0
    with pytest.raises(RefusedError) as caught:
        load(device)
    assert caught.value.reason == Reason.COMMAND
    at_command(device, ZERO)
    load(device)
    state = device.run(6)
    assert state["released"] == 0 and state["used"] == 0 and state["fault"] == 0
    device.tell("trip 0")
    assert device.run(6)["released"] == 1 and at_command(device, FULL)["duty"] == DRIVEN[1]


def test_a_command_on_the_way_ends_the_load_and_the_old_block_drives(start):
    device = start()
    at_command(device, ZERO)

    class Moving(DeviceLine):
        def write(self, octets: bytes) -> None:
            super().write(octets)
            if len(self.seen) > 20:
                self.device.tell(f"command {FULL}")

    with pytest.raises(RefusedError) as caught:
        load(device, line=Moving(device))
    assert caught.value.reason == Reason.COMMAND
    state = device.run(10)
    assert (state["used"], state["duty"], state["held"], state["wrong_reads"]) == (LINKED, DRIVEN[0], 0, 0)


def test_without_a_valid_block_the_output_stays_off_until_one_is_loaded(start):
    device = start(bytes(len(blocks()[0])))
    state = at_command(device, FULL)
    assert (state["released"], state["held"], state["block"], state["ost"], state["duty"]) == (0, 1, -1, 1, 0)
    frames = list(FrameReader().feed(DeviceLine(device).read(0.1) + (device.run(200), device.take())[1]))
    assert frames and all(frame.status == STATUS_CALIBRATION for frame in frames)
    with pytest.raises(RefusedError) as caught:
        load(device)
    assert caught.value.reason == Reason.COMMAND, "the new block knows its zero"
    at_command(device, ZERO)
    load(device)
    state = at_command(device, FULL)
    assert (state["released"], state["duty"], state["fault"], state["wrong_reads"]) == (1, DRIVEN[1], 0, 0)


def test_replies_and_telemetry_share_the_line_in_whole_frames(start):
    device = start()
    at_command(device, ZERO)
    device.run(300)
    line = DeviceLine(device)
    line.all += device.take()
    before = device.run(1)["dropped"]
    session = LoadSession(line)
    for _ in range(8):  # its reply is longer than the transmitter's FIFO
        session.query()
    load(device, 1, line)
    device.run(100)
    line.all += device.take()
    reader = FrameReader()
    frames = list(reader.feed(bytes(line.all)))
    assert reader.bad_crc == 0 and device.run(1)["dropped"] == before, "none is held up long enough to be dropped"
    steps = {(second.ticks - first.ticks) for first, second in itertools.pairwise(frames)}
    assert steps == {25}
    origins = [frame.origin for frame in frames]
    assert origins[0] == 0 and origins[-1] == 0x0101, "frames say whose block drives"
    assert frames[0].status & STATUS_RELEASED and any(not frame.status & STATUS_RELEASED for frame in frames)


def test_the_receiver_works_again_after_a_break(start):
    device = start()
    at_command(device, ZERO)
    device.tell("break")
    device.tell("send 55")
    state = device.run(200)
    assert state["missed"] == 1 and state["errors"] == 1
    load(device)
    assert device.run(1)["used"] == 0


def test_the_watchdog_is_served_in_each_period_of_a_load(start):
    device = start()
    at_command(device, ZERO)
    before = device.run(1)
    load(device)
    after = device.run(1)
    periods = (after["ticks"] - before["ticks"]) % 2**16
    assert after["services"] - before["services"] == periods > 1000


def test_a_block_whose_zero_command_is_another_is_refused(start):
    device = start()
    at_command(device, ZERO + 1)
    other = pack(replace(unpack(blocks()[1]), interlock=0))
    with pytest.raises(RefusedError) as caught:
        list(LoadSession(DeviceLine(device)).loading(other, crc_of_block(other), origin_of_block(other)))
    assert caught.value.reason == Reason.COMMAND and device.run(6)["used"] == LINKED


@pytest.mark.parametrize(
    ("file", "old", "new", "check"),
    [
        ("dz_isr.c", "|| (dz_hold_wanted != 0u) ", "", test_the_drive_follows_the_linked_block_and_then_the_loaded_one),
        ("dz_isr.c", " || (dz_active == NULL)", "",
         test_without_a_valid_block_the_output_stays_off_until_one_is_loaded),
        ("dz_isr.c", "released = 0u;\n    rest();", "released = 0u;\n    dz_drive_init(dz_active, &drive);",
         test_the_drive_follows_the_linked_block_and_then_the_loaded_one),
        ("dz_active.c", "ramped > zero_codes(block)", "ramped > 0xFFFEu", test_a_load_is_refused_away_from_rest),
        ("dz_telemetry.c", "((dz_telemetry.at == 0u) || (dz_telemetry.at >= DZ_FRAME_OCTETS)) && ", "",
         test_replies_and_telemetry_share_the_line_in_whole_frames),
    ],
)  # fmt: skip
def test_a_seeded_fault_is_found(start, tmp_path, file, old, new, check):
    faulty = build_device(seeded(firmware_files(), (file, old, new)), tmp_path)
    with pytest.raises((AssertionError, RefusedError, pytest.fail.Exception)):
        check(lambda linked=None: start(linked or blocks()[0], faulty))


FUNCTION = re.compile(r"^(?:static |__interrupt )?\w+ (\w+)\([^;]*?\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
IN_RAM = re.compile(r'#pragma CODE_SECTION\((\w+), "\.TI\.ramfunc"\)')
#: What dz_isr() calls besides while the output is not held; a store may be busy only while it is.
NOT_HELD = {"calibrate", "control_current", "release_output", "dz_current_init", "dz_drive_sample", "dz_drive_tick"}


def interrupt_of(sensor: str) -> dict[str, str]:
    """Return the files of the interrupt of block form."""
    made = golden_compensator("f28335", GOLDENS if sensor else FULL_SET)
    made = with_current(made, TARGET, SENSORS[sensor]) if sensor else made
    files = target_files(made, TARGET, Banner(digest=DIGEST), block_of(made, DIGEST))
    return {name: files[f"f28335/{name}"] for name in ("dz_isr.c", "dz_hardware.c")}


def check_in_ram(files: dict[str, str]) -> None:
    text = "".join(files.values())
    functions, in_ram = dict(FUNCTION.findall(text)), set(IN_RAM.findall(text))
    assert {"dz_isr", "force_output_low", "rest", "show", "take_sample", "dz_trip_output"} <= functions.keys()
    of_interrupt = dict(FUNCTION.findall(files["dz_isr.c"])).keys() - {"dz_isr_init"}
    reached, wanted = set(), {"dz_isr"}
    while wanted:
        name = wanted.pop()
        reached.add(name)
        called = set(re.findall(r"\b([a-z]\w+)\(", functions[name])) - {"if", "while", "for", "switch", "sizeof"}
        called -= NOT_HELD if name == "dz_isr" else set()
        assert called <= in_ram, f"{name} calls what lies in flash"
        wanted |= called - reached
    assert of_interrupt <= in_ram <= reached | of_interrupt | {"dz_untrip_output"}, "all of the interrupt, and no other"
    assert not any("block->" in functions[name] or "*dz_active" in functions[name] for name in reached)


@pytest.mark.parametrize("sensor", ["", *SENSORS])
def test_all_that_runs_while_the_output_is_held_lies_in_ram(sensor):
    check_in_ram(interrupt_of(sensor))


@pytest.mark.parametrize(
    "edit",
    [
        ("dz_isr.c", '#pragma CODE_SECTION(rest, ".TI.ramfunc");\n', ""),
        ("dz_hardware.c", '#pragma CODE_SECTION(dz_trip_output, ".TI.ramfunc");\n', ""),
        ("dz_isr.c", "    dz_write_compare_a(0u);\n", "    dz_drive_init(dz_active, &drive);\n"),
    ],
)  # fmt: skip
def test_a_function_in_flash_is_found(edit):
    with pytest.raises(AssertionError):
        check_in_ram(seeded(interrupt_of(""), edit))


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


def test_a_drive_that_is_enabled_on_the_way_stays_held_until_the_load_is_over(start):
    device, zero = start(), 2048
    device.tell("trip 1")
    device.tell(f"command {zero}")
    assert device.run(20)["released"] == 0
    line = Eventful(device, "trip 0", 20)
    list(LoadSession(line).loading(blocks()[1], crc_of_block(blocks()[1]), origin_of_block(blocks()[1])))
    assert not line.told, "the trip input was closed on the way"
    first = next(place for place, state in enumerate(line.seen) if state["held"])
    during = [state for state in line.seen[first:-1]]
    assert all(state["held"] and state["ost"] and not state["released"] for state in during)
    assert not any(state["duty"] or state["duty_b"] for state in line.seen)
    state = device.run(20)
    assert (state["held"], state["released"], state["used"], state["wrong_reads"], state["fault"]) == (0, 1, 0, 0, 0)


def test_telemetry_that_comes_back_between_requests_spoils_no_load(start):
    """As from a line that echoes, or a monitor that sends what it read: frames, their beginnings, and zeros."""
    device = start()
    at_command(device, ZERO)
    frame = bytes.fromhex("a55a03") + bytes(range(FRAME_OCTETS - 3))
    for noise in (frame, frame[:7], b"\xc3", b"\xc3\x3c\x01\x05\xff", bytes(40)):
        line = Eventful(device, "", 0, noise)
        list(LoadSession(line).loading(blocks()[2], crc_of_block(blocks()[2]), origin_of_block(blocks()[2])))
        assert device.run(6)["wrong_reads"] == 0
