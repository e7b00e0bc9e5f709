"""Whatever a file holds: a result, or one clear line; no traceback, no hang, no more memory than stated."""

import contextlib
import gzip
import itertools
import json
import os
import random
import signal
import sys
import threading
import time
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_file
from dzdesign.core.artefact_types import as_document
from dzdesign.core.documents import parse_document, read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.units import SI_UNIT, parse_quantity, si_factor
from dzdesign.design.compensator import Compensator
from dzdesign.design.signal_text import parse_signal
from dzdesign.identify.reading import binary_table, text_file
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.identify.reading.hostile_files import BINARIES, CSV, TEXTS, write
from tests.identify.reading.test_file_formats import GOOD

#: More of what is random: make fuzz, or this many times as many examples.
TIMES = int(os.environ.get("DZDESIGN_FUZZ", "1"))
SEED = int(os.environ.get("DZDESIGN_SEED", "1"))
#: A reader of these texts takes no more memory than this: eight times the largest of them.
TEXT_MEMORY = 800 << 20
#: No file of these tests takes longer to read, on a busy machine.
PATIENCE_S = 120.0
needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")


def outcome(call, *arguments, **keywords) -> str:
    """Return the one line with which it was refused, or nothing; anything else than these two fails the test."""
    begin = time.monotonic()
    try:
        call(*arguments, **keywords)
        return ""
    except InputError as error:
        return str(error)
    finally:
        assert time.monotonic() - begin < PATIENCE_S


def largest_memory(reset: bool = False) -> int:
    """Return the most memory that this process had since the last reset; 0 where the system does not say."""
    if sys.platform != "linux":
        return 0
    if reset:
        Path("/proc/self/clear_refs").write_text("5")
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) << 10 for line in status.splitlines() if line.startswith("VmHWM:"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*TEXTS, *BINARIES])
def test_a_hostile_recording(tmp_path, monkeypatch, name):
    monkeypatch.setattr(text_file, "FREE_BYTES", 1 << 22)  # a bomb is refused a little sooner
    path, (_, words) = write(name, tmp_path), {**TEXTS, **BINARIES}[name]
    text = name in TEXTS
    memory = largest_memory(reset=True)
    line = outcome(read_ramp_file, path)
    assert not text or largest_memory() - memory < TEXT_MEMORY
    assert not line or path.name in line
    assert words is None or words in line
    assert len(line) < 2000


@pytest.mark.slow
def test_the_reader_of_the_next_file_is_another_after_a_crash(tmp_path):
    (tmp_path / "ramp.mat").write_bytes(GOOD["mat 5"])
    assert "crashed, SIG" in outcome(read_ramp_file, write("MAT of cells in cells", tmp_path))
    assert read_ramp_file(tmp_path / "ramp.mat").u.size == 30


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux bounds the memory of a process")
def test_a_reader_that_wants_more_memory_than_its_share_is_refused(tmp_path):
    assert "Unable to allocate" in outcome(read_ramp_file, write("MAT of a huge cell", tmp_path))


@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
def test_a_reader_that_hangs_is_ended(tmp_path, monkeypatch):
    (tmp_path / "ramp.mat").write_bytes(GOOD["mat 5"])
    read_ramp_file(tmp_path / "ramp.mat")
    (reader,) = binary_table._reader(os.getpid())._processes
    os.kill(reader, signal.SIGSTOP)
    with monkeypatch.context() as patched:
        patched.setattr(binary_table, "PATIENCE_S", 0.5)
        assert "reading takes more than" in outcome(read_ramp_file, tmp_path / "ramp.mat")
    assert read_ramp_file(tmp_path / "ramp.mat").u.size == 30
    with pytest.raises(ProcessLookupError):
        os.kill(reader, 0)


