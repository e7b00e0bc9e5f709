"""The core that an FMU carries as sources, as a folder in which a closed loop finds it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.fmu.fmu_file import FmuFile

SOURCES = "sources/dz_"
#: What the FMU has of its own around the core.
WRAPPER = "sources/dz_fmu.c"


@contextmanager
def firmware_folder(fmu: FmuFile) -> Iterator[Path]:
    """Give a folder with the core of a compensator's FMU, where a firmware has it."""
    with scratch_folder() as place:
        core = place / "core"
        core.mkdir()
        for path, content in fmu.files.items():
            if path.startswith(SOURCES) and path != WRAPPER:
                (core / path.rpartition("/")[2]).write_bytes(content)
        yield place
