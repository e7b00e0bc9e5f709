"""Designs in fixed and in block form, and both forms' objects for a machine: what the benchmarks of blocks compare."""

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # for the valve and options that the tests share

from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import NODE_MASK
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.dither import Dither
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.example import example_folder
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.toolchain.machines import Machine
from tests.support.core_texts import texts
from tests.support.designs import MEASURED
from tests.support.golden_firmware import FULL, full_options

SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
#: Machine to the target whose fixed form it runs.
TARGETS = {"host": "host", "Cortex-M4": "cortex-m4", "AVR": "host"}
CALLED = ("comp", "comp_checked", "status", "beta")
LAW_AND_DRIVE = ("dz_comp.c", "dz_drive.c")
#: What dz_drive.c and dz_current.c define.
AROUND = ("drive_init", "drive_sample", "drive_tick", "current_init", "current_calibrate", "current_tick")


@dataclass(frozen=True)
class TwoForms:
    """One design."""

    name: str
    compensator: Compensator

    @cached_property
    def block(self) -> bytes:
        """The octets of its calibration block."""
        return pack(block_of(self.compensator, "0" * 64))

    @cached_property
    def block_sources(self) -> dict[str, bytes]:
        """The core in block form."""
        return _encoded(texts(block_core_files(built_for(self.compensator))))

    def fixed_sources(self, machine: Machine, *, current: bool = False) -> dict[str, bytes]:
        """The fixed form of a machine's target; `current`: with the loop behind the drive, which the AVR has not."""
        compensator = self.compensator
        if not current:
            compensator = replace(compensator, current_drive=None, machine=None)
        files = generate(compensator, TARGETS[machine.name]).files
        return _encoded({path[5:]: text for path, text in files.items() if path.startswith("core/")})

    def objects(self, machine: Machine, sign: int) -> list[Path]:
        """Return one side's two forms compiled: dz_comp_fixed(), dz_comp_block() and so on."""
        ending = "_negative" if sign < 0 else ""
        return [
            machine.compile(name, sources, (*machine.core_flags, *_renamed(ending, form)), f"{self.name}, {form} form")
            for name, form, sources in (
                ("dz_comp.c", "fixed", self.fixed_sources(machine)),
                ("dz_comp.c", "block", self.block_sources),
            )
        ]

    def core_objects(self, machine: Machine) -> list[Path]:
        """Return law and drive of both forms compiled; the functions of the fixed form end with _fixed."""
        renamed = [f"-Ddz_{name}{ending}=dz_{name}_fixed{ending}" for ending in ("", "_negative") for name in CALLED]
        renamed += [f"-Ddz_{name}=dz_{name}_fixed" for name in AROUND]
        return [
            machine.compile(name, sources, (*machine.core_flags, *flags), f"{self.name}: {name}")
            for flags, sources in ((renamed, self.fixed_sources(machine)), ((), self.block_sources))
            for name in sources
            if name in LAW_AND_DRIVE
        ]

    @property
    def has_room(self) -> bool:
        """Whether a block has room for the tables of beta."""
        nodes = max(len(self.compensator.side(sign).beta) for sign in self.compensator.signals.signs)
        return nodes <= NODE_MASK

    @property
    def edges(self) -> list[int]:
        """Codes at and beside the ends of the signals' ranges, and beyond the converter's."""
        signals = self.compensator.signals
        ends = {0, signals.code_max, 32767, 65535}
        for signal in (signals.command, signals.pressure_a, signals.pressure_b):
            ends |= {*signal.valid_codes, signal.zero_code}
        return sorted({code + near for code in ends for near in (-1, 0, 1) if 0 <= code + near < 65536})


def block_as_c(octets: bytes) -> str:
    """Return a block as C, dz_block."""
    words = [int.from_bytes(octets[at : at + 2], "little") for at in range(0, len(octets), 2)]
    numbers = ", ".join(f"{word}u" for word in words)
    return (
        f"#include <stdint.h>\nextern const uint16_t dz_block[{len(words)}];\n"
        f"const uint16_t dz_block[{len(words)}] __attribute__((aligned(8))) = {{{numbers}}};\n"
    )


def two_forms() -> Iterator[TwoForms]:
    """Yield the example, the shared measurements where they are here, and designs with everything switched on."""
    example = _identified(example_folder() / "ramps")
    yield TwoForms("example", design(example))
    for name in ("valve_a", "valve_e"):
        if (SHARED / name).is_dir():
            yield TwoForms(name, design(_identified(SHARED / name)))
    content = (FULL / "valve.json").read_bytes()
    options = full_options(play=True)
    valve = read_artefact(content, ValveModel, "valve.json")
    # Recorded with the dither that the design has, so that there may be a play besides.
    dithered = replace(valve, dithered=Dither(frequency_Hz=options.dither_Hz, peak=float(options.dither_peak)))
    everything = design(dithered, options)
    yield TwoForms("two-sided, everything", everything)
    controlled = options_of(MEASURED, target_named("cortex-m4").inputs())
    yield TwoForms("current, supply measured", design(example, controlled))


def _identified(folder: Path) -> ValveModel:
    """Return the valve of a folder's recordings, identified with every default."""
    return identify([read_ramp_file(path) for path in sorted(folder.glob("*.csv.gz"))])


def _renamed(ending: str, form: str) -> list[str]:
    other = "" if ending else "_negative"  # of the other sign, which one object has as well
    renamed = [f"-Ddz_{name}{ending}=dz_{name}_{form}" for name in CALLED]
    return [*renamed, *(f"-Ddz_{name}{other}=dz_other_{name}_{form}" for name in CALLED)]


def _encoded(files: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in files.items() if name.endswith((".c", ".h"))}
