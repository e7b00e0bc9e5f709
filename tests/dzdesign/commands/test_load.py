"""`dzdesign load` over a pseudo-terminal, against the firmware's own code in a program whose supply can go."""

import contextlib
import json
import os
import re
import subprocess
import threading
import tty
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.command_line.cli import main
from dzdesign.core.errors import RequirementError
from dzdesign.serial_port import PortLine, open_port
from tests.support.block_reader import hex_text
from tests.support.documented_commands import agrees
from tests.support.loading.bench import SLOTS, build_drive
from tests.support.loading.device import Device, build_device, firmware_files
from tests.support.loading.files import COMPILER, blocks, drive_files, refused_blocks
from tests.support.paths import ROOT

pytestmark = [
    pytest.mark.skipif(not COMPILER, reason="no C compiler (cc, gcc or clang) on the path"),
    pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo-terminals"),
]
BAUD = 115_200
OLD, NEW = blocks()[:2]
#: Words that are erased, twice, and written before the mark: the mark is the next.
MARK = len(OLD) + 4 + len(OLD) // 2


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return build_drive(COMPILER, drive_files(), tmp_path_factory.mktemp("drive"), program=True)


@dataclass
class OnALine:
    """A drive with its memory in a file, on one end of a pseudo-terminal."""

    program: Path
    memory: Path
    master: int
    slave: int
    running: list[subprocess.Popen] = field(default_factory=list)

    @property
    def port(self) -> str:
        return os.ttyname(self.slave)

    def start(self, *words: object) -> subprocess.Popen:
        """Switch the supply on; `words` say when it goes, and what the drive does."""
        self.stop()
        started = subprocess.Popen(
            [self.program, self.memory, *map(str, words)], stdin=self.master, stdout=self.master, stderr=subprocess.PIPE
        )
        self.running.append(started)
        assert started.stderr.readline().startswith(b"ready")
        return started

    def stop(self) -> None:
        for each in self.running:
            each.kill()
            each.wait()
            each.stderr.close()
        self.running.clear()


@pytest.fixture
def drive(program, tmp_path):
    memory = tmp_path / "memory"
    slot = b"\xff" * (len(OLD) + 4)
    memory.write_bytes(SLOTS * slot + OLD)
    on_a_line = OnALine(program, memory, *os.openpty())
    yield on_a_line
    on_a_line.stop()
    os.close(on_a_line.master)
    os.close(on_a_line.slave)


def block_file(folder: Path, block: bytes = NEW, name: str = "valve.bin") -> Path:
    path = folder / name
    if name.endswith(".hex"):
        path.write_text(hex_text((0x330000, block)))
    else:
        path.write_bytes(block)
    return path


def load(capsys, *words: object) -> tuple[int, dict, str]:
    """Run the command; return exit status, result, and what was said."""
    status = main(["load", *map(str, words), "--json"])
    out, said = capsys.readouterr()
    return status, json.loads(out or "{}"), said


def crc_of(block: bytes) -> str:
    return f"{int.from_bytes(block[-4:], 'little'):08x}"


def test_a_block_is_loaded_and_read_back_and_outlives_a_restart(drive, tmp_path, capsys):
    drive.start()
    status, held, _ = load(capsys, "--port", drive.port)
    assert status == 0 and held["block"] == "linked with the firmware" and held["serial"] == "SN-0"
    status, held, said = load(capsys, block_file(tmp_path, name="valve.hex"), "--port", drive.port)
    assert status == 0 and "loading" in said
    assert held["serial"] == "SN-1" and held["crc32"] == crc_of(NEW) and held["block"] == "loaded, copy 0"
    assert held["refuses_now"] is held["last_load"] is None and held["bad_frames"] == 0
    drive.start()
    assert main(["load", "--port", drive.port]) == 0
    out = capsys.readouterr().out
    assert "Serial number: SN-1" in out and crc_of(NEW) in out


