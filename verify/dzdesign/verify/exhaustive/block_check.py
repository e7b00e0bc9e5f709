"""Whether a firmware in block form accepts the calibration block in its folder, and refuses it damaged.

Its own C decides: `dz_calibration_check()` of core/, and the block that its target's dz_block.c links.

One firmware in block form with the calibration blocks of many valves: each on every input, compiled once.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, ClassVar, Literal
from zlib import crc32

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import THIS_TOOL, Artefact, Sha256, SourceFile
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import BLOCK_FILE, FirmwareManifest
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.all_inputs import input_check, input_checks, lot_checked
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.loop_results import about
from dzdesign.verify.requirements import CALIBRATION_BLOCK, OWN_BLOCK, Check
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import ACCEPTANCE, BLOCK_HEADER, PROGRAMS, block_of

PROGRAM = "own_block.c"
#: Files of a target with the block as C, which are compiled here too.
BLOCK_SOURCE, LINKED_HEADER = "dz_block.c", "dz_block.h"
#: Octets of a block, and what is wrong with one; and of a firmware's own block.
FUNCTIONS = (Function("dz_size", (), "uint32_t"), Function("dz_calibration_check", ("in",), "uint16_t"))
OF_OWN = (*FUNCTIONS, Function("dz_linked", ("out",)), Function("dz_header", ("out",)))
#: Words of the header, what of one is changed, and where the hash of the compensator stands.
HEADER_WORDS, CHANGES, DIGEST_AT = 10, (0x0001, 0x0100, 0x8000, 0xFFFF), 20


def own_block_accepted(folder: Path, manifest: FirmwareManifest) -> tuple[Check, ...]:
    """Tell whether calibration.bin and dz_block.c are one block, of this compensator, that the firmware accepts.

    Nothing of a firmware with the numbers of its valve in it.
    """
    if manifest.calibration != "block":
        return ()
    try:
        text, fault = _tried(folder, manifest)
    except (InputError, RequirementError) as error:  # its files are there or not: that is what is asked
        text, fault = "", str(error)
    return (OWN_BLOCK.check(holds=not fault, text=fault or text),)


def _tried(folder: Path, manifest: FirmwareManifest) -> tuple[str, str]:
    """Return what was found, and the first fault in words or an empty text."""
    block, library = block_of(folder), _own_library(folder, manifest)
    if block is None:
        return "", f"core/ has no {ACCEPTANCE}, which every core in block form has"
    size, header = library.call("dz_size"), np.zeros(HEADER_WORDS, dtype="<u2")
    if len(block) != size:
        return "", f"{BLOCK_FILE} has {len(block)} octets, this firmware's block has {size}"
    linked = np.zeros(size, dtype=np.uint8)
    library.call("dz_linked", linked)
    library.call("dz_header", header)

    def refuses(octets: bytes) -> int:
        return library.call("dz_calibration_check", octets)

    bits = [_changed(block, at, 1 << at % 8) for at in range(size)]
    headers = [_sealed(_changed(block, int(at), change)) for at, change in product(header, CHANGES)]
    differ = sum(one != other for one, other in zip(block, linked.tobytes(), strict=True))
    accepted, header_accepted = (sum(not refuses(each) for each in damaged) for damaged in (bits, headers))
    refused, linked_refused = refuses(block), refuses(linked.tobytes())
    for is_fault, text in (
        (refused, f"dz_calibration_check() of this firmware refuses {BLOCK_FILE} (0x{refused:04X})"),
        (differ, f"{differ} octets of {BLOCK_SOURCE} are not those of {BLOCK_FILE}"),
        (linked_refused, f"dz_calibration_check() of this firmware refuses {BLOCK_SOURCE} (0x{linked_refused:04X})"),
        (_sealed(block) != block, f"the CRC-32 in {BLOCK_FILE} is not that of its octets"),
        (accepted, f"dz_calibration_check() accepts {accepted} of {len(bits)} blocks with one bit changed"),
        (header_accepted, f"dz_calibration_check() accepts {header_accepted} of {len(headers)} changed headers"),
        (_named_digest(block) != _digest(folder), f"{BLOCK_FILE} is the block of another compensator.json"),
    ):
        if is_fault:
            return "", f"{text}; make the firmware again with `dzdesign codegen --calibration block`"
    text = f"{BLOCK_FILE} and {BLOCK_SOURCE} are one block of {size} octets, of this compensator.json, and accepted; "
    text += f"refused: {len(bits)} blocks with one bit changed, {len(headers)} changed headers with a right CRC"
    return text, ""


def _changed(block: bytes, at: int, change: int) -> bytes:
    """Return a block with other bits in the word that begins there."""
    word = int.from_bytes(block[at : at + 2], "little") ^ change
    return block[:at] + word.to_bytes(2, "little")[: len(block) - at] + block[at + 2 :]


def _sealed(block: bytes) -> bytes:
    """Return a block with the CRC-32 of its octets, which stands last."""
    return block[:-4] + crc32(block[:-4]).to_bytes(4, "little")


def _digest(folder: Path) -> str:
    return sha256_of(read_bytes(folder / "compensator.json", "compensator of the firmware"))


def _named_digest(block: bytes) -> str:
    return block[DIGEST_AT : DIGEST_AT + 32].hex()


def _own_library(folder: Path, manifest: FirmwareManifest) -> CompiledLibrary:
    """Return the check of blocks of a firmware, and its block as C."""
    linked = [folder / name for name in manifest.files if name.endswith(f"/{BLOCK_SOURCE}")]
    if len(linked) != 1:
        raise RequirementError(f"the manifest names {len(linked)} files {BLOCK_SOURCE}, expected one")
    paths = {
        ACCEPTANCE: folder / "core" / ACCEPTANCE, BLOCK_HEADER: folder / "core" / BLOCK_HEADER,
        BLOCK_SOURCE: linked[0], LINKED_HEADER: linked[0].with_name(LINKED_HEADER), PROGRAM: PROGRAMS / PROGRAM,
    }  # fmt: skip
    texts = {name: read_bytes(path, "file of a firmware in block form") for name, path in paths.items()}
    sources = {name: content.decode(errors="surrogateescape") for name, content in texts.items()}
    return CompiledLibrary(sources, OF_OWN, "dz_calibration_check()")


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
        core = CompiledCore(self._folder, sign, block)
        return input_check(prepared, core.sha256, core.check(prepared.everything()))
