"""Cores in block form as folders, and their check of blocks called from Python."""

import ctypes
from pathlib import Path

from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import FINDINGS, block_core_files
from dzdesign.codegen.calibration.layout import BuiltFor
from dzdesign.codegen.calibration.packing import pack
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.design.compensator import Compensator
from tests.support.c_library import load_library
from tests.support.core_texts import texts


def block_folder(compensator: Compensator, folder: Path) -> Path:
    """Write the core in block form, the compensator and its block, as a firmware folder has them."""
    document = to_json_bytes(compensator)
    (folder / "core").mkdir(parents=True)
    for name, text in texts(block_core_files(built_for(compensator))).items():
        (folder / "core" / name).write_text(text, encoding="utf-8")
    (folder / "compensator.json").write_bytes(document)
    (folder / "calibration.bin").write_bytes(pack(block_of(compensator, sha256_of(document))))
    return folder


class CompiledCheck:
    """dz_calibration_check() of a firmware, compiled for this machine."""

    def __init__(self, built: BuiltFor, edit=lambda text: text) -> None:
        sources = texts(block_core_files(built))
        sources = {name: sources[name] for name in ("dz_calibration.c", "dz_calibration.h")}
        sources["dz_calibration.c"] = edit(sources["dz_calibration.c"])
        self._library = load_library(sources, "the check of a block")
        self._library.dz_calibration_check.restype = ctypes.c_uint16

    def findings(self, octets: bytes) -> set[str]:
        """Return the names of the bits that the check sets."""
        bits = self._library.dz_calibration_check(ctypes.create_string_buffer(octets, len(octets)))
        return {name for place, name in enumerate(FINDINGS) if bits >> place & 1}
