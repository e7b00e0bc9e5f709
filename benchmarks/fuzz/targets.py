"""What is fuzzed: bytes in, nothing out; an `InputError` is an answer, any other exception a finding."""

import gzip
import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dzdesign.assess.limits import parse_limits
from dzdesign.codegen.telemetry.frame import FRAME_OCTETS, FrameReader
from dzdesign.command_line.options_file import options_from_file
from dzdesign.command_line.parser import arguments_of_command
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.core.units import SI_UNIT, parse_quantity
from dzdesign.design.compensator import Compensator
from dzdesign.design.signal_text import parse_signal
from dzdesign.identify.reading.column_labels import find_columns, parse_columns
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.text.table_reader import read_text_table
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.tolerances import read_tolerances

GOLDENS = Path(__file__).parents[2] / "tests" / "goldens"
CSV = b"# bench 3\ntime_s;u [V];dP (bar);Q_Lmin\n" + b"".join(
    b"%d;%d,5;10;%d\n" % (n, n % 10, n % 7) for n in range(40)
)


@dataclass(frozen=True, kw_only=True)
class Target:
    """One reader, and files to begin with."""

    run: Callable[[bytes], None]
    seeds: tuple[bytes, ...]

    def __call__(self, data: bytes) -> None:
        """Read; a refusal must be a sentence of bounded length."""
        try:
            self.run(data)
        except InputError as error:
            if not 10 < len(str(error)) < 200_000:
                raise ValueError(f"a refusal of {len(str(error))} characters") from error


def _text(data: bytes) -> None:
    table = read_text_table(io.BytesIO(data), Path("ramp.csv"))
    for column in find_columns(table, {}).values():
        table.numbers(column.label)


def _stored(read: Callable[[Path], object], name: str) -> Callable[[bytes], None]:
    path = Path(tempfile.mkdtemp(prefix="dzdesign-fuzz-")) / name

    def run(data: bytes) -> None:
        path.write_bytes(data)
        read(path)

    return run


def _words(data: bytes) -> None:
    text = data.decode(errors="surrogateescape")
    for read in (
        lambda: parse_signal(text, "--pressure-a"),
        lambda: parse_columns(text),
        lambda: parse_limits(text, 10.0),
        *(lambda quantity=quantity: parse_quantity(text, quantity, "--option") for quantity in SI_UNIT),
    ):
        try:
            read()
        except InputError:
            continue


def _telemetry(data: bytes) -> None:
    reader = FrameReader()
    for start in range(0, len(data), 7):
        list(reader.feed(data[start : start + 7]))
    held = len(data) - reader.skipped - reader.frames * FRAME_OCTETS
    if not 0 <= held < FRAME_OCTETS:
        raise ValueError(f"{held} octets are neither skipped, nor in a frame, nor held")


OPTIONS = [
    argument
    for name in ("identify", "simulate")
    for argument in arguments_of_command(name)
    if not argument.is_positional
]
TARGETS = {
    "text": Target(run=_text, seeds=(CSV, CSV.replace(b",", b".").replace(b";", b","), gzip.compress(CSV, mtime=0))),
    "recording": Target(
        run=_stored(read_ramp_file, "ramp.mat"), seeds=(CSV, b"PAR1", b"ARROW1", b"TDSm", b"MATLAB 5.0")
    ),
    "valve": Target(
        run=lambda data: read_artefact(data, ValveModel, "valve.json"), seeds=((GOLDENS / "valve.json").read_bytes(),)
    ),
    "compensator": Target(
        run=lambda data: read_artefact(data, Compensator, "compensator.json"),
        seeds=((GOLDENS / "compensator.json").read_bytes(),),
    ),
    "options": Target(
        run=_stored(lambda path: options_from_file(str(path), OPTIONS), "options.toml"),
        seeds=(b"u-max = '10 V'\ndp = ['1 MPa', 2]\n[columns]\nu = 'AO0:V'\n",),
    ),
    "plant": Target(run=_stored(read_plant, "plant.toml"), seeds=(b"K_a = 4\nm_e_kg = 6e-2\nL_c_H = 0x10\n",)),
    "tolerances": Target(
        run=_stored(read_tolerances, "t.toml"), seeds=(b"plants = 9\nK_a = '3 %'\nm_e_kg = '1 % sd'\n",)
    ),
    "words": Target(
        run=_words, seeds=(b"4..20 mA on 150 ohm = 25 MPa", b"0.6 L/min", b"u=AO0:V, Q=Flow", b"hysteresis = 1 %")
    ),
    "telemetry": Target(run=_telemetry, seeds=(b"\xa5\x5a\x02\x14" + bytes(24), b"\x5a\xa5" * 20)),
}
