"""Small changes of what a statement rests on: a ground left out, a value left out or another; and of its kind.

Another statement in place of a ground is no mutant: where it is true, it gives another right proof.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import sympy

from dzdesign.derivation.account.identity import agree
from dzdesign.derivation.account.proof import relation_of
from dzdesign.derivation.account.statement import Ground, Kind, Statement
from dzdesign.derivation.symbols import AT_PRESSURE_DROPS, Name

_DROPS = {names[index]: names[1 - index] for names in AT_PRESSURE_DROPS.values() for index in (0, 1)}


def ground_mutants(statement: Statement, statements: Mapping[str, Statement]) -> Iterator[tuple[Statement | None, str]]:
    """Yield a statement on other grounds, with its text, or None where the ground says the same."""
    for index, ground in enumerate(statement.grounds):
        others = statement.grounds[:index], statement.grounds[index + 1 :]
        if len(statement.grounds) > 1:
            yield replace(statement, grounds=(*others[0], *others[1])), f"without its ground {ground}"
        for wrong in _other_grounds(ground):
            if _says_the_same(ground, wrong, statements):
                yield None, f"{wrong} for its ground {ground}"
            else:
                yield replace(statement, grounds=(*others[0], wrong, *others[1])), f"{wrong} for its ground {ground}"


def kind_mutants(statement: Statement) -> Iterator[tuple[Statement, str]]:
    """Yield a statement as every other kind; as one that is given it has no grounds left."""
    for kind in Kind:
        if kind is statement.kind or (statement.kind.is_given and not kind.is_given):
            continue  # what is given can't be called derived: it has no grounds
        changed = replace(
            statement,
            kind=kind,
            grounds=() if kind.is_given else statement.grounds,
            eliminate=() if kind.is_given else statement.eliminate,
            condition=None if kind.is_given else statement.condition,
            expected=None if kind.is_given else statement.expected,  # type: ignore[arg-type]  # what is usual of it
        )
        yield changed, f"stated as {kind}"


def _other_grounds(ground: Ground) -> Iterator[Ground]:
    for index, (name, value) in enumerate(ground.at):
        rest = ground.at[:index], ground.at[index + 1 :]
        yield replace(ground, at=(*rest[0], *rest[1]))
        if value in _DROPS:
            yield replace(ground, at=(*rest[0], (name, _DROPS[value]), *rest[1]))
        if value.is_number:
            yield replace(ground, at=(*rest[0], (name, value + 1), *rest[1]))


def _says_the_same(ground: Ground, other: Ground, statements: Mapping[str, Statement]) -> bool:
    one, two = (relation_of(statements[each.number], each) for each in (ground, other))
    sides: list[tuple[sympy.Expr | Name, sympy.Expr | Name]] = [(one.left, two.left), (one.right, two.right)]
    return all(left == right or agree(left, right) for left, right in sides)