def mutated(content: bytes, chance: random.Random) -> bytes:
    """Return content with bytes flipped, set, cut out, doubled, moved, or gone from some place on."""
    data = bytearray(content)
    for _ in range(chance.choice([1, 1, 2, 4, 8])):
        if len(data) < 16:
            break
        at, size = chance.randrange(len(data) - 8), chance.randrange(1, 64)
        piece = data[at : at + size]
        match chance.randrange(7):
            case 0:
                del data[at:]
            case 1:
                data[at] ^= 1 << chance.randrange(8)
            case 2:
                data[at] = chance.choice([0, 1, 127, 128, 255])
            case 3:
                data[at : at + 8] = chance.choice(
                    [b"\xff" * 8, bytes(8), b"\xff" * 3 + b"\x7f" + bytes(4), bytes(7) + b"\x40"]
                )
            case 4:
                del data[at : at + size]
            case 5:
                data[at:at] = piece
            case 6:
                data += piece
    return bytes(data)


#: Of every format as it should be; text in every dialect.
SOUND = {
    **GOOD,
    "csv": CSV,
    "csv.gz": gzip.compress(CSV, mtime=0),
    "csv with semicolons": CSV.replace(b",", b";").replace(b".", b","),
    "csv in quotes": b"\r\n".join(b'"' + line.replace(b",", b'","') + b'"' for line in CSV.split(b"\n")[:-1]),
    "csv with blanks": CSV.replace(b",", b" "),
}  # fmt: skip


@pytest.mark.parametrize("name", SOUND)
def test_a_damaged_recording(tmp_path, name):
    chance = random.Random(f"{SEED} {name}")
    path = tmp_path / ("ramp.csv" if "csv" in name else "ramp.mat")
    for number in range(5 * TIMES):
        path.write_bytes(mutated(SOUND[name], chance))
        line = outcome(read_ramp_file, path)
        assert not line or str(path) in line, f"seed {SEED}, number {number}"


# what is no file, or does not stay one


@needs_pipes
def test_a_pipe_with_a_name_is_refused(tmp_path):
    """It may have nobody at its other end: whoever opened it would wait for ever."""
    os.mkfifo(tmp_path / "pipe")
    for read in (read_ramp_file, lambda path: read_bytes(path, "plant file")):
        assert "is a device, a pipe or a socket, expected a file" in outcome(read, tmp_path / "pipe")


def poured(pieces) -> tuple[Path, threading.Thread]:
    """Return a pipe as a shell gives it, and the thread that writes into it."""
    end, start = os.pipe()

    def pour():
        with contextlib.suppress(BrokenPipeError), open(start, "wb", buffering=0) as out:
            for piece in pieces:
                out.write(piece)

    writer = threading.Thread(target=pour)
    writer.start()
    return Path(f"/dev/fd/{end}"), writer


@needs_pipes
@pytest.mark.parametrize("name", ["csv", "csv.gz", "mat 5", "parquet"])
def test_a_recording_through_a_pipe(name):
    pipe, writer = poured([SOUND[name]])
    assert read_ramp_file(pipe).u.size == 30
    writer.join()


@needs_pipes
def test_a_pipe_without_an_end(monkeypatch):
    monkeypatch.setattr("dzdesign.core.documents.MOST_PIPED", 1 << 22)
    pipe, writer = poured(itertools.repeat(b"1,2,3,4\n" * 10_000))
    assert "is a pipe with more than 4 MiB" in outcome(read_ramp_file, pipe)
    os.close(int(pipe.name))
    writer.join(timeout=10)
    assert not writer.is_alive()


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="this system has no such device")
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/urandom", "/dev/null", "/dev/tty"])
def test_a_device(tmp_path, device):
    (tmp_path / "link").symlink_to(device)
    assert "is a device, a pipe or a socket, expected a file" in outcome(read_ramp_file, tmp_path / "link")
    assert "is a device, a pipe or a socket, expected a file" in outcome(read_bytes, Path(device), "plant file")


def test_links_in_a_loop_and_folders(tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "folder").symlink_to(tmp_path)
    assert "can't be read" in outcome(read_ramp_file, tmp_path / "loop")
    assert "is a folder" in outcome(read_ramp_file, tmp_path / "folder")


