"""A valve of the paper through the whole product: ramp tests, identify, design, codegen, the closed loop with the C.

The runs are the ramps of Sections 2 and 4, bare and with the product's C.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.placing import scratch_folder
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, DUTY_COMMAND_V, RAMP_S, RECORDS_HZ, U_MAX_V
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import SIMULATED_MARK, ramp_file_bytes, read_ramp_file
from dzdesign.reproduce.artefact import Hashes, ReproducedValve
from dzdesign.reproduce.recovered_valves import RecoveredValve
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import L_MIN, MPA
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, dead_zone
from dzdesign.verify.closed_loop.simulated_recordings import Bench, simulate_ramp

PRESSURES_MPA = (float(DP0_MPA), float(DP1_MPA))
#: The largest flow is reached where the flow comes this close to it.
REACHED = 0.999
#: What drives the valve, as the loop calls it.
DIRECT, PRODUCT, WITHOUT_BETA = "direct", "compensated", "without beta"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveRuns:
    """Everything that was run of one valve."""

    valve: RecoveredValve
    #: By what drives and pressure drop in MPa: up to full command and back.
    ramps: dict[tuple[str, float], LoopRun]
    #: Of the product at the command of Fig. 13 and dP0.
    duty_percent: float
    #: Commands about zero that the product takes for zero, percent of full.
    zero_band_percent: float
    #: Commands behind these in which the product goes from the closing offset to the opening threshold.
    transition_percent: float

    @property
    def direct_duty_percent(self) -> float:
        """Duty cycle of the loop's PWM at the command of Fig. 12, with nobody between, percent."""
        run = self.ramps[DIRECT, PRESSURES_MPA[0]]
        at = int(np.argmax(run.command >= DUTY_COMMAND_V / U_MAX_V))
        return 100 * float(run.compare[at] / run.compare.max())

    def dead_zone_percent(self, drive: str, dp_MPa: float) -> float:
        """Return the command, percent of full, at which rising flow passes what the paper takes for flow."""
        run = self.ramps[drive, dp_MPa]
        level = self.valve.level_L_min or FLOW_SHARE * float(run.q_mean_L_min.max())
        return 100 * dead_zone(run, level, rising=True)

    def largest_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the largest flow of a ramp."""
        return float(self.ramps[drive, dp_MPa].q_mean_L_min.max())

    def zero_L_min(self, drive: str, dp_MPa: float) -> float:
        """Return the flow at zero command, after closing."""
        return float(self.ramps[drive, dp_MPa].q_largest_L_min[-1])

    def flat_from_V(self, drive: str, dp_MPa: float) -> float:
        """Return the command at which the largest flow is reached."""
        run = self.ramps[drive, dp_MPa]
        return U_MAX_V * float(run.command[np.argmax(run.q_mean_L_min >= REACHED * run.q_mean_L_min.max())])


def run_valve(valve: RecoveredValve, loop: ClosedLoop, compensator: Compensator) -> ValveRuns:
    """Run a recovered valve through the paper's ramps, bare and with the loop's firmware."""
    dp0_MPa, span = PRESSURES_MPA[0], compensator.signals.command.span(1)
    ramp = RampSequence(ramp=float(RAMP_S)).command()
    # Zero command for as long as the drive waits for it after a reset.
    held = np.append(np.zeros(ceil(loop.waits_s / RECORD_S) + 1), np.full(2, DUTY_COMMAND_V / U_MAX_V))
    drives = (DIRECT, PRODUCT, *([WITHOUT_BETA] if valve.published.zero_flow_without_beta else []))
    return ValveRuns(
        valve=valve,
        ramps={
            (drive, dp_MPa): loop.run(ramp, dp_MPa, drive, dp_frozen_MPa=dp0_MPa)
            for dp_MPa in PRESSURES_MPA
            for drive in drives
        },
        duty_percent=100 * float(loop.run(held, dp0_MPa, PRODUCT).compare[-1]) / compensator.signals.compare_max,
        zero_band_percent=100 * compensator.zero_band_codes / span,
        transition_percent=100 * compensator.transition_codes / span,
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