def test_the_page_shows_what_is_printed(drive, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    block_file(tmp_path, name="valve.hex")
    drive.start()
    page = (ROOT / "docs" / "howto" / "load-block.md").read_text("utf-8")
    shown = re.findall(r"^    dzdesign (load [^\n]*)\n\n```text\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(shown) == 2
    for words, output in shown:
        assert main(words.replace("COM5", drive.port).split()) == 0
        assert agrees(output, capsys.readouterr().out.strip("\n"))


@pytest.mark.parametrize("words", [("octets", 900), ("words", len(OLD) + 100), ("words", MARK)])
def test_a_drive_whose_supply_goes_keeps_a_whole_block(drive, tmp_path, capsys, monkeypatch, words):
    monkeypatch.setattr("dzdesign.codegen.loading.session.TRIES", 2)
    drive.start(*words).stderr.flush()
    status, _, said = load(capsys, block_file(tmp_path), "--port", drive.port)
    assert status == 1 and "stopped answering" in said
    drive.start()
    status, held, _ = load(capsys, "--port", drive.port)
    assert status == 0 and held["crc32"] in ((crc_of(OLD), crc_of(NEW)) if words[1] == MARK else (crc_of(OLD),))
    assert load(capsys, block_file(tmp_path), "--port", drive.port)[1]["crc32"] == crc_of(NEW)


def test_a_block_of_another_serial_number_than_the_valves_is_not_loaded(drive, tmp_path, capsys):
    drive.start()
    file, port = block_file(tmp_path), ("--port", drive.port)
    status, _, said = load(capsys, file, *port, "--serial", "SN-0")
    assert status == 2 and "'SN-1'" in said and "'SN-0'" in said
    status, held, said = load(capsys, *port, "--serial", "SN-1")
    assert status == 1 and held["serial"] == "SN-0" and "'SN-0'" in said, "the drive holds what it held"
    status, held, _ = load(capsys, file, *port, "--serial", "SN-1")
    assert (status, held["serial"], held["serial_before"]) == (0, "SN-1", "SN-0")
    assert load(capsys, *port, "--serial", "SN-1")[0] == 0


@pytest.mark.parametrize(("words", "said"), [(("driving", 1), "still drives"), (("command", 1), "not zero")])
def test_a_drive_that_is_not_at_rest_refuses(drive, tmp_path, capsys, words, said):
    drive.start(*words)
    status, _, error = load(capsys, block_file(tmp_path), "--port", drive.port)
    assert status == 1 and said in error and error.count("does not hold") == 1
    status, held, _ = load(capsys, "--port", drive.port)
    assert status == 0 and held["crc32"] == crc_of(OLD) and said in held["refuses_now"]


def test_a_block_that_the_drive_must_not_have_is_refused_and_nothing_changes(drive, tmp_path, capsys):
    drive.start()
    before = drive.memory.read_bytes()
    other_shape = block_file(tmp_path, refused_blocks()[1])
    status, _, error = load(capsys, other_shape, "--port", drive.port)
    assert status == 2 and "two solenoids" in error
    for change, said in (
        ({"compare_max": 40_000}, "compare value 40000, the amplifier's has 60000"),
        ({"code_max": 1023}, "1023, the amplifier's has 4095"),
        ({"sample_Hz": 1000}, "1000, the amplifier's has 1250"),
        ({"tick_Hz": 5000}, "5000, the amplifier's has 2500"),
        ({"beta_step": 128}, "128, the amplifier's has 64"),
    ):
        other = block_file(tmp_path, pack(replace(unpack(NEW), **change)))
        status, _, error = load(capsys, other, "--port", drive.port)
        assert status == 2 and said in error, error
    assert drive.memory.read_bytes() == before, "not even erased"
    status, _, error = load(capsys, block_file(tmp_path, refused_blocks()[0]), "--port", drive.port)
    assert status == 1 and "of the law outside" in error
    assert load(capsys, "--port", drive.port)[1]["crc32"] == crc_of(OLD)


def test_a_slow_memory_is_waited_for(drive, tmp_path, capsys):
    """Erasing takes as many passes of the main loop, each a millisecond or more: longer than for an answer."""
    drive.start("busy", 600)
    status, held, _ = load(capsys, block_file(tmp_path), "--port", drive.port)
    assert status == 0 and held["crc32"] == crc_of(NEW) and held["repeated_requests"] > 0


def test_bad_input_is_one_sentence_and_status_2(drive, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("dzdesign.codegen.loading.session.TRIES", 1)
    cut, damaged = block_file(tmp_path, NEW[:-2], "cut.bin"), block_file(tmp_path, NEW[:-1] + b"?", "damaged.bin")
    for words, said in (
        ((cut, "--port", drive.port), "it is cut"),
        ((damaged, "--port", drive.port), "CRC-32"),
        ((tmp_path / "no.bin", "--port", drive.port), "does not exist"),
        ((block_file(tmp_path, name="valve.s19"), "--port", drive.port), "ends with '.s19'"),
        ((tmp_path, "--port", drive.port), "is a folder"),
        ((block_file(tmp_path), "--port", "/dev/no-such-port"), "there is none of this name"),
        ((block_file(tmp_path), "--port", tmp_path), "it is a folder"),
        ((block_file(tmp_path), "--port", tmp_path / "cut.bin"), "it is no serial port"),
        ((block_file(tmp_path), "--port", drive.port, "--baud", "fast"), "--baud is 'fast'"),
        ((block_file(tmp_path), "--port", drive.port), "GPIO28"),  # nobody is there
    ):
        status, _, error = load(capsys, *words)
        assert status == 2 and said in error and error.count("\n") == 1, error


def test_a_port_that_breaks_is_a_sentence(drive):
    with open_port(drive.port, BAUD, 0.1) as port:
        line = PortLine(port)
        os.dup2(os.open(os.devnull, os.O_RDWR), drive.master)  # the other end is gone
        with pytest.raises(RequirementError, match="the port broke"):
            line.read(0.1)


@pytest.mark.slow
def test_the_whole_firmware_takes_a_block_from_the_command(tmp_path_factory, tmp_path, capsys):
    """Interrupt, main loop, core, telemetry, on the model of the device; its time goes by about as fast as ours."""
    device = Device(build_device(firmware_files(real_core=True), tmp_path_factory.mktemp("device")), OLD)
    device.tell(f"command {unpack(OLD).command_zero}")
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    over = threading.Event()

    def go_on() -> None:
        while not over.wait(0.003):
            with contextlib.suppress(BlockingIOError):
                device.tell(f"send {os.read(master, 4096).hex()}")
            device.run(10)
            os.write(master, device.take())

    running = threading.Thread(target=go_on)
    running.start()
    try:
        status, held, _ = load(capsys, block_file(tmp_path, name="valve.hex"), "--port", os.ttyname(slave))
        assert status == 0 and held["serial"] == "SN-1" and held["crc32"] == crc_of(NEW)
        assert not held["kept_without_supply"] and held["last_load"] is None
    finally:
        over.set()
        running.join(20)
        device.end()
        os.close(master)
        os.close(slave)