@pytest.mark.parametrize("name", ["csv", "mat 5"])
def test_a_recording_that_grows_while_it_is_read(tmp_path, monkeypatch, name):
    from dzdesign.identify.reading import ramp_files

    path = tmp_path / "ramp.mat"
    path = path if name == "mat 5" else path.with_suffix(".csv")
    path.write_bytes(SOUND[name])
    real = ramp_files.find_columns

    def slow(*arguments):
        with open(path, "ab") as file:
            file.write(b"\n")
        return real(*arguments)

    monkeypatch.setattr(ramp_files, "find_columns", slow)
    assert "was changed while it was read" in outcome(read_ramp_file, path)


def test_a_document_is_read_up_to_a_bound_only(tmp_path):
    path = tmp_path / "valve.json"
    with open(path, "wb") as file:
        file.truncate(10**11)  # takes no room
    assert "is larger than 16 MiB" in outcome(read_bytes, path, "valve file")
    assert "is not a dzdesign.valve/1 file" in outcome(write_file, path, "{}", "dzdesign.valve/1")


# documents


@pytest.mark.parametrize("deep", [30, 32, 33, 100, 900, 960, 980, 990, 1000, 5000, 100_000])
@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_a_deep_document_is_refused_at_a_depth_that_no_caller_changes(deep, opening):
    closing = "]" if opening == "[" else "}"
    text = '{"schema": "dzdesign.valve/1", "x": ' + opening * deep + "1" + closing * deep + "}"
    line = outcome(parse_document, text.encode(), "valve.json", ("dzdesign.valve/1",))
    assert ("is not JSON" in line) == (deep > 30)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.just(10**400) | st.just(-0.0)
    | st.just("*/") | st.just("\x1b[2J") | st.just("../x"),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3), max_leaves=6,
)  # fmt: skip


@pytest.fixture(scope="module")
def documents(example_valve, example_compensator):
    return {"valve": as_document(example_valve), "compensator": as_document(example_compensator)}


def places(value, way=()):
    """Yield the way to every value in a document."""
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        yield (*way, key)
        if isinstance(item, dict | list):
            yield from places(item, (*way, key))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["valve", "compensator"])
def test_a_changed_artefact(documents, kind):
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.identify.valve.model import ValveModel

    read = {
        "valve": lambda *file: read_artefact(file[0], ValveModel, file[1]),
        "compensator": lambda *file: read_artefact(file[0], Compensator, file[1]),
    }[kind]
    sound = documents[kind]
    ways = list(places(sound))

    @settings(max_examples=50 * TIMES, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
    @given(
        st.integers(0, len(ways) - 1), st.sampled_from(["set", "remove", "twice", "swap"]), JSON, st.integers(0, 10**9)
    )
    def changed(index, how, value, other):
        document = json.loads(json.dumps(sound))
        *way, last = ways[index]
        place = document
        for key in way:
            place = place[key]
        if how == "set":
            place[last] = value
        elif how == "remove":
            del place[last]
        elif how == "swap" and isinstance(place, dict):
            names = sorted(place)
            there = names[other % len(names)]
            place[last], place[there] = place[there], place[last]
        text = json.dumps(document)
        if how == "twice":
            text = text.replace(f'"{last}":', f'"{last}": 1, "{last}":', 1)
        line = outcome(read, text.encode(errors="surrogatepass"), "bad.json")
        assert not line or "bad.json" in line

    changed()


# options, quantities, signals


LONG = "9" * 100_000
TOMLS = [
    "u-max = 0x" + "f" * 5000,
    "u-max = 0b" + "1" * 50_000,
    "u-max" + ".a" * 3000 + " = 1",
    "u-max = " + "{a = " * 200 + "1" + "}" * 200,
    "u-max = '" + LONG + " V'",
    f"'{'k' * 200_000}' = 1",
    "u-max = '1" + " " * 100_000 + "x'",
    "knee-window = '" + LONG + "'",
    "knee-window = '" + " " * 100_000 + "'",
    "u-max = inf",
    "u-max = -0.0",
    "u-max = '\\u001b[2J*/'",
    "u-max = '10 V'\nu-max = '10 V'",
    '"../x" = 1',
    "[[dp]]\na = 1",
    "\0",
    "u-max = '\ud800'",
    "columns = 'u=" + "a" * 100_000 + "'",
]


@pytest.mark.parametrize("text", TOMLS, ids=range(len(TOMLS)))
def test_hostile_options(tmp_path, monkeypatch, capsys, text):
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_bytes(CSV)
    Path("options.toml").write_bytes(text.encode(errors="surrogatepass"))
    begin = time.monotonic()
    assert main(["identify", "a.csv", "--config", "options.toml"]) == 2
    assert time.monotonic() - begin < PATIENCE_S
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and len(line) < 2000 and line.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    "value", ["0x" + "f" * 5000, "-0x" + "f" * 5000, "{a" + ".a" * 3000 + " = 1}", "'" + LONG + "'"]
)
def test_hostile_plants(tmp_path, value):
    from dzdesign.verify.closed_loop.plant import read_plant

    path = tmp_path / "plant.toml"
    for key in ("K_a", "k" * 100_000):
        path.write_text(f"{key} = {value}")
        line = outcome(read_plant, path)
        assert "plant.toml'" in line and len(line) < 800


