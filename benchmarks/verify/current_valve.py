"""Valves behind the current loop: how far coil and supply move the dead zone on opening; flow at zero command.

The example, and two valves from elsewhere: their recorded flow, moved by the true current of the declared coil and of
those at the ends of all ranges, at every tested pressure drop; the example's plant of equations too.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from scoreboard import Row, print_rows, say
from stand_in_flow import RECORDINGS, ROOT

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.verify.closed_loop.drive_corners import RELEASED, coil_and_supply
from dzdesign.verify.closed_loop.loop_checks import MOST_MOVED
from dzdesign.verify.closed_loop.plant import Plant, read_plant
from dzdesign.verify.closed_loop.scene import scenes_of

CONTROLLED = {
    "drive": "current",
    "coil": "3.5 ohm 40 mH",
    "rated_current": "1 A",
    "supply": "18..32 V",
    "current_signal": "0..1.2 A on 2 ohm + 0.15 V",
}
MEASURED = CONTROLLED | {"supply_signal": "0..36 V x 0.075"}
#: A machine with next to no errors of its own: its offset lies highest, where an overshoot opens the valve.
ACCURATE = {
    "current_error": "0.1 %", "bench_current": "1 A +- 0.1 %", "oil": "0.05 %", "ageing": "0.05 %",
    "pressure_error": "0.02 %",
}  # fmt: skip
FORMS = {"supply unknown": CONTROLLED, "supply measured": MEASURED, "supply measured, accurate": MEASURED | ACCURATE}
TARGET = "cortex-m4"


def print_current_valve(quick: bool = False, seed: int = 0) -> list[Row]:
    """Judge each valve with both forms of the loop, print and return the rows."""
    rows = []
    inputs = target_named(TARGET).inputs()
    for name, folder in RECORDINGS.items():
        if not folder.is_dir():
            rows.append(Row(what=f"{name}: '{folder}' is not here", value=1, limit=0))
            continue
        valve = identify([read_ramp_file(path) for path in sorted(folder.glob("*.csv.gz"))])
        for form, texts in list(FORMS.items())[: 1 if quick else None]:
            compensator = design(valve, options_of(texts, inputs))
            rows += _rows(f"{name}, {form}", compensator, None)
            if name == "the example":
                plant = read_plant(ROOT / "examples" / "paper_valve" / "plant.toml")
                rows += _rows(f"{name}'s plant of equations, {form}", compensator, plant)
    print_rows("Valves behind the current loop: R x 0.75-1.35, L x 0.5-1.5, 18-32 V", rows)
    return rows


def _rows(name: str, compensator: Compensator, plant: Plant | None) -> list[Row]:
    say(f"{name} ...")
    with TemporaryDirectory() as temporary:
        folder = Path(temporary) / "firmware"
        firmware = generate(compensator, TARGET)
        write_folder(folder, firmware.files, firmware.manifest)
        scenes = scenes_of(folder, compensator, plant)
        found = [each for scene in scenes for each in coil_and_supply(scene) if RELEASED in each.figures]
    openings: dict[float, list[float]] = {}
    for each in found:
        openings.setdefault(each.dp_MPa, []).append(each.figures["dead_zone_on_opening_percent"])
    dp_MPa, shares = max(openings.items(), key=lambda item: max(item[1]) - min(item[1]))
    closed = max(each.q_beyond_L_min for each in found)
    released = max(found, key=lambda each: each.figures[RELEASED])
    return [
        Row(what=f"{name}: dead zone on opening moves by", value=max(shares) - min(shares),
            limit=100 * MOST_MOVED, unit="%", note=f"{min(shares):.2f} to {max(shares):.2f} % at {dp_MPa:.1f} MPa, of "
            f"{len(openings)} pressure drops"),
        Row(what=f"{name}: flow at zero command beyond what is allowed", value=closed, limit=1e-9, unit="L/min"),
        Row(what=f"{name}: on release, as the set point steps to the offset", value=released.figures[RELEASED],
            unit="L/min", note=f"at {released.dp_MPa:.1f} MPa; a leak is in it"),
    ]  # fmt: skip


if __name__ == "__main__":
    print_current_valve()
