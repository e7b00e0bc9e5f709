"""Statements made up to try the account's engine."""

from dataclasses import replace

import sympy

from dzdesign.derivation.account.account import STATEMENTS
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Ground, Kind, Statement

BY_NUMBER = {statement.number: statement for statement in STATEMENTS}
#: A symbol that no statement has.
FOREIGN = sympy.Symbol("foreign", positive=True)


def changed(number, **changes):
    return [replace(e, **changes) if e.number == number else e for e in STATEMENTS]


def given(number, symbol, value):
    return Statement(number=number, title="", kind=Kind.PREMISE, symbol=symbol, members=(sympy.sympify(value),))


def claim(symbol, member, *numbers, eliminate=(), **more):
    grounds = tuple(Ground(number=number) for number in numbers)
    return Statement(
        number="claim",
        title="",
        kind=Kind.PAPER,
        symbol=symbol,
        members=(sympy.sympify(member),),
        grounds=grounds,
        eliminate=eliminate,
        **more,
    )


def last_words(*statements):
    return prove(statements)[-1].words
