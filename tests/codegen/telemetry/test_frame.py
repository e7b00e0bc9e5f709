"""The telemetry: one layout in Python and in C, consistent frames whatever comes between, and what it costs."""

import random
import re
import shutil
import subprocess
from dataclasses import astuple, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from dzdesign.codegen.f28335 import target as f28335
from dzdesign.codegen.f28335.target import LINK
from dzdesign.codegen.telemetry.frame import (
    FRAME_OCTETS,
    STATUS_RELEASED,
    TICKS_MODULUS,
    Frame,
    FrameReader,
    beta_factor,
    crc_of,
)
from dzdesign.codegen.telemetry.recording import columns_of
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.metering_edge import metering_edge
from tests.support.attacked_firmware import edit
from tests.support.c2000_devices import DRIVERS, MODELS, compiled, model_of, model_options, run, texts_of, write
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror")
ORIGIN = 0x1234  # of c2000_devices.texts_of


@pytest.fixture
def firmware(tmp_path):
    """The folder of the target's generated files, for a test to edit them."""
    write(texts_of("f28335"), tmp_path)
    return tmp_path


def built(folder: Path, *options: str) -> Path:
    """Compile the generated C with the model of the device."""
    ours = [folder / name for name in ("dz_hardware.c", "dz_isr.c", "dz_telemetry.c", "dz_frame.c")]
    model = model_of("f28335", "core.c", "driver.c")
    flags = [*options, "-DSTAND_IN_CORE", *model_options("f28335", folder)]
    compiled(*flags, *ours, folder / "dz_user.c", *model, "-lm", "-o", folder / "driver")
    return folder / "driver"


def frames_program(firmware) -> Path:
    """The generated frame code with a main() that writes what the lines of its stdin say."""
    program = firmware / "frames"
    compiled(f"-I{firmware}", firmware / "dz_frame.c", DRIVERS / "frames.c", "-o", program)
    return program


def octets_of(program: Path, lines: list[str]) -> bytes:
    text = "\n".join(lines).encode() + b"\n"
    return subprocess.run([program], input=text, capture_output=True, check=True).stdout


def numbers(frame: Frame) -> str:
    return " ".join(map(str, astuple(frame)))


def random_frames(count: int, seed: int = 7) -> list[Frame]:
    rng = random.Random(seed)
    return [Frame(ticks=rng.randrange(2**32), **{name: rng.randrange(2**16) for name in NAMES}) for _ in range(count)]


NAMES = ("origin", "u_adc", "p_a_adc", "p_b_adc", "p_c_adc", "beta", "compare_a", "compare_b", "status")


def read(octets: bytes) -> tuple[list[Frame], FrameReader]:
    reader = FrameReader()
    return list(reader.feed(octets)), reader


def test_the_crc_is_the_catalogued_one():
    """CRC-16/IBM-3740 has the check value 29B1h."""
    assert crc_of(b"123456789") == 0x29B1


@pytest.mark.parametrize("pair", ["AC", "CB", "BC", "CA"])
def test_a_recording_of_three_pressures_names_the_ports_of_both_edges(pair):
    signals = replace(variant("three pressures").signals, negative_pair=pair)
    ports = [name.partition("_")[0] for name in columns_of(SimpleNamespace(signals=signals))[2:5]]
    edge, inputs = metering_edge(ports), dict(zip("ABC", ports, strict=True))
    assert edge.positive == (inputs["A"], inputs["B"])
    assert edge.negative == tuple(inputs[name] for name in pair)


@needs_compiler
def test_python_reads_what_the_firmware_packs(firmware):
    program = frames_program(firmware)
    largest = Frame(ticks=2**32 - 1, **dict.fromkeys(NAMES, 0xFFFF))
    sent = [*random_frames(200), largest, Frame(ticks=0, **dict.fromkeys(NAMES, 0))]
    octets = octets_of(program, [f"frame {numbers(frame)}" for frame in sent])
    assert len(octets) == FRAME_OCTETS * len(sent)
    found, reader = read(octets)
    assert found == sent and reader.skipped == reader.bad_crc == 0


