"""What is fuzzed: readers of recordings, artefacts, tables and options here; outputs and devices beside."""

import gzip
import io
import json
import tempfile
from collections.abc import Callable
from pathlib import Path

import device_targets
import output_targets
from target import Target

from dzdesign.assess.assessment import Assessment
from dzdesign.assess.quantities import parse_limits
from dzdesign.command_line.invocation import options_from_file
from dzdesign.command_line.parser import arguments_of_command
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.units import SI_UNIT, parse_quantity
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest
from dzdesign.design.signal_text import parse_signal
from dzdesign.identify.reading.column_labels import parse_columns
from dzdesign.identify.reading.columns import find_columns
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.text_file import read_text_table
from dzdesign.identify.valve.low_flow import EXAMPLE, read_low_flow
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.lot.summary import ValveManifest
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.ramps import read_curves
from dzdesign.verify.evidence import Evidence, OutputEvidence
from tests.support.golden_firmware import golden_compensator

GOLDENS = Path(__file__).parents[2] / "tests" / "goldens"
CSV = b"# bench 3\ntime_s;u [V];dP (bar);Q_Lmin\n" + b"".join(
    b"%d;%d,5;10;%d\n" % (n, n % 10, n % 7) for n in range(40)
)
#: Artefacts beside valve.json and compensator.json.
ARTEFACTS = (FirmwareManifest, OutputManifest, ValveManifest, Evidence, OutputEvidence, Assessment)


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


def _artefacts(data: bytes) -> None:
    for kind in ARTEFACTS:
        try:
            read_artefact(data, kind, "manifest.json")
        except InputError:
            continue


def _curves(data: bytes) -> None:
    read_curves(data.decode(errors="replace"))


def _artefact_seeds() -> list[bytes]:
    short = [json.dumps({"schema": schema_of(kind), "files": {}, "checks": [], "made_from": []}).encode()
             for kind in ARTEFACTS]  # fmt: skip
    return [output_targets.output_manifest(), *short]


OPTIONS = [
    argument
    for name in ("identify", "simulate")
    for argument in arguments_of_command(name)
    if not argument.is_positional
]
TARGETS = {
    "text": Target(
        run=_text, seeds=lambda: [CSV, CSV.replace(b",", b".").replace(b";", b","), gzip.compress(CSV, mtime=0)]
    ),
    "recording": Target(
        run=_stored(read_ramp_file, "ramp.mat"), seeds=lambda: [CSV, b"PAR1", b"ARROW1", b"TDSm", b"MATLAB 5.0"]
    ),
    "low-flow": Target(
        run=lambda data: read_low_flow(data.decode("latin-1"), 10.0), seeds=lambda: [EXAMPLE.encode()]
    ),
    "valve": Target(
        run=lambda data: read_artefact(data, ValveModel, "valve.json"),
        seeds=lambda: [(GOLDENS / "valve.json").read_bytes()],
    ),
    "compensator": Target(
        run=lambda data: read_artefact(data, Compensator, "compensator.json"),
        seeds=lambda: [to_json_bytes(golden_compensator())],
    ),
    "artefacts": Target(run=_artefacts, seeds=_artefact_seeds),
    "curves": Target(
        run=_curves, seeds=lambda: [b"dp_code,drive_V\n0,1.5\n1,2.5\n"], refusals=(ValueError,)
    ),
    "options": Target(
        run=_stored(lambda path: options_from_file(str(path), OPTIONS), "options.toml"),
        seeds=lambda: [b"u-max = '10 V'\ndp = ['1 MPa', 2]\n[columns]\nu = 'AO0:V'\n"],
    ),
    "plant": Target(
        run=_stored(read_plant, "plant.toml"), seeds=lambda: [b"K_a = 4\nm_e_kg = 6e-2\nL_c_H = 0x10\n"]
    ),
    "words": Target(
        run=_words,
        seeds=lambda: [b"4..20 mA on 150 ohm = 25 MPa", b"0.6 L/min", b"u=AO0:V, Q=Flow", b"hysteresis = 1 %"],
    ),
    **output_targets.TARGETS,
    **device_targets.TARGETS,
}
