"""Wrong checks of calibration blocks: which of them another verdict on some block gives away."""

import ctypes
import random
import subprocess
from collections.abc import Sequence
from pathlib import Path

from dzdesign.codegen.calibration.acceptance import refusals
from dzdesign.codegen.calibration.files import FINDINGS, block_core_files
from dzdesign.codegen.calibration.packing import pack
from dzdesign.core.errors import RequirementError
from tests.support.c_library import load_library
from tests.support.core_mutants import Mutant, mutants_of
from tests.support.core_texts import texts

CHECK = "dz_calibration.c"
BITS = {name: 1 << place for place, name in enumerate(FINDINGS)}
#: Reads blocks from its input and prints the check's verdict of each: what is read beyond a block ends it.
PROGRAM = """#include <stdio.h>
#include <stdlib.h>
#include "dz_calibration.h"
int main(void)
{
    struct dz_calibration *block = malloc(sizeof *block);
    while (fread(block, sizeof *block, 1, stdin) == 1) {
        printf("%u\\n", (unsigned)dz_calibration_check(block));
    }
    free(block);
    return 0;
}
"""
SANITIZED = ("-std=c99", "-O1", "-fsanitize=address,undefined,bounds-strict", "-fno-sanitize-recover=all")


def verdict(block, built) -> int:
    """The bits that a right check sets of a block with a right CRC."""
    return sum(BITS[name] for name in refusals(block, built))


class Corpus:
    """Blocks, the first accepted, with the verdict that each must get; some of them are damaged."""

    def __init__(self, built, blocks) -> None:
        self.built = built
        found = {pack(block): verdict(block, built) for block in blocks}
        whole = next(iter(found))
        for octets in list(found)[1::50]:  # with the CRC of another block
            found[octets[:-4] + whole[-4:]] = found[octets] | BITS["CRC"]
        for place in range(len(whole) - 4, len(whole)):
            found[whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :]] = BITS["CRC"]
        self.octets, self.expected = list(found), list(found.values())
        files = texts(block_core_files(built))
        #: The check as it is generated, and its header.
        self.sources = {name: files[name] for name in (CHECK, "dz_calibration.h")}
        self._all = ctypes.create_string_buffer(b"".join(self.octets), sum(map(len, self.octets)))

    def mutants(self) -> list[Mutant]:
        return list(mutants_of(CHECK, self.sources[CHECK]))

    def killed(self, text: str) -> bool | None:
        """Whether a block gets another verdict from a check; None: the compiler refuses it."""
        try:
            library = load_library(self._texts(text), "a wrong check")
        except RequirementError:
            return None
        library.dz_calibration_check.restype = ctypes.c_uint16
        size, start = len(self.octets[0]), ctypes.addressof(self._all)
        for index, expected in enumerate(self.expected):
            if library.dz_calibration_check(ctypes.c_void_p(start + index * size)) != expected:
                return True
        return False

    def killed_sanitized(self, text: str, folder: Path) -> bool:
        """Whether the check, its reads and shifts watched, is stopped on a block or says otherwise of it."""
        for name, each in {**self._texts(text), "main.c": PROGRAM}.items():
            (folder / name).write_text(each)
        program = folder / "check"
        command = ["gcc", *SANITIZED, CHECK, "main.c", "-o", program]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        done = subprocess.run([program], input=bytes(self._all), capture_output=True, check=False)
        return done.returncode != 0 or done.stdout.split() != [b"%d" % each for each in self.expected]

    def same_code(self, text: str, folder: Path) -> bool:
        """Whether an optimizing compiler makes the same of a check as of the right one: proof that they are equal."""
        for compiler in ("gcc", "clang"):
            made = []
            for each in (self.sources[CHECK], text):
                for name, content in self._texts(each).items():
                    (folder / name).write_text(content)
                command = [compiler, "-std=c99", "-O2", "-S", CHECK, "-o", "-"]
                done = subprocess.run(command, cwd=folder, check=True, capture_output=True)
                made.append(done.stdout)
            if made[0] == made[1]:
                return True
        return False

    def _texts(self, text: str) -> dict[str, str]:
        return {**self.sources, CHECK: text}


def drawn_mutants(corpora: Sequence[Corpus], count: int | None, seed: int) -> list[tuple[Corpus, Mutant]]:
    """So many mutants of all firmware's checks; all of them for None."""
    every = [(corpus, mutant) for corpus in corpora for mutant in corpus.mutants()]
    return every if count is None else random.Random(seed).sample(every, min(count, len(every)))