@needs_compiler
def test_frames_are_found_between_garbage_cuts_and_errors_in_pieces_of_any_size(firmware):
    sent = random_frames(60)
    rng = random.Random(3)
    lines, good = [], []
    for index, frame in enumerate(sent):
        kind = index % 6
        if kind == 1:
            lines.append("raw " + rng.randbytes(rng.randrange(1, 40)).hex())
        if kind == 2:
            lines.append("raw a5a55aa55a" + rng.choice(["", "03", "0316", "0114"]))
        lines.append({4: f"cut {rng.randrange(1, FRAME_OCTETS)} ", 5: f"flip {rng.randrange(2, FRAME_OCTETS)} "}
                     .get(kind, "frame ") + numbers(frame))  # fmt: skip
        good += [frame] if kind < 4 else []
    octets = octets_of(frames_program(firmware), lines)
    for size in (1, 7, FRAME_OCTETS, 10_000):
        reader = FrameReader()
        found = [frame for at in range(0, len(octets), size) for frame in reader.feed(octets[at : at + size])]
        assert found == good
        assert reader.bad_crc >= 10 and reader.skipped >= 10 * FRAME_OCTETS
        assert reader.frames * FRAME_OCTETS + reader.skipped <= len(octets)


def telemetry(program: Path, periods: int, *words: str) -> dict[str, str]:
    lines = run(program, "telemetry", str(periods), *words)
    facts = dict(line.partition(" ")[::2] for line in lines)
    return {**facts, "services": int(facts["services"])}


def check_stream(program: Path) -> None:
    """28 s, beyond the wrap of the interrupt's own 16-bit count: every frame, in time, of one moment."""
    periods = 70_000
    facts = telemetry(program, periods)
    frames, reader = read(bytes.fromhex(facts["line"]))
    assert facts["lost"] == facts["dropped"] == "0" and reader.skipped == 0
    assert int(facts["sent"]) == periods // LINK.frame_ticks, "100 a second"
    assert len(frames) >= int(facts["sent"]) - 1, "the last one may still be on its way"
    assert [frame.ticks for frame in frames] == [LINK.frame_ticks * n for n in range(1, len(frames) + 1)]
    for frame in frames:
        sample = frame.ticks // 2  # of the model's 1250 a second
        assert (frame.u_adc, frame.p_a_adc, frame.p_b_adc) == (100 * (sample % 41), 1, 2)
        assert frame.compare_a == frame.u_adc + 10 * frame.p_a_adc + 100 * frame.p_b_adc, "of one moment"
        assert frame.beta == 3 * frame.p_a_adc + 7 * frame.p_b_adc and frame.origin == ORIGIN
    assert frames[0].status == STATUS_RELEASED | 0x0500, "with the stand-in's status of a command and these pressures"


def check_blocked_line(program: Path) -> None:
    """From one half on the transmitter stands still: frames are dropped; interrupt and watchdog's service go on."""
    facts = telemetry(program, 5_000, "B")
    assert int(facts["dropped"]) >= 98 and int(facts["sent"]) + int(facts["dropped"]) == 200
    assert facts["ticks"] == "5000" and facts["services"] >= 5_000 and facts["lost"] == "0"


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("check", [check_stream, check_blocked_line])
def test_telemetry_on_the_device_model(firmware, check):
    check(built(firmware))


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("old", "new", "check"),
    [
        ("< DZ_SCI_FIFO_OCTETS", "< 31u", check_stream),
        ("< DZ_SCI_FIFO_OCTETS", "< 31u", check_blocked_line),
        ("(dz_telemetry.at < DZ_FRAME_OCTETS) || (read", "(read", check_blocked_line),
        ("SCICTL1.all = SCI_RUNS", "SCICTL1.all = SCI_TRANSMITS", check_stream),
        ("SCIHBAUD = DZ_SCI_BRR >> 8", "SCIHBAUD = DZ_SCI_BRR", check_stream),
        ("    dz_telemetry.ticks += (uint16_t)(ticks", "    dz_telemetry.ticks = (uint16_t)(ticks", check_stream),
        ("dz_beta(state->p_a_adc, state->p_b_adc)", "dz_beta(state->p_b_adc, state->p_a_adc)", check_stream),
        ("(uint16_t)(dz_telemetry.due + DZ_FRAME_TICKS)", "ticks + 1u", check_stream),
    ],
)
def test_a_seeded_fault_of_the_telemetry_is_caught(firmware, old, new, check):
    edit(firmware, "dz_telemetry.c", old, new)
    program = built(firmware, "-Wno-conversion")
    with pytest.raises(AssertionError):
        check(program)


