"""The core as a shared library, for simulation and test rigs on a PC."""

from dzdesign.codegen.target import Target
from dzdesign.design.current.circuit import CurrentSampling

FILES = ("dz_host.c", "dz_host.h", "selftest.c", "dz_host.def", "dz_host.map", "dz_host.exp", "Makefile")
SHARED_FILES = ("dz_selftest.c", "dz_selftest.h")
#: What the library shows (of two solenoids `dz_comp_negative` too): the three lists of exports are printed from it.
EXPORTS = (
    "dz_comp",
    "dz_comp_many",
    "dz_compare_max",
    "dz_adc_code_max",
    "dz_drive_init",
    "dz_drive_sample",
    "dz_drive_tick",
)

TARGET = Target(
    name="host",
    description="shared library of the core for Windows, Linux and macOS (Python, MATLAB, LabVIEW), with a self-test",
    # Of the F28335, so that the library answers as that firmware does unless another target's design is given.
    compare_max=60_000,
    takes_any_signals=True,
    current_sampling=CurrentSampling(),
    has_timer=False,
    templates={f"host/{file}": f"{file}.jinja" for file in (*FILES, *SHARED_FILES, "CMakeLists.txt", "README.md")},
    context={
        "exports_for_windows": "\n".join(f"    {name}" for name in EXPORTS),
        "exports_for_linux": "\n".join(f"        {name};" for name in EXPORTS),
        "exports_for_macos": "\n".join(f"_{name}" for name in EXPORTS),
    },
)
