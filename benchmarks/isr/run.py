"""Benchmark of the generated core against what others would flash: ``run.py [--compensator compensator.json]``.

One run, one Markdown table: instructions a call on x86-64 (callgrind) and on a Cortex-M4F (QEMU), cycles on AVR
(simavr), bytes of code and constants, wrong compare values of all inputs and the largest error; then the goals.
Counts are from the core's first instruction to its return. Exit status 1 if a goal is missed.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share
sys.path.insert(0, str(Path(__file__).parents[2]))  # for what tests support
sys.path.insert(0, str(Path(__file__).parents[1] / "blocks"))  # for the designs in both forms

import on_avr
import on_cortex_m4
import on_x86
from block_costs import block_rows
from contender import our_forms
from goals import goals, zero_band_goals
from interrupt import interrupt_goals
from measuring import Measured, measure
from rival_cores import rivals
from scoreboard import Row, keep_rows, markdown, markdown_rows, say
from tried_inputs import RANDOM_INPUTS, SEED, SIGNALS, Codes, expected_compares, has_whole_range, tried_inputs

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions

KNOWN_LENGTHS = (0, 7, 300)
WRONG_RANGE = (
    "a command or pressure has codes that are none, as of 4..20 mA, and the rivals know only signals over the whole "
    "range of the converter; design it with such, or leave --compensator out"
)


def main(arguments: list[str] | None = None) -> int:
    """Measure all contenders, print the table and the goals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--compensator", type=Path, help="compensator.json; without it the bundled example is designed")
    parser.add_argument("--rows", type=Path, metavar="FILE", help="also write the goals there, as JSON")
    parser.add_argument("--only", choices=("blocks",), help="the core in block form over the fixed form, nothing else")
    chosen = parser.parse_args(arguments)
    for machine in (on_x86.X86, on_cortex_m4.CORTEX_M4, on_avr.AVR):
        if missing := machine.missing():
            print(f"benchmark: {machine.compiler}: {missing}; apt-get install it", file=sys.stderr)
            return 2
    start = perf_counter()
    if chosen.only:
        return _judged(_blocks(), chosen.rows, start)
    compensator = _compensator(chosen.compensator)
    if not has_whole_range(compensator.signals):
        print(f"benchmark: {chosen.compensator}: {WRONG_RANGE}", file=sys.stderr)
        return 2
    inputs = tried_inputs(compensator)
    expected = expected_compares(compensator, inputs)
    contenders = our_forms(compensator) + rivals(compensator)
    with tempfile.TemporaryDirectory(prefix="bench-isr-") as folder:
        _validate(inputs[:3], Path(folder))
        results = []
        for index, contender in enumerate(contenders):
            say(f"{contender.name} ...")
            results.append(measure(contender, compensator, inputs, expected, Path(folder) / str(index)))
        with_band = _with_zero_band(compensator, Path(folder))
        of_interrupt = interrupt_goals(design(compensator.valve), Path(folder) / "interrupt")
    nodes, compare_max = len(compensator.positive.beta), compensator.signals.compare_max
    print(
        f"\nLaw `{compensator.law}`, {nodes} nodes of beta, compare 0..{compare_max}. Counts from its first "
        f"instruction to its return, least-most over {len(inputs)} inputs: corners, edges of nodes, impossible codes, "
        f"{RANDOM_INPUTS} random (seed {SEED}). All compiled with -std=c99 -O2.\n"
    )
    print(markdown(Measured.HEADINGS, [result.cells() for result in (*results, *with_band)]))
    print("\nHow each was made:\n")
    print("\n".join(f"- {contender.name}: {contender.made}" for contender in contenders))
    return _judged([*goals(results), *zero_band_goals(with_band), *of_interrupt, *_blocks()], chosen.rows, start)


def _blocks() -> list[Row]:
    with tempfile.TemporaryDirectory(prefix="bench-isr-") as folder:
        return block_rows(Path(folder))


def _judged(rows: list[Row], file: Path | None, start: float) -> int:
    """Print and keep the goals; 1 if one is missed."""
    keep_rows(rows, file)
    print("\n" + markdown_rows(rows))
    missed = sum(row.verdict == "MISSES" for row in rows)
    limits = sum(row.limit is not None for row in rows)
    print(f"\n{missed} of {limits} goals missed; {perf_counter() - start:.0f} s", flush=True)
    return 1 if missed else 0


def _with_zero_band(plain: Compensator, folder: Path) -> list[Measured]:
    """Measure the product's core as it is by default, with zero band and transition: what the rivals do not have."""
    default = design(plain.valve, DesignOptions(signals=SIGNALS, accept=("broken-sensor",)))
    inputs = tried_inputs(default)
    expected = expected_compares(default, inputs)
    found = []
    for contender in our_forms(default):
        named = replace(contender, name=f"{contender.name}, zero band and transition")
        say(f"{named.name} ...")
        found.append(measure(named, default, inputs, expected, folder / f"band{len(found)}"))
    return found


def _compensator(path: Path | None) -> Compensator:
    if path:
        return read_artefact(path.read_bytes(), Compensator, str(path))
    from dzdesign.example import example_folder
    from dzdesign.identify.identification import identify
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    ramps = example_folder() / "ramps"
    valve = identify([read_ramp_file(ramp) for ramp in sorted(ramps.glob("*.csv.gz"))])
    # As the rivals: the paper's law alone.
    return design(valve, DesignOptions(transition=Fraction(0), signals=SIGNALS, accept=("broken-sensor",)))


def _validate(inputs: Sequence[Codes], folder: Path) -> None:
    """Count cores of known length; a count that is off ends the benchmark."""
    for machine, unit in (
        (on_x86, "instructions, x86-64"),
        (on_cortex_m4, "instructions, M4"),
        (on_avr, "cycles, AVR"),
    ):
        for length in KNOWN_LENGTHS:
            found = set(machine.count(machine.known(length), inputs, folder / f"known{length}").counts)
            if found != {length + machine.RETURN}:
                raise RuntimeError(f"{unit}: {length} no-operations and a return were counted as {sorted(found)}")
        say(f"{unit}: right for {KNOWN_LENGTHS} no-operations and a return")


if __name__ == "__main__":
    raise SystemExit(main())
