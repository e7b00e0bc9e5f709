"""`dzdesign monitor` over a pseudo-terminal, against the firmware's own frame code, compiled on the host."""

import contextlib
import json
import os
import random
import signal
import struct
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import serial

from dzdesign.codegen.telemetry.frame import (
    FRAME_OCTETS,
    STATUS_BITS,
    STATUS_CALIBRATION,
    STATUS_RELEASED,
    Frame,
    FrameReader,
)
from dzdesign.codegen.telemetry.recording import Recording, recording_file, scalings_of
from dzdesign.command_line.cli import main
from dzdesign.commands.monitor import _nothing, _other_firmware
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.serial_port import open_port
from dzdesign.verify.toolchain.host_compiler import host_compiler
from tests.support.c2000_devices import DRIVERS
from tests.support.synthetic import needs_compiler

pytestmark = [
    needs_compiler,
    pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo-terminals"),
]
PROGRAM = Path(sys.executable).with_name("dzdesign")
WAIT_S = 30.0
#: Looks in a row, 20 ms apart, at which nothing waits to be read.
QUIET = 20
TICKS = 25
#: Of a pressure sensor of 4 to 20 mA, which spans 20 MPa: code of no pressure, and codes of its span.
ZERO, SPAN = 764, 3822 - 764


@dataclass
class Bench:
    """A firmware, a line to it, and the monitor that listens."""

    folder: Path
    firmware: Path
    device: Path
    origin: int
    master: int
    slave: int
    monitor: subprocess.Popen | None = None

    @property
    def output(self) -> Path:
        return self.folder / "ramp.csv"

    def listen(self, *options: str, firmware: Path | None = None, out: Any = subprocess.PIPE) -> None:
        """Start the monitor, and wait until it has the port."""
        command = [PROGRAM, "monitor", os.ttyname(self.slave), "--firmware", firmware or self.firmware, "--json"]
        self.monitor = subprocess.Popen(
            [*map(str, command), "-o", str(self.output), *options],
            stdout=out, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        first = self.monitor.stderr.readline()
        assert "listening" in first, first + self.monitor.stderr.read()

    def send(self, lines: list[str]) -> None:
        """Have the firmware's frame code write to the line; return when the monitor has read it all."""
        text = "\n".join(lines) + "\n"
        subprocess.run([self.device], input=text, stdout=self.master, text=True, check=True, timeout=WAIT_S)
        self._until_read()

    def _until_read(self) -> None:
        import fcntl
        import termios

        end = time.monotonic() + WAIT_S
        quiet = 0
        while quiet < QUIET:  # the kernel hands over in pieces: on a busy machine nothing may wait between two of them
            quiet = 0 if struct.unpack("i", fcntl.ioctl(self.slave, termios.FIONREAD, b"\0" * 4))[0] else quiet + 1
            assert time.monotonic() < end, "the monitor does not read"
            time.sleep(0.02)

    def stop(self) -> tuple[int, dict, str]:
        """Press Ctrl-C; return exit status, result, and what was said."""
        self.monitor.send_signal(signal.SIGINT)
        return self.end()

    def end(self) -> tuple[int, dict, str]:
        out, said = self.monitor.communicate(timeout=WAIT_S)
        return self.monitor.returncode, json.loads(out or "{}"), said

    def frame(self, index: int, **changes: int) -> str:
        values = Frame(
            ticks=TICKS * (index + 1), origin=self.origin, u_adc=index % 4096, p_a_adc=1000, p_b_adc=795, beta=1 << 15,
            compare_a=2 * index, compare_b=0, status=STATUS_RELEASED,
        )  # fmt: skip
        return "frame " + " ".join(str(getattr(replace(values, **changes), name)) for name in Frame.__slots__)


@pytest.fixture
def bench(firmware_folder, tmp_path):
    device = tmp_path / "device"
    sources = [str(firmware_folder / "f28335" / "dz_frame.c"), str(DRIVERS / "frames.c")]
    subprocess.run([host_compiler(), "-std=c99", f"-I{firmware_folder / 'f28335'}", *sources, "-o", device], check=True)
    place = tmp_path / "recordings"
    place.mkdir()
    master, slave = os.openpty()
    bench = Bench(place, firmware_folder, device, scalings_of(firmware_folder).origin, master, slave)
    yield bench
    if bench.monitor and bench.monitor.poll() is None:
        bench.monitor.kill()
        bench.monitor.communicate()
    for end in (bench.master, bench.slave):
        if end >= 0:
            os.close(end)


def table(path: Path) -> np.ndarray:
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == "time_s,u_V,pA_MPa,pB_MPa,uO_V,beta,compare_a,compare_b,status"
    return np.array([line.split(",") for line in lines[1:]], dtype=float)


@pytest.mark.slow
def test_good_frames_become_rows_in_units(bench):
    bench.listen()
    bench.send([bench.frame(index) for index in range(300)])
    status, result, _ = bench.stop()
    assert status == 0 and result["frames"] == 300 and result["lost"] == result["bad_crc"] == 0
    assert result["octets_skipped"] == result["restarts"] == 0 and result["faults"] == []
    rows, index = table(bench.output), np.arange(300)
    assert np.allclose(rows[:, 0], index / 100, atol=1e-9), "100 frames a second, from the first on"
    assert np.allclose(rows[:, 1], 10 * index / 4095, atol=1e-5)
    assert np.allclose(rows[:, 2], 20 * (1000 - ZERO) / SPAN, atol=1e-5)
    assert np.allclose(rows[:, 3], 20 * (795 - ZERO) / SPAN, atol=1e-5)
    assert np.allclose(rows[:, 4], 10 * 2 * index / 60000, atol=1e-5)
    assert np.all(rows[:, 5:] == np.column_stack([np.ones(300), 2 * index, 0 * index, np.full(300, STATUS_RELEASED)]))
    assert [path.name for path in bench.folder.iterdir()] == ["ramp.csv"]


@pytest.mark.slow
def test_what_solenoid_b_gets_is_written_as_its_own_and_negative(bench):
    bench.listen()
    bench.send([bench.frame(index, compare_a=0, compare_b=6 * index) for index in range(20)])
    assert bench.stop()[0] == 0
    rows, index = table(bench.output), np.arange(20)
    assert np.allclose(rows[:, 4], -10 * 6 * index / 60000, atol=1e-5)
    assert np.all(rows[:, 6] == 0) and np.all(rows[:, 7] == 6 * index)


@pytest.mark.slow
def test_garbage_cut_frames_and_bad_crcs_are_passed_over_and_counted(bench):
    lines = [bench.frame(index) for index in range(50)]
    lines[10] = lines[10].replace("frame", "cut 11")
    lines[20] = lines[20].replace("frame", "flip 13")
    lines[21] = lines[21].replace("frame", "flip 23")
    lines[30] = "raw " + "a55a0316" + "5a" * 9
    lines[40] = "raw " + random.Random(1).randbytes(100).replace(b"\xa5", b"\0").hex()
    bench.listen()
    bench.send(lines)
    status, result, _ = bench.stop()
    assert status == 0 and result["frames"] == 45 and result["lost"] == 5
    assert result["bad_crc"] == 4, "the cut one, the two with a wrong bit and the false beginning"
    assert result["octets_skipped"] == 11 + 2 * FRAME_OCTETS + 13 + 100
    kept = [index for index in range(50) if index not in (10, 20, 21, 30, 40)]
    assert np.allclose(table(bench.output)[:, 0], np.array(kept) / 100)
    assert "45 frames, 5 lost, 4 with a wrong CRC" in bench.output.read_text()


@pytest.mark.slow
def test_the_count_of_periods_wraps_and_a_reset_is_told(bench):
    ticks = [(2**32 - 3 * TICKS + TICKS * step) % 2**32 for step in range(6)]
    lines = [bench.frame(0, ticks=count) for count in (*ticks, TICKS, 2 * TICKS)]
    bench.listen()
    bench.send(lines)
    _, result, _ = bench.stop()
    assert result["restarts"] == 1 and result["lost"] == 0
    assert np.allclose(table(bench.output)[:, 0], np.arange(8) / 100)


@pytest.mark.slow
def test_an_output_that_is_held_low_is_zero_and_faults_are_named(bench):
    bench.listen()
    bench.send([bench.frame(500), bench.frame(501, status=0), bench.frame(502, status=0x0103)])
    _, result, _ = bench.stop()
    assert list(table(bench.output)[:, 4] > 0) == [True, False, False]
    assert result["faults"] == ["no usable sample in time", "trip input went low", STATUS_BITS[0x0100]]


@pytest.mark.slow
def test_identify_reads_the_recording_with_the_flow_meters_column(bench):
    up = np.arange(0, 4096, 3)
    codes = np.concatenate([up, up[::-1]])
    frames = [bench.frame(i, u_adc=int(c), compare_a=int(c) * 14) for i, c in enumerate(codes)]
    bench.listen()
    bench.send(frames)
    assert bench.stop()[0] == 0
    lines = bench.output.read_text().splitlines()
    flow = np.clip(4.0 * (10 * codes / 4095 - 5.4), 0, None)
    rows = iter(flow)
    joined = [
        line if line.startswith("#") else line + (",Q_Lmin" if line.startswith("time_s") else f",{next(rows):.4f}")
        for line in lines
    ]
    bench.output.write_text("\n".join(joined) + "\n")
    test = read_ramp_file(bench.output)
    assert test.time.size == codes.size and np.allclose(np.diff(test.time), 0.01)
    assert np.allclose(test.u, 10 * codes / 4095, atol=1e-5)
    assert np.allclose(test.dp, 20e6 * 205 / SPAN, atol=20.0)
    output = read_ramp_file(bench.output, columns={"u": "uO_V"})
    assert np.allclose(output.u, 10 * 14 * codes / 60000, atol=1e-5)
    done = subprocess.run(
        [PROGRAM, "identify", bench.output, "-o", bench.folder / "valve.json", "--json"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    (found,) = json.loads(done.stdout)["sides"]["positive"]["tests"]
    assert found["u_knee_rising_V"] == pytest.approx(5.4, abs=0.01)


@pytest.mark.slow
def test_seconds_end_the_recording(bench):
    bench.listen("--seconds", "1.5")
    bench.send([bench.frame(index) for index in range(20)])
    status, result, _ = bench.end()
    assert status == 0 and result["frames"] == 20


@pytest.mark.slow
def test_a_line_that_breaks_leaves_what_came_and_status_1(bench):
    bench.listen()
    bench.send([bench.frame(index) for index in range(20)])
    for name in ("slave", "master"):
        os.close(getattr(bench, name))
        setattr(bench, name, -1)
    status, result, said = bench.end()
    assert status == 1 and result["frames"] == 20 and "the port broke" in said
    assert len(table(bench.output)) == 20


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_what_asks_it_to_end_ends_the_recording_as_ctrl_c_does(bench, number):
    bench.listen()
    bench.send([bench.frame(index) for index in range(20)])
    bench.monitor.send_signal(number)
    status, result, _ = bench.end()
    assert status == 0 and result["frames"] == 20 and len(table(bench.output)) == 20


@pytest.mark.slow
def test_a_recording_whose_count_can_t_be_printed_is_named(bench):
    with open("/dev/full", "w") as full:
        bench.listen(out=full)
    bench.send([bench.frame(index) for index in range(20)])
    status, _, said = bench.stop()
    assert status == 2 and f"written before that: '{bench.output}'" in said and len(table(bench.output)) == 20


@pytest.mark.slow
def test_a_kill_leaves_every_frame_that_came_in_whole_lines(bench):
    bench.listen()
    bench.send([bench.frame(index) for index in range(50)])
    bench.monitor.kill()
    bench.monitor.communicate()
    assert len(table(bench.output)) == 50 and bench.output.read_bytes().endswith(b"\n")


def test_a_full_disk_leaves_whole_lines(tmp_path, monkeypatch):
    real, room = os.write, [25]

    def write(descriptor: int, data: bytes) -> int:
        if not room[0]:
            raise OSError(28, "No space left on device")
        taken = real(descriptor, data[: room[0]])
        room[0] -= taken
        return taken

    with recording_file(tmp_path / "ramp.csv") as file:
        monkeypatch.setattr(os, "write", write)
        file.write("time_s,u_V\n0,1\n")
        with pytest.raises(InputError, match="No space left"):
            file.write("1,2\n2,3\n3,4\n")
        monkeypatch.undo()
    assert (tmp_path / "ramp.csv").read_text() == "time_s,u_V\n0,1\n1,2\n2,3\n"


@pytest.mark.slow
def test_two_monitors_do_not_share_a_file(bench, refused):
    bench.listen()
    master, slave = os.openpty()
    try:
        said = refused(os.ttyname(slave), "--firmware", bench.firmware, "-o", bench.output)
    finally:
        os.close(master)
        os.close(slave)
    assert f"'{bench.output}' exists" in said and "-o" in said
    bench.send([bench.frame(index) for index in range(30)])
    assert bench.stop()[1]["frames"] == 30 and len(table(bench.output)) == 30


@pytest.mark.parametrize("kind", ["file", "folder", "pipe", "link that dangles", "another recording"])
def test_nothing_that_exists_is_recorded_into(tmp_path, kind):
    place = tmp_path / "ramp.csv"
    with contextlib.ExitStack() as stack:
        if kind == "another recording":
            stack.enter_context(recording_file(place))
        else:
            {"file": place.touch, "folder": place.mkdir, "pipe": lambda: os.mkfifo(place)}.get(
                kind, lambda: place.symlink_to("gone.csv")
            )()
        with pytest.raises(InputError, match="exists"), recording_file(place):
            pass
        assert os.path.lexists(place)
    assert os.path.lexists(place) == (kind != "another recording"), "one into which nothing came goes again"


@pytest.mark.parametrize("first", [TICKS, 2**32 - 2 * TICKS], ids=["at the start", "around the wrap"])
def test_a_doubled_frame_is_no_restart(firmware_folder, first):
    recording = Recording(scalings_of(firmware_folder))
    lines = [recording.add(frame_at(first + TICKS * step)) for step in (0, 0, 1, 1, 1, 2, 3, 3, 4)]
    assert [bool(line) for line in lines] == [True, False, True, False, False, True, True, False, True]
    assert (recording.frames, recording.doubled, recording.restarts, recording.lost) == (5, 4, 0, 0)
    assert recording.duration_s == pytest.approx(0.04)


def test_a_firmware_that_resets_itself_over_and_over_is_no_doubled_frame(firmware_folder):
    recording = Recording(scalings_of(firmware_folder))
    for ticks in (TICKS, 2 * TICKS) * 3:
        recording.add(frame_at(ticks))
    recording.add(replace(frame_at(2 * TICKS), u_adc=7))
    assert recording.restarts == 3 and recording.doubled == 0


def frame_at(ticks: int) -> Frame:
    return Frame(
        ticks=ticks % 2**32, origin=0, u_adc=0, p_a_adc=ZERO, p_b_adc=ZERO, beta=0, compare_a=0, compare_b=0,
        status=STATUS_RELEASED,
    )  # fmt: skip


def test_a_port_is_opened_without_a_reset_of_the_board(monkeypatch):
    """DTR and RTS are wired to reset and boot mode on many boards."""
    states = []
    monkeypatch.setattr(serial.Serial, "open", lambda port: states.append((port.port, port.dtr, port.rts)))
    open_port("/dev/ttyUSB0", 115200, 0.1)
    assert states == [("/dev/ttyUSB0", False, False)]


@pytest.mark.slow
def test_another_firmware_is_refused(bench):
    bench.listen()
    bench.send([bench.frame(0, origin=bench.origin ^ 1)])
    status, _, said = bench.end()
    assert status == 2 and "not " + f"{bench.origin:04x}" in said and not bench.output.exists()


def test_a_drive_without_a_valid_block_is_no_other_firmware(firmware_folder):
    """It names no compensator, so that none that could be given would be its own."""
    recording = Recording(scalings_of(firmware_folder))
    frame = Frame(
        ticks=TICKS, origin=0, u_adc=0, p_a_adc=ZERO, p_b_adc=ZERO, beta=0, compare_a=0, compare_b=0,
        status=STATUS_CALIBRATION,
    )  # fmt: skip
    with pytest.raises(InputError, match=r"no valid calibration block.*dzdesign load"):
        _other_firmware(frame, recording)
    recording.add(frame)
    assert "no valid calibration block" in _other_firmware(frame, recording), "of a recording that broke off"


@pytest.mark.slow
def test_a_line_without_frames_is_status_2_and_leaves_no_file(bench):
    bench.listen("--seconds", "0.1")
    status, _, words = bench.end()
    assert status == 2 and "nothing" in words and list(bench.folder.iterdir()) == []


@pytest.mark.parametrize(("octets", "said"), [("00ff" * 40, "check --baud"), ("a55a0207", "one version")])
def test_a_line_with_something_else_on_it_says_what_to_check(octets, said):
    reader = FrameReader()
    assert list(reader.feed(bytes.fromhex(octets))) == []
    assert said in str(_nothing("COM5", 115200, reader))


@pytest.fixture
def refused(capsys):
    def refused(*words: str | Path) -> str:
        assert main(["monitor", *map(str, words)]) == 2
        out, err = capsys.readouterr()
        assert err.count("\n") == 1 and out == "", err
        return err

    return refused


def test_a_bad_port_option_or_place_is_one_sentence(bench, refused):
    port, output = os.ttyname(bench.slave), ["-o", bench.output]
    firmware = ["--firmware", bench.firmware]
    assert "can't be opened" in refused("/dev/no-such-port", *firmware, *output)
    assert "can't be opened" in refused(bench.firmware / "compensator.json", *firmware, *output)
    assert "--baud is 'fast'" in refused(port, *firmware, *output, "--baud", "fast")
    assert "--seconds is '-1'" in refused(port, *firmware, *output, "--seconds=-1")
    assert "does not exist" in refused(port, "--firmware", bench.folder, *output)
    bench.output.write_text("time_s\n1\n")
    assert "not to be had again" in refused(port, *firmware, *output)
    assert bench.output.read_text() == "time_s\n1\n"


@pytest.mark.slow
def test_a_port_in_use_is_refused(bench, refused):
    bench.listen()
    other = bench.folder / "other.csv"
    assert "can't be opened" in refused(os.ttyname(bench.slave), "--firmware", bench.firmware, "-o", other)


def test_a_firmware_without_telemetry_is_refused(bench, monkeypatch):
    from dzdesign.codegen.f28335.target import TARGET
    from dzdesign.codegen.telemetry import recording as telemetry_record

    monkeypatch.setattr(telemetry_record, "target_named", lambda name: replace(TARGET, link=None))
    with pytest.raises(InputError, match="no telemetry"):
        scalings_of(bench.firmware)


def test_a_loaded_block_has_the_scalings_of_its_own_compensator(bench, tmp_path):
    document = json.loads((bench.firmware / "compensator.json").read_text("utf-8"))
    document["made_from"][0]["sha256"] = "0" * 64
    other = tmp_path / "other.json"
    other.write_bytes(to_json(document).encode())
    found = scalings_of(bench.firmware, other)
    assert found.origin != bench.origin and found.origin == int(sha256_of(other.read_bytes())[:4], 16)
    assert found.link == scalings_of(bench.firmware).link
