"""A valve of the paper through the whole product: ramp tests, identify, design, codegen, the closed loop with the C."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.placing import scratch_folder
from dzdesign.derivation.account.published import DP0_MPA, RAMP_S, RECORDS_HZ, U_MAX_V
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes, read_ramp_file
from dzdesign.reproduce.artefact import Hashes, ReproducedValve
from dzdesign.reproduce.recovered_valves import RecoveredValve
from dzdesign.reproduce.runs import PRESSURES_MPA, ValveRuns, run_valve
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import L_MIN, MPA
from dzdesign.verify.closed_loop.simulated_recordings import Bench, simulate_ramp

#: Of the ramp tests, MPa: those of Sections 2 and 4.2, and no other.
TESTED_MPA = PRESSURES_MPA


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """One valve through the product: its artefacts (name to content), what reproduction.json says of it, the runs."""

    files: dict[str, str]
    valve: ReproducedValve
    runs: ValveRuns


def run_chain(valve: RecoveredValve, say: Callable[[str], None] = lambda _: None) -> Chain:
    """Run a recovered valve through the product; `say` is called before each stage."""
    name, bench = valve.published.name, bench_of(valve)
    with scratch_folder() as scratch:
        say(f"{name}: ramp tests of the recovered valve")
        ramps = _ramp_tests(valve, bench)
        say(f"{name}: identify, design, codegen")
        for file, content in ramps.items():
            (scratch / file).write_bytes(content)
        tests = [read_ramp_file(scratch / file) for file in ramps]  # as a user's are read
        floor = valve.level_L_min * L_MIN  # as an engineer who read Section 4.1 would declare it
        options = IdentifyOptions(
            u_max=float(U_MAX_V),
            dp0=DP0_MPA * MPA,
            meter_floor=floor,
            # The simulated meter has no lag, and the simulated valve closes the same way each time.
            meter_lag=0.0,
            meter_lag_tolerance=0.0,
            repeatability=0.0,
            # Between the two pressure drops that the paper tests, its threshold falls.
            curve="monotone",
        )
        identified = identify(tests, options)
        valve_json = to_json_bytes(identified)
        compensator = design(identified)
        compensator_json = to_json_bytes(compensator).decode()
        firmware = generate(compensator, "host")
        write_folder(scratch / "firmware", firmware.contents, firmware.manifest)
        say(f"{name}: closed loop")
        loop = ClosedLoop(valve.plant, scratch / "firmware", compensator)
        runs = run_valve(valve, loop, compensator)
    place = name.replace(" ", "_")
    return Chain(
        files={
            f"{place}/plant.toml": _plant_toml(valve),
            f"{place}/valve.json": valve_json.decode(),
            f"{place}/compensator.json": compensator_json,
        },
        valve=ReproducedValve(
            valve=name,
            parameters=valve.parameters(),
            level_L_min=valve.level_L_min,
            bench=bench,
            sha256=Hashes(
                ramp_tests={file: sha256_of(content) for file, content in ramps.items()},
                valve_json=sha256_of(valve_json),
                compensator_json=sha256_of(compensator_json.encode()),
                core={
                    path: sha256_of(text.encode()) for path, text in firmware.files.items() if path.startswith("core/")
                },
            ),
        ),
        runs=runs,
    )


def bench_of(valve: RecoveredValve) -> Bench:
    """Return the bench of Section 4.1: 100 Hz, and a meter that starts at 0.6 L/min; a simulation has exact readings.

    The paper gives no lag of the meter, and none is simulated.
    """
    bench = Bench(rate_Hz=float(RECORDS_HZ), meter_lag_s=0.0, meter_floor_L_min=valve.level_L_min)
    if valve.level_L_min:
        return bench
    return replace(bench, meter_noise_L_min=0.0, command_noise_V=0.0, pressure_noise_MPa=0.0)


def _ramp_tests(valve: RecoveredValve, bench: Bench) -> dict[str, bytes]:
    """Record the ramp tests of the bare valve: file name to content, each marked as simulated."""
    loop, sequence = ClosedLoop(valve.plant), RampSequence(ramp=float(RAMP_S))
    origin = f"the paper's {valve.published.name}, recovered"
    comments = (f"{SIMULATED_MARK} by dzdesign reproduce; {origin}. No measurement.",)
    return {
        f"ramp_dP{dp_MPa:g}.csv": ramp_file_bytes(
            simulate_ramp(loop, valve.plant, dp_MPa, bench, sequence), comments, compress=False
        )
        for dp_MPa in TESTED_MPA
    }


def _plant_toml(valve: RecoveredValve) -> str:
    """Return the plant as a file for `dzdesign verify --plant`, each parameter marked."""
    lines = [
        f"# The paper's {valve.published.name}. Its Table 1 is an image, so the parameters are recovered from the",
        "# printed figures, as far as these determine them.",
    ]
    for name, parameter in valve.parameters().items():
        reach = f", to {parameter.rounding:g} for the rounding of the print" if parameter.rounding else ""
        lines.append(f"{name} = {parameter.value!r}  # {parameter.origin}{reach}")
    return "\n".join([*lines, ""])
