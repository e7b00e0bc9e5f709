"""Tells what only rearranges a definition, or one premise, from what is derived: both follow, one says nothing new."""

from collections.abc import Mapping

import sympy

from dzdesign.derivation.account.identity import agree
from dzdesign.derivation.account.proof import Verdict
from dzdesign.derivation.account.statement import Kind, Outcome, Statement


def is_rearrangement(verdict: Verdict, book: Mapping[str, Verdict]) -> bool:
    """Return whether a statement that follows is one equation in another form; `book` is the account, by number.

    It is if all that it rests on is one premise or assumption with definitions and choices put in, and nothing had to
    be decided or differentiated; or if it repeats its only ground.
    """
    statement = verdict.statement
    if verdict.outcome is not Outcome.FOLLOWS:
        return False
    if _repeats_its_ground(statement, book):
        return True
    return _is_plain(statement, book) and len(_sources(statement, book)) <= 1


def _repeats_its_ground(statement: Statement, book: Mapping[str, Verdict]) -> bool:
    if len(statement.grounds) != 1:
        return False
    ground = book[statement.grounds[0].number].statement
    return ground.symbol == statement.symbol and agree(ground.members[-1], statement.members[-1])


def _is_plain(statement: Statement, book: Mapping[str, Verdict]) -> bool:
    """Whether neither a statement nor what it rests on decides between cases or differentiates."""
    grounds = [book[ground.number].statement for ground in statement.grounds]
    decides = any(member.has(sympy.Piecewise) for one in (statement, *grounds) for member in one.members)
    if decides or statement.cases or any(ground.derivative for ground in statement.grounds):
        return False
    return all(_is_plain(one, book) for one in grounds)


def _sources(statement: Statement, book: Mapping[str, Verdict]) -> frozenset[str]:
    """Return the premises and assumptions at the bottom."""
    if statement.kind.is_given:
        return frozenset() if statement.kind in (Kind.DEFINITION, Kind.CHOICE) else frozenset((statement.number,))
    grounds = (book[ground.number].statement for ground in statement.grounds)
    return frozenset().union(*(_sources(one, book) for one in grounds))
