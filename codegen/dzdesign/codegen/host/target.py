"""The core as a shared library, for simulation and test rigs on a PC."""

from dzdesign.codegen.target import Target
from dzdesign.design.current.circuit import CurrentSampling

FILES = ("dz_host.c", "dz_host.h", "selftest.c", "dz_selftest.c", "dz_selftest.h")
OTHER_FILES = ("CMakeLists.txt", "README.md")

TARGET = Target(
    name="host",
    description="shared library of the core for Windows, Linux and macOS (Python, MATLAB, LabVIEW), with a self-test",
    # Of the F28335, so that the library answers as that firmware does unless another target's design is given.
    compare_max=60_000,
    takes_any_signals=True,
    current_sampling=CurrentSampling(),
    has_timer=False,
    templates={f"host/{file}": f"{file}.jinja" for file in (*FILES, *OTHER_FILES)},
    context={},
)