def preempted_frames(firmware) -> list[Frame]:
    """Frames of the main loop with the interrupt just before each of its looks at the state, and without it."""
    source = firmware / "dz_telemetry.c"
    text = source.read_text(encoding="utf-8")
    looks = text.count("dz_state.")
    assert looks >= 9
    text = text.replace("dz_state.", "device_state()->")
    text = text.replace("static uint16_t read_state", "volatile struct dz_state *device_state(void);\n$&", 1)
    source.write_text(text.replace("$&", "static uint16_t read_state"), encoding="utf-8")
    program = built(firmware)
    return [f for look in range(2 * looks) for f in read(bytes.fromhex(preempted(program, look)))[0]]


def preempted(program: Path, look: int) -> str:
    return next(line.split()[1] for line in run(program, "preempt", str(look)) if line.startswith("line "))


def torn(frames: list[Frame]) -> list[Frame]:
    return [f for f in frames if f.compare_a != f.u_adc + 10 * f.p_a_adc + 100 * f.p_b_adc]


@pytest.mark.slow
@needs_compiler
def test_a_frame_is_of_one_moment_wherever_the_interrupt_comes(firmware):
    frames = preempted_frames(firmware)
    assert len(frames) >= 18 and torn(frames) == []
    assert {frame.ticks for frame in frames} == {25, 27}, "the second reading is two periods younger"


@pytest.mark.slow
@needs_compiler
def test_a_state_read_once_is_torn(firmware):
    edit(
        firmware,
        "dz_telemetry.c",
        "(dz_state.ticks == copy->ticks) ? 1u : 0u",
        "(dz_state.ticks == copy->ticks) ? 1u : 1u",
    )
    assert torn(preempted_frames(firmware))


def test_the_factor_of_beta_is_exact_where_it_counts_and_refused_where_none_is(wording):
    rng = random.Random(5)
    for _ in range(200):
        unit = rng.randrange(1, 2**10) << rng.randrange(10, 21)
        largest = 2 * unit - 1  # beta stays below 2
        factor, shift = beta_factor(unit, largest)
        near = [k * unit // 2**15 + step for k in rng.choices(range(2**16), k=20) for step in (-1, 0, 1)]
        for value in (0, largest, *(value for value in near if 0 <= value <= largest)):
            assert value * factor >> shift == (value << 15) // unit
    with wording.refusal(InputError):
        beta_factor(2**31 - 1, 2**31 - 1)


needs_avr = pytest.mark.skipif(
    not (shutil.which("avr-gcc") and shutil.which("simavr")), reason="no avr-gcc or no simavr on the path"
)


@needs_avr
def test_a_pass_costs_what_is_stated_and_packs_the_same_where_int_has_16_bits(firmware, example_firmware, tmp_path):
    folder = firmware
    core = tmp_path / "core"
    core.mkdir()
    for name in ("dz_comp.c", "dz_comp.h", "dz_calibration.h", "dz_valve.h", "dz_drive.h"):
        (core / name).write_text(example_firmware.files[f"core/{name}"])
    program = tmp_path / "a.elf"
    sources = [core / "dz_comp.c", folder / "dz_telemetry.c", folder / "dz_frame.c", DRIVERS / "telemetry_avr.c"]
    command = ["avr-gcc", "-mmcu=atmega1280", "-DF_CPU=16000000UL", "-std=gnu99", "-Wall", "-Wextra", "-Werror", "-O2"]
    command += ["-DSciaRegs=device_plain_sci"]
    command += [f"-I{core}", f"-I{folder}", f"-I{MODELS / 'f28335'}", *map(str, sources), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    command = ["simavr", "-m", "atmega1280", "-f", "16000000", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    facts = dict(re.findall(r"(pack|feed|idle|line) ([0-9A-F]+)", done.stdout + done.stderr))
    print(f"cycles on the AVR: packing {facts['pack']}, handing over {facts['feed']}, idle {facts['idle']}")
    assert 0 < int(facts["idle"]) < int(facts["feed"]) < int(facts["pack"])
    assert int(facts["pack"]) + int(facts["feed"]) <= f28335.FRAME_CYCLES
    (frame,), reader = read(bytes.fromhex(facts["line"]))
    assert reader.skipped == 0
    assert frame.ticks == (2**32 - 2**16 + 65530 + LINK.frame_ticks) % TICKS_MODULUS
    assert (frame.u_adc, frame.p_a_adc, frame.p_b_adc, frame.compare_a) == (4095, 1234, 900, 59999)
    assert frame.status == 0x000F | STATUS_RELEASED
    octets = octets_of(frames_program(firmware), [f"frame {numbers(frame)}"])
    assert octets.hex().upper() == facts["line"]
