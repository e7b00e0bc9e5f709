"""One firmware in block form with the calibration blocks of many valves: each on every input, compiled once."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_files import read_bytes, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, Sha256, SourceFile
from dzdesign.core.errors import RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.all_inputs import input_check, input_checks
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.lot_check import lot_checked
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.loop_results import about
from dzdesign.verify.requirements import CALIBRATION_BLOCK, Check
from dzdesign.verify.toolchain.bound_block import ACCEPTANCE, BLOCK_HEADER
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import discard

#: Octets of a block, and what is wrong with one.
FUNCTIONS = (Function("dz_size", (), "uint32_t"), Function("dz_calibration_check", ("in",), "uint16_t"))


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockCheck(Artefact):
    """What a firmware does with one calibration block, of whose compensator `made_from` has the hash."""

    FILE_NAME: ClassVar[str] = "calibration_check.json"
    schema: Annotated[
        Literal["dzdesign.calibration-check/1"], Meta(description="Name and version of this schema.")
    ] = "dzdesign.calibration-check/1"
    block_sha256: Annotated[Sha256, about("Hash of the block's octets.")]
    check_sha256: Annotated[Sha256, about("Hash of the C code of dz_calibration_check() that was compiled.")]
    refused: Annotated[int, about("What dz_calibration_check() returns: 0, or what it finds wrong.")]
    inputs: Annotated[tuple[InputCheck, ...], about("One entry a side; empty of a block that is refused.")]
    holds: Annotated[bool, about("Whether it is accepted and nothing was found on any input.")] = field(init=False)

    def __post_init__(self) -> None:
        tried = not self.refused and bool(self.inputs)
        object.__setattr__(self, "holds", tried and all(each.holds for each in self.inputs))

    def requirement(self, name: str, compensator: Compensator) -> Check:
        """Return it as one requirement; `name` says whose block it is."""
        checks: list[Check] = []
        for each in self.inputs:
            checks += input_checks(each, compensator.valve.recorded_units, both_signs=len(self.inputs) > 1)
        missed = [each for each in (*checks, *lot_checked(self.inputs, compensator)) if not each.holds]
        if self.refused:
            text = f"dz_calibration_check() of this firmware refuses it (0x{self.refused:04X}): its output is released"
        elif missed:
            text = "; ".join(f"{each.name}: {each.text}" for each in missed)
        else:
            count = sum(each.inputs for each in self.inputs)
            least = min(each.smallest_margin_V for each in self.inputs)
            hashes = ", ".join(each.outputs_hash for each in self.inputs)
            margin = compensator.valve.recorded_units.text(1e3 * least, ".3f mV")
            text = f"{count} inputs checked, 0 wrong; smallest margin at zero command {margin}; "
            text += f"hash of all compare values {hashes}"
        return CALIBRATION_BLOCK.check(holds=self.holds, text=text, name=f"{CALIBRATION_BLOCK.title}: {name}")


class BlockFirmware:
    """The core in `folder`/core; the compiler runs for the first block alone."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        core = {name: folder / "core" / name for name in (ACCEPTANCE, BLOCK_HEADER)}
        self._acceptance = {name: read_bytes(path, "core of a firmware in block form") for name, path in core.items()}

    def check(self, block: bytes, compensator: Compensator, source: SourceFile) -> BlockCheck:
        """Try a block on every input against the exact law of its compensator, whose file is `source`.

        A core that does not compile, crashes or hangs is a `RequirementError`.
        """
        refused = self._refused(block)
        signs = () if refused else compensator.signals.signs
        return BlockCheck(
            tool=THIS_TOOL,
            made_from=(source,),
            block_sha256=sha256_of(block),
            check_sha256=sha256_of(b"".join(self._acceptance.values())),
            refused=refused,
            inputs=tuple(self._every_input(block, compensator, sign) for sign in signs),
        )

    def _refused(self, block: bytes) -> int:
        """Return what the compiled check finds wrong; it reads as many octets as its block has."""
        size = self._library.call("dz_size")
        if len(block) != size:
            raise RequirementError(f"the block has {len(block)} octets, this firmware's core takes {size}")
        return self._library.call("dz_calibration_check", block)

    @cached_property
    def _library(self) -> CompiledLibrary:
        texts = {name: content.decode(errors="surrogateescape") for name, content in self._acceptance.items()}
        size = f'#include <stdint.h>\n#include "{BLOCK_HEADER}"\nuint32_t dz_size(void);\n'
        size += "uint32_t dz_size(void)\n{\n    return (uint32_t)sizeof(struct dz_calibration);\n}\n"
        return CompiledLibrary({**texts, "dz_size.c": size}, FUNCTIONS, "the check of a block")

    def _every_input(self, block: bytes, compensator: Compensator, sign: int) -> InputCheck:
        prepared = PreparedInputs(ExactLaw(compensator, sign))
        core, inputs = CompiledCore(self._folder, sign, block), prepared.everything()
        try:
            return input_check(prepared, core.sha256, core.check(inputs))
        finally:
            discard(inputs, block)
