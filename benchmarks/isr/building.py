"""Compile, link and run programs around a contender's core; what the three machines share."""

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from contender import Contender

ON_TARGET = Path(__file__).parent / "on_target"
#: The contenders' C and nothing else; C99 also keeps a product and a sum two roundings on an FPU that could fuse them.
C_FLAGS = ("-std=c99", "-O2", "-ffunction-sections", "-fdata-sections")
RUN_TIMEOUT_S = 1800


@dataclass(frozen=True, slots=True, kw_only=True)
class Toolchain:
    """A compiler for one machine.

    Attributes
    ----------
    compiler, size : str
        Programs.
    machine_flags, link_flags : tuple of str
        For every compilation; for the link.
    sections : tuple of str
        Sections that hold code and constants.
    needs : mapping
        Program to the Debian package that has it.
    """

    compiler: str
    size: str
    machine_flags: tuple[str, ...]
    link_flags: tuple[str, ...]
    sections: tuple[str, ...]
    needs: Mapping[str, str]

    def missing(self) -> str:
        """Return which packages to install, or an empty text."""
        packages = sorted({package for program, package in self.needs.items() if not shutil.which(program)})
        return f"needs {', '.join(packages)}" if packages else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """What one contender took on one machine: a count and a compare value for each input."""

    counts: tuple[int, ...]
    compares: tuple[int, ...]

    @property
    def least(self) -> int:
        """Return the smallest count."""
        return min(self.counts)

    @property
    def most(self) -> int:
        """Return the largest count."""
        return max(self.counts)


def run(command: Sequence[str | Path], folder: Path) -> str:
    """Run a program and return its stdout; a failure shows what it said."""
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, capture_output=True, text=True, timeout=RUN_TIMEOUT_S, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit status {done.returncode}\n{done.stderr[-2000:]}")
    return done.stdout + done.stderr


def build(
    toolchain: Toolchain, contender: Contender, programs: Sequence[str], headers: Mapping[str, str], folder: Path
) -> Path:
    """Link programs of `ON_TARGET` with a contender's core.

    The core is compiled apart from the program, so that nothing of it is inlined into the loop that counts.

    Returns
    -------
    Path
        The linked program.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (*contender.sources.items(), *headers.items()):
        (folder / name).write_text(text, encoding="utf-8")
    units = [name for name in contender.sources if name.endswith((".c", ".S"))]
    for name in units:
        run([toolchain.compiler, *toolchain.machine_flags, *C_FLAGS, "-c", name, "-o", f"{name}.o"], folder)
    objects = [f"{name}.o" for name in units]
    for name in programs:
        flags = (*toolchain.machine_flags, "-std=gnu99", "-O2", f"-I{folder}", f"-I{ON_TARGET}")
        run([toolchain.compiler, *flags, "-c", ON_TARGET / name, "-o", f"{name}.o"], folder)
        objects.append(f"{name}.o")
    program = folder / "program.elf"
    run([toolchain.compiler, *toolchain.machine_flags, "-O2", *objects, *toolchain.link_flags, "-o", program], folder)
    return program


def section_bytes(toolchain: Toolchain, program: Path) -> int:
    """Return the bytes of code and constants in a linked program."""
    total = 0
    for line in run([toolchain.size, "-A", program], program.parent).splitlines():
        words = line.split()
        if words and words[0] in toolchain.sections:
            total += int(words[1])
    return total


def known_core(before: str, after: str, length: int) -> Contender:
    """Return a core of known length: `length` no-operations between two pieces of assembly."""
    text = f"{before}\n.rept {length}\nnop\n.endr\n{after}\n"
    return Contender(name=f"known, {length}", made="written for the check of the count", sources={"known.S": text})
