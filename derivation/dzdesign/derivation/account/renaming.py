"""Whether a ground taken at one pressure drop is taken there as a whole, and one taken at a number says so."""

from collections.abc import Mapping, Sequence

import sympy
from sympy.core.function import AppliedUndef

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.identity import agree
from dzdesign.derivation.account.statement import Ground, Kind, Statement
from dzdesign.derivation.symbols import AT_PRESSURE_DROPS, Name, gamma_0, gamma_1

#: Names at dP0 and at dP1 of one quantity.
_PAIRS = (*AT_PRESSURE_DROPS.values(), (gamma_0, gamma_1))


def find_renaming_fault(statement: Statement, premise: Statement, ground: Ground) -> str:
    """Say what is wrong with the values at which a statement takes a premise; nothing if all is right."""
    replaced = dict(ground.at)
    member = premise.members[ground.member]
    present = premise.symbol.free_symbols | {premise.symbol} | member.free_symbols | member.atoms(AppliedUndef)
    for title, names in _families(present, replaced):
        left = sorted(str(name) for name, meant in names.items() if replaced.get(name) != meant)
        if left:
            return f"{ground.number} is taken {title}, but not its {', '.join(left)}"
    if replaced.get(premise.symbol, premise.symbol) != premise.symbol:
        return ""  # a value of another name: it says nothing of the symbol elsewhere
    limits = sympy.And.make_args(statement.scope.where)
    for name, value in ground.at:
        if value.is_number and name in present and sympy.Eq(name, value) not in limits:
            return f"{ground.number} is taken at {name} = {value}, which the scope does not say"
    return ""


def _families(present: set[sympy.Basic], replaced: dict[Name, sympy.Expr]) -> list[tuple[str, dict[Name, Name]]]:
    """Return what a ground is taken at, with all names that then need another: those of the drop that it leaves."""
    generic = {name: names for name, names in AT_PRESSURE_DROPS.items() if name in present}
    found = []
    for index in (0, 1):
        if any(replaced.get(name) == names[index] for name, names in generic.items()):
            found.append((f"at dP{index}", {name: names[index] for name, names in generic.items()}))
        moved = {pair[1 - index]: pair[index] for pair in _PAIRS if pair[1 - index] in present}
        if any(replaced.get(name) == value for name, value in moved.items()):
            found.append((f"from dP{1 - index} to dP{index}", moved))
    return found


def check_grounds(statement: Statement, earlier: Mapping[str, Statement], order: Sequence[str]) -> None:
    """Raise `RequirementError` if a statement rests on itself, a later one, an unknown one, or a copy of itself."""
    for ground in statement.grounds:
        if ground.number == statement.number:
            raise RequirementError(f"{statement.number} is its own premise")
        if ground.number in order and ground.number not in earlier:
            raise RequirementError(
                f"{statement.number} rests on {ground.number}, which stands after it: that may be circular"
            )
        if ground.number not in earlier:
            raise RequirementError(f"{statement.number} rests on {ground.number}, which is not stated")
        # A tie between `law.py` and the paper compares two transcriptions, so there a copy is the point.
        # A special case of an earlier statement is a result; the statement itself is not.
        premise = earlier[ground.number]
        is_copy = premise.symbol == statement.symbol and agree(premise.members[-1], statement.members[-1])
        if is_copy and statement.kind is not Kind.LAW and ground.derivative is None:
            raise RequirementError(f"{statement.number} rests on a copy of itself, {ground.number}")