@settings(max_examples=50 * TIMES, deadline=None, derandomize=True)
@given(
    st.text(max_size=30) | st.from_regex(r"[-+0-9.eE,]{1,12} ?[A-Za-z/*^0-9µ]{0,8}", fullmatch=True),
    st.sampled_from(list(SI_UNIT)),
)
def test_any_text_as_a_quantity_or_unit(text, quantity):
    outcome(parse_quantity, text, quantity, "--option")
    outcome(si_factor, text, quantity)


@settings(max_examples=50 * TIMES, deadline=None, derandomize=True)
@given(
    st.text(max_size=40)
    | st.from_regex(
        r"-?[0-9]{1,5}\.\.[0-9]{1,5} (V|mA|psi)( on [0-9]{1,3} ohm)?( x [0-9.]{1,4})?( = .{1,8})?", fullmatch=True
    )
)
def test_any_text_as_a_signal(text):
    outcome(parse_signal, text, "--pressure-a")


@pytest.mark.parametrize(
    "text", ["0..10 V = 1" + " " * 100_000 + "x", "0.." + LONG + " V", "0..10 V x " + LONG, " " * 100_000, "٣..٤ V"]
)
def test_a_hostile_signal(text):
    line = outcome(parse_signal, text, "--pressure-a")
    assert len(line) < 400


@settings(max_examples=60 * TIMES, deadline=None, derandomize=True)
@given(st.lists(st.binary(max_size=60), max_size=12), st.booleans())
def test_any_octets_as_telemetry(pieces, synced):
    from dzdesign.codegen.telemetry.frame import FRAME_OCTETS, SYNC, FrameReader

    reader, octets = FrameReader(), 0
    for piece in pieces:
        piece = SYNC.to_bytes(2, "little") + piece if synced else piece
        octets += len(piece)
        frames = list(reader.feed(piece))
        assert len(reader._held) < FRAME_OCTETS and len(frames) <= octets // FRAME_OCTETS
    assert reader.skipped + reader.frames * FRAME_OCTETS + len(reader._held) == octets


WORDS = [
    "",
    "-",
    "--",
    "a\x1b[2Jb",
    "*/",
    "%s%n",
    "{0}",
    "../" * 50,
    "x" * 100_000,
    "\udcff",
    "nan",
    "1e999",
    "[",
    "CON",
    "--u-max=" + LONG,
]


@pytest.mark.parametrize(
    "command", ["identify", "design", "codegen", "verify", "assess", "simulate", "derive", "monitor", "nothing"]
)
def test_hostile_words_of_the_command_line(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    chance = random.Random(f"{SEED} {command}")
    for _ in range(6 * TIMES):
        words = [command, *chance.choices(WORDS, k=chance.randrange(1, 4))]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            status = main(words)
        said = capsys.readouterr().err
        assert status == 2 and said.count("\n") <= 1 and said.rstrip("\n").isprintable(), (SEED, words)
    assert list(tmp_path.iterdir()) == []
