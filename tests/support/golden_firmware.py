"""The goldens: what targets' files were from one small valve.json, and how they are made anew.

The second set, `FULL`, has everything switched on: a valve of two unlike sides, a transition, ramps, dither, a largest
output, 4-20 mA sensors of unlike spans. A file that is the same for several targets stands once.
"""

import difflib
import shutil
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import command_signal, parse_signal, pressure_signal
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.recorded_drop import DropColumns
from tests.support.paths import TESTS
from tests.support.synthetic import Truth, synthetic_ramp

GOLDENS = TESTS / "goldens"
FULL = TESTS / "goldens_full"
#: What is kept, by root and target: folders of the firmware.
KEPT = {
    (GOLDENS, "host"): ("core", "host"),
    (FULL, "f28335"): ("core", "f28335"),
    (FULL, "cortex-m4"): ("cortex_m4",),
}
#: Not compared: it is what goes in.
INPUT = "compensator.json"
LINES_SHOWN = 60


def full_options(**changes) -> DesignOptions:
    """Every option switched on."""
    adc = Converter()

    def sensor(text: str) -> object:
        return pressure_signal(parse_signal(text, "--pressure-a"), adc, Fraction(20))

    signals = Signals(
        command=command_signal(parse_signal("-10..10 V x 0.15 + 1.5 V", "--command-signal"), adc),
        pressure_a=sensor("4..20 mA on 139 ohm = 25 MPa"),
        pressure_b=sensor("4..20 mA on 140 ohm = 16 MPa"),
        negative_pair="BA",
    )
    chosen = {
        "signals": signals,
        "transition": Fraction(1, 100),
        "ramp_up_s": (0.5, 0.8),
        "ramp_down_s": (0.4, 0.0),
        "dither_Hz": 150.0,
        "dither_peak": Fraction(1, 100),
        "output_max": Fraction(95, 100),
        "fault_samples": 3,
        "fault_latch": True,
    }
    return DesignOptions(**(chosen | changes))


@cache
def golden_valve(root: Path = GOLDENS) -> ValveModel:
    """The valve of a set: of one sign of command, or of both with everything switched on."""
    return read_artefact((root / "valve.json").read_bytes(), ValveModel, "valve.json")


@cache
def golden_compensator(target_name: str = "host", root: Path = GOLDENS) -> Compensator:
    """The compensator of a set, with the scalings of a target that has its own."""
    target, valve = target_named(target_name), golden_valve(root)
    if root == FULL:
        return design(valve, full_options())
    if target.takes_any_signals:
        return design(valve)
    # Half a count of another PWM is another voltage, so the offset is chosen anew under its bound.
    return design(valve, DesignOptions(signals=Signals(compare_max=target.compare_max)))


@cache
def generated(target_name: str, root: Path = GOLDENS) -> Mapping[str, str]:
    """Generate a target's files, without the compensator itself."""
    files = dict(generate(golden_compensator(target_name, root), target_name).files)
    del files[INPUT]
    return files


def golden_files(target_name: str, root: Path) -> dict[str, str]:
    """Return the generated files of those folders that are kept."""
    kept = KEPT[root, target_name]
    return {path: text for path, text in generated(target_name, root).items() if path.partition("/")[0] in kept}


def write(folder: Path, files: Mapping[str, str]) -> Path:
    """Write files into a folder, and return it."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    return folder


def differences(folder: Path, files: Mapping[str, str]) -> str:
    """Return what a person wants to know about files that are not those of the folder; empty if they are."""
    kept = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
    said = [f"{folder.name}/{name}: no golden\n" for name in sorted(files.keys() - kept.keys())]
    said += [f"{folder.name}/{name}: a golden that is not generated\n" for name in sorted(kept.keys() - files.keys())]
    for name in sorted(files.keys() & kept.keys()):
        golden = kept[name].read_text(encoding="utf-8")
        label = f"{folder.name}/{name}"
        diff = difflib.unified_diff(
            golden.splitlines(True), files[name].splitlines(True), f"golden {label}", f"generated {label}"
        )
        said += list(diff)
    if len(said) > LINES_SHOWN:
        said = [*said[:LINES_SHOWN], f"... and {len(said) - LINES_SHOWN} lines more\n"]
    return "".join(said)


def golden_folder(target_name: str, folder: Path, root: Path = GOLDENS) -> Path:
    """Write a target's files with the compensator that they are of, and return the folder."""
    return write(folder, generate(golden_compensator(target_name, root), target_name).files)


def identified_valve(root: Path) -> ValveModel:
    """Identify the valve of a set from ramps of its own: of one side, or of two that are unlike."""
    drops = (1.0, 3.0, 5.0)
    if root == GOLDENS:
        return identify([_ramp(dp, 5.406 - 0.05 * dp, 4.0) for dp in drops])
    of_drop = DropColumns(quantities=("pA", "pB"), labels=("pA_MPa", "pB_MPa"))
    positive = [replace(_ramp(dp, 5.5 - 0.05 * dp, 4.0), dp_from=((of_drop,), ())) for dp in drops]
    negative = [
        replace(ramp, u=-ramp.u, q=-ramp.q, dp=-ramp.dp, dp_from=((), (of_drop,)))
        for ramp in (_ramp(dp, 3.0 + 0.04 * dp, 3.0, name="synthetic_minus") for dp in drops)
    ]
    return identify([*positive, *negative])


def _ramp(dp_MPa: float, knee_V: float, slope: float, name: str = "synthetic") -> RampTest:
    """Return a ramp with that knee and, at 3 MPa, that slope, L/min/V."""
    truth = Truth(knee_rising=knee_V, slope=slope * (dp_MPa / 3) ** 0.5)
    return synthetic_ramp(dp_MPa, truth, source=f"{name}_{dp_MPa:g}.csv")


def update() -> None:
    """Write the files anew, from valves that are identified and compensators that are designed anew."""
    for root in (GOLDENS, FULL):
        (root / "valve.json").write_bytes(to_json_bytes(identified_valve(root)))
    golden_valve.cache_clear()
    golden_compensator.cache_clear()
    for root in (GOLDENS, FULL):
        for folder in root.iterdir():
            if folder.is_dir() and folder.name != "schemas":
                shutil.rmtree(folder)
    for root, target in KEPT:
        write(root / target, golden_files(target, root))
