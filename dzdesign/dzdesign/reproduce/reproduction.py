"""`dzdesign reproduce`: the paper's valves through the whole product, and every number of the paper beside ours."""

import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.core.artefact_files import TOOL, check_folder_may_be_written, sha256_of, to_json, write_folder
from dzdesign.terminal.progress import stage_progress

if TYPE_CHECKING:
    from dzdesign.reproduce.row import Row
    from dzdesign.reproduce.runs import ValveRuns
    from dzdesign.reproduce.valves import RecoveredValve
    from dzdesign.verify.closed_loop.simulation import Bench

SCHEMA = "dzdesign.reproduction/1"
PAPER_DOI = "10.11916/j.issn.1005-9113.20063"
#: Pressure drops of the ramp tests, MPa: the paper's two and some between ("multiple groups", section 1), closer at
#: dP0, because between two tests only the lower of their bounds is certain.
TESTED_MPA = (1.0, 1.1, 1.5, 2.0, 3.0, 4.0, 5.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """One valve through the product: its artefacts (name to content), their hashes, and the runs."""

    files: dict[str, str]
    document: dict[str, Any]
    runs: "ValveRuns"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """The paper's numbers beside ours: reproduction.json, and what its tables are printed from."""

    document: dict[str, Any]
    rows: "list[Row]"
    valves: "list[RecoveredValve]"


def reproduce(folder: Path) -> Reproduction:
    """Reproduce the paper's numbers and figures.

    Parameters
    ----------
    folder : Path
        To write.
    """
    from dzdesign.reproduce.figures import figure_files
    from dzdesign.reproduce.rows import rows_of
    from dzdesign.reproduce.valves import recover_valves
    from dzdesign.verify.toolchain.host_compiler import host_compiler

    check_folder_may_be_written(folder, SCHEMA)
    host_compiler()
    with stage_progress() as stage:
        stage("recovering the valves' parameters from the printed figures")
        chains = [run_chain(valve, say=stage) for valve in recover_valves()]
        rows = rows_of([chain.runs for chain in chains])
        stage("drawing")
        figures = figure_files([chain.runs for chain in chains])
    document = {
        "schema": SCHEMA,
        "tool": TOOL,
        "paper": PAPER_DOI,
        "holds": all(row.holds is not False for row in rows),
        "rows": [row.to_document() for row in rows],
        "valves": [chain.document for chain in chains],
    }
    files: dict[str, str | bytes] = {"reproduction.json": to_json(document)}
    files |= figures
    for chain in chains:
        files |= chain.files
    write_folder(folder, files, {"schema": SCHEMA, "tool": TOOL})
    return Reproduction(document=document, rows=rows, valves=[chain.runs.valve for chain in chains])


def run_chain(valve: "RecoveredValve", say: Callable[[str], None] = lambda _: None) -> Chain:
    """Run a recovered valve through the product: ramp tests, identify, design, codegen, closed loop with the C.

    Parameters
    ----------
    valve : RecoveredValve
        The valve.
    say : callable
        Told each stage before it begins.
    """
    from dzdesign.codegen.project import generate
    from dzdesign.core.artefact_files import parse_document
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.design.compensator import SCHEMA as COMPENSATOR_SCHEMA
    from dzdesign.design.designing import design
    from dzdesign.identify.identification import identify
    from dzdesign.reproduce.runs import run_valve
    from dzdesign.verify.closed_loop.loop import ClosedLoop

    name = valve.published.name
    bench = bench_of(valve)
    with tempfile.TemporaryDirectory(prefix="dzdesign-") as scratch:
        say(f"{name}: ramp tests of the recovered valve")
        ramps = _ramp_tests(valve, bench)
        say(f"{name}: identify, design, codegen")
        identified = identify(_read_all(ramps, Path(scratch)), identify_options(valve))
        valve_json = to_json_bytes(identified)
        compensator = design(identified, valve_bytes=valve_json)
        compensator_json = to_json_bytes(compensator).decode()
        firmware = generate(compensator, "host", compensator_json.encode())
        write_folder(Path(scratch) / "firmware", firmware.files, firmware.manifest)
        design_document = parse_document(compensator_json.encode(), "compensator.json", (COMPENSATOR_SCHEMA,))
        say(f"{name}: closed loop")
        loop = ClosedLoop(valve.plant, Path(scratch) / "firmware", compensator)
        runs = run_valve(valve, loop, design_document)
    place = name.replace(" ", "_")
    core = {path: text for path, text in firmware.files.items() if path.startswith("core/")}
    return Chain(
        files={
            f"{place}/plant.toml": _plant_toml(valve),
            f"{place}/valve.json": valve_json,
            f"{place}/compensator.json": compensator_json,
        },
        document={
            **valve.to_document(),
            "bench": asdict(bench),
            "sha256": {
                "ramp_tests": {file: sha256_of(content) for file, content in ramps.items()},
                "valve_json": sha256_of(valve_json),
                "compensator_json": sha256_of(compensator_json.encode()),
                "core": {path: sha256_of(text.encode()) for path, text in core.items()},
            },
        },
        runs=runs,
    )


def _ramp_tests(valve: "RecoveredValve", bench: "Bench") -> dict[str, bytes]:
    """Record the ramp tests of the bare valve: file name to content, each marked as simulated."""
    from dzdesign.derivation.account.published import RAMP_S
    from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes
    from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
    from dzdesign.verify.closed_loop.simulation import simulate_ramp

    loop, sequence = ClosedLoop(valve.plant), RampSequence(ramp=float(RAMP_S))
    origin = f"the paper's {valve.published.name}, recovered"
    comments = (f"{SIMULATED_MARK} by dzdesign reproduce; {origin}. No measurement.",)
    return {
        f"ramp_dP{dp_MPa:g}.csv": ramp_file_bytes(
            simulate_ramp(loop, valve.plant, dp_MPa, bench, sequence), comments, compress=False
        )
        for dp_MPa in TESTED_MPA
    }


def bench_of(valve: "RecoveredValve") -> "Bench":
    """Return the bench of Section 4.1: 100 Hz, and a meter that starts at 0.6 L/min; a simulation has exact readings.

    The paper gives no lag of the meter, and none is simulated.

    Parameters
    ----------
    valve : RecoveredValve
        Its level says whether a meter stood between.
    """
    from dzdesign.derivation.account.published import RECORDS_HZ
    from dzdesign.verify.closed_loop.simulation import Bench

    metered = Bench(rate_Hz=float(RECORDS_HZ), meter_lag_s=0.0, meter_floor_L_min=valve.level_L_min)
    if valve.level_L_min:
        return metered
    exact = {"meter_noise_L_min": 0.0, "command_noise_V": 0.0, "pressure_noise_MPa": 0.0}
    return Bench(**{**asdict(metered), **exact})


def identify_options(valve: "RecoveredValve") -> "IdentifyOptions":  # noqa: F821
    """Return what an engineer who read Section 4.1 would declare.

    Parameters
    ----------
    valve : RecoveredValve
        The valve.
    """
    from dzdesign.derivation.account.published import DP0_MPA, U_MAX_V
    from dzdesign.identify.options import IdentifyOptions
    from dzdesign.verify.closed_loop.plant import L_MIN, MPA

    return IdentifyOptions(
        u_max=float(U_MAX_V), dp0=DP0_MPA * MPA, meter_floor=valve.level_L_min * L_MIN, meter_lag=0.0
    )


def _read_all(ramps: dict[str, bytes], folder: Path) -> list["RampTest"]:  # noqa: F821
    """Read the recordings as files, as a user's are."""
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    tests = []
    for name, content in ramps.items():
        path = folder / name
        path.write_bytes(content)
        tests.append(read_ramp_file(path))
    return tests


def _plant_toml(valve: "RecoveredValve") -> str:
    """Return the plant as a file for `dzdesign verify --plant`, each parameter marked."""
    lines = [
        f"# The paper's {valve.published.name}. Its Table 1 is an image, so the parameters are recovered by a fit from",
        "# the printed figures, as far as these determine them.",
    ]
    for name, entry in valve.to_document()["parameters"].items():
        reach = f", to {entry['rounding']:g} for the rounding of the print" if entry["rounding"] else ""
        lines.append(f"{name} = {entry['value']!r}  # {entry['origin']}{reach}")
    return "\n".join([*lines, ""])
