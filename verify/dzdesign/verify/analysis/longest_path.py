"""The most instructions and the deepest stack of a Cortex-M's functions, over all paths of their machine code.

What a path needs is not asked: one that no data ever takes counts too. So this holds for any data, and is a bound where
there is neither a loop nor recursion; with one of these there is none, and that is said.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from dzdesign.core.errors import RequirementError

FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
LINE = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t([^@;]*))?")
RELOCATION = re.compile(r"^\s+([0-9a-f]+): R_ARM_\S+\t(\S+)")
TARGET = re.compile(r"\b([0-9a-f]+) <[^>]*>\s*$")
BRANCH = re.compile(r"^(?:b(?P<when>eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?(?:\.[nw])?|cbn?z)$")
#: One register stored or loaded below or from the stack's end, and room taken or given back.
STORED, LOADED = re.compile(r"\[sp, #-(\d+)\]!"), re.compile(r"\[sp\], #(\d+)")
MOVED = re.compile(r"^sp, (?:sp, )?#(\d+)\s*$")
LOOKED_UP = ("tbb", "tbh", "blx", "svc")
WORD = 4
NAMED = {"sl": 10, "fp": 11, "ip": 12, "sp": 13, "lr": 14, "pc": 15}
REGISTERS = {f"r{number}": number for number in range(16)} | NAMED
#: Place behind a function's last instruction.
BEYOND = -1


@dataclass(slots=True)
class Instruction:
    """One instruction: where it may go on, the function that it calls, and the bytes by which the stack grows."""

    mnemonic: str
    operands: str
    #: Whether it is left out where a condition of an IT instruction before it fails.
    conditional: bool
    following: list[int] = field(default_factory=list)
    called: str = ""
    grows: int = 0


@dataclass(frozen=True, slots=True)
class Bound:
    """The most of a call, whatever its data: instructions to its return, and bytes of stack."""

    instructions: int
    stack_bytes: int


def bounds(disassembly: str, names: Iterable[str]) -> dict[str, Bound]:
    """Return the bounds of some functions of ``objdump -dr --no-show-raw-insn``.

    A loop, recursion, a jump by a table and a function that is not there have none: `RequirementError`.
    """
    functions = _functions(disassembly)
    found: dict[str, Bound] = {}
    for name in names:
        _bound(name, functions, found, ())
    return {name: found[name] for name in names}


def _functions(disassembly: str) -> dict[str, dict[int, Instruction]]:
    functions: dict[str, dict[int, Instruction]] = {}
    body: dict[int, Instruction] = {}
    left = 0  # instructions that an IT makes conditional
    for line in disassembly.splitlines():
        if start := FUNCTION.match(line):
            if start[1] in functions:
                raise RequirementError(f"two functions are named {start[1]}: no bound of either")
            body = functions[start[1]] = {}
            left = 0
        elif found := RELOCATION.match(line):
            if (at := body.get(int(found[1], 16))) and at.mnemonic.startswith("b"):
                at.called = found[2]
        elif (found := LINE.match(line)) and not found[2].startswith("."):
            body[int(found[1], 16)] = Instruction(found[2], (found[3] or "").strip(), left > 0)
            left = len(found[2]) - 1 if re.fullmatch("it[te]{0,3}", found[2]) else max(left - 1, 0)
    return functions


def _join(name: str, instructions: dict[int, Instruction]) -> None:
    """Find where each instruction of a function goes on, and how it moves the stack's end."""
    places = list(instructions)
    for place, after in zip(places, [*places[1:], BEYOND], strict=True):
        at = instructions[place]
        at.grows = _grows(name, at)
        to_pc = at.operands.startswith("pc,") and not LOADED.search(at.operands)
        if at.mnemonic in LOOKED_UP or to_pc or (at.mnemonic.startswith("bx") and at.operands != "lr"):
            raise RequirementError(f"{name}() goes on at an address of its data ({at.mnemonic}): no bound")
        leaves = _returns(at) and not at.conditional
        if branch := BRANCH.match(at.mnemonic):
            if not at.called:
                if not (target := TARGET.search(at.operands)):
                    raise RequirementError(f"{name}() branches to {at.operands!r}: no bound")
                at.following.append(int(target[1], 16))
            leaves = not branch["when"] and not at.mnemonic.startswith("cb") and not at.conditional
        if not leaves:
            at.following.append(after)


def _returns(at: Instruction) -> bool:
    loads = at.mnemonic.startswith(("pop", "ldm", "ldr"))
    return at.mnemonic.startswith("bx") or (loads and re.search(r"(?:\{.*|^)\bpc\b", at.operands) is not None)


def _grows(name: str, at: Instruction) -> int:
    """Return the bytes by which an instruction makes the stack deeper, less than 0 where it gives them back."""
    what = at.mnemonic.partition(".")[0].removesuffix("w")
    listed = re.search(r"\{(.*)\}", at.operands)
    if listed and (at.mnemonic.startswith(("push", "pop")) or at.operands.startswith("sp!")):
        return WORD * _count(listed[1]) * (1 if at.mnemonic.startswith(("push", "stm")) else -1)
    if what in ("add", "sub") and (moved := MOVED.match(at.operands)):
        return int(moved[1]) * {"sub": 1, "add": -1}[what]
    if at.operands.startswith("sp,") and what != "cmp":
        raise RequirementError(f"{name}() takes stack by its data ({at.mnemonic} {at.operands}): no bound")
    if found := STORED.search(at.operands):
        return int(found[1])
    return -int(found[1]) if (found := LOADED.search(at.operands)) else 0


def _count(registers: str) -> int:
    count = 0
    for part in registers.split(","):
        first, _, last = part.strip().partition("-")
        count += 1 + (REGISTERS[last.strip()] - REGISTERS[first.strip()] if last else 0)
    return count


def _bound(
    name: str, functions: Mapping[str, dict[int, Instruction]], found: dict[str, Bound], callers: tuple[str, ...]
) -> Bound:
    if name in callers:
        raise RequirementError(f"{name}() calls itself, perhaps by others: no bound")
    if name not in functions:
        raise RequirementError(f"{name}() is called and not there: no bound")
    if name not in found:
        _join(name, functions[name])
        of_call = {
            place: _bound(at.called, functions, found, (*callers, name)) if at.called else Bound(0, 0)
            for place, at in functions[name].items()
        }
        found[name] = _longest(name, functions[name], of_call.__getitem__)
    return found[name]


def _longest(name: str, instructions: dict[int, Instruction], of_call: Callable[[int], Bound]) -> Bound:
    """Return the most over all paths from the first instruction to a return."""
    done: dict[int, Bound] = {}
    entered: set[int] = set()
    todo = [next(iter(instructions))]
    while todo:
        place = todo[-1]
        if place in done:
            todo.pop()
            continue
        if place not in instructions:
            raise RequirementError(f"{name}() goes on at {place:#x}, which is none of its instructions: no bound")
        at = instructions[place]
        open_ones = [each for each in at.following if each not in done]
        if place in entered and open_ones:
            raise RequirementError(f"{name}() has a loop: no bound")
        if open_ones:
            entered.add(place)
            todo += open_ones
            continue
        after = [done[each] for each in at.following] or [Bound(0, 0)]
        called = of_call(place)
        done[place] = Bound(
            1 + called.instructions + max(each.instructions for each in after),
            max(0, called.stack_bytes, at.grows + max(each.stack_bytes for each in after)),
        )
    return done[next(iter(instructions))]
