"""A valve of the paper through the whole product: ramp tests, identify, design, codegen, the closed loop with the C.

The runs are the ramps of Sections 2 and 4, bare and with the product's C.
"""

from collections.abc import Callable
from dataclasses import dataclass

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.placing import scratch_folder
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, RAMP_S, RECORDS_HZ, U_MAX_V
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes, read_ramp_file
from dzdesign.reproduce.artefact import Hashes, ReproducedValve
from dzdesign.reproduce.recovered_valves import METER_START_L_MIN, RecoveredValve
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import L_MIN, MPA
from dzdesign.verify.closed_loop.ramps import dead_zone
from dzdesign.verify.closed_loop.simulated_recordings import Bench, simulate_ramp

PRESSURES_MPA = (float(DP0_MPA), float(DP1_MPA))
#: What drives the valve, as the loop calls it.
DIRECT, PRODUCT, WITHOUT_BETA = "direct", "compensated", "without beta"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveRuns:
    """Everything that was run of one valve."""

    valve: RecoveredValve
    #: By what drives and pressure drop in MPa: up to full command and back.
    ramps: dict[tuple[str, float], LoopRun]

    def dead_zone_percent(self, drive: str, dp_MPa: float) -> float:
        """Return the command, percent of full, at which rising flow passes the meter's start."""
        run = self.ramps[drive, dp_MPa]
        return 100 * dead_zone(run, METER_START_L_MIN, rising=True)

    def largest_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the largest flow of a ramp."""
        return float(self.ramps[drive, dp_MPa].q_mean_L_min.max())

    def zero_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the flow at zero command, after closing."""
        return float(self.ramps[drive, dp_MPa].q_largest_L_min[-1])


def run_valve(valve: RecoveredValve, loop: ClosedLoop) -> ValveRuns:
    """Run a recovered valve through the paper's ramps, bare and with the loop's firmware."""
    ramp, dp0_MPa = RampSequence(ramp=float(RAMP_S)).command(), PRESSURES_MPA[0]
    return ValveRuns(
        valve=valve,
        ramps={
            (drive, dp_MPa): loop.run(ramp, dp_MPa, drive, dp_frozen_MPa=dp0_MPa)
            for dp_MPa in PRESSURES_MPA
            for drive in (DIRECT, PRODUCT, WITHOUT_BETA)
        },
    )


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
    name = valve.published.name
    # The bench of Section 4.1; the paper gives no lag of the meter, and none is simulated.
    bench = Bench(rate_Hz=float(RECORDS_HZ), meter_lag_s=0.0, meter_floor_L_min=METER_START_L_MIN)
    with scratch_folder() as scratch:
        say(f"{name}: ramp tests of the recovered valve")
        ramps = _ramp_tests(valve, bench)
        say(f"{name}: identify, design, codegen")
        for file, content in ramps.items():
            (scratch / file).write_bytes(content)
        tests = [read_ramp_file(scratch / file) for file in ramps]  # as a user's are read
        floor = METER_START_L_MIN * L_MIN  # as an engineer who read Section 4.1 would declare it
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
        runs = run_valve(valve, loop)
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
