"""Proves statements from the premises that they name, and from nothing else.

A premise has no grounds and is taken as given; anything else follows if its grounds, solved for its symbol, give each
of its members exactly. Where they do not, the difference is factored: it says on which condition they would.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import sympy
from sympy.core.relational import Relational

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.solving import (
    Finding,
    NotDerivedError,
    Relation,
    Step,
    agree,
    judge_condition,
    solve_relations,
)
from dzdesign.derivation.account.statement import Case, Ground, Kind, Outcome, Statement
from dzdesign.derivation.symbols import Name


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseProof:
    """The derivation of one case of a statement; most statements have a single one, without words."""

    case: Case
    #: What the grounds give for the symbol.
    derived: sympy.Expr
    #: Derived minus published, one per member; zero where they agree.
    discrepancies: tuple[sympy.Expr, ...]
    #: The statement's symbol and the eliminated ones, solved for; and how, one ground after another.
    solution: Mapping[Name, sympy.Expr]
    steps: tuple[Step, ...]
    #: The form in which a derivation states the result: as published, or as derived where the two differ.
    reached: sympy.Expr
    #: The last member's branch of this case, in the symbols of the statement.
    published: sympy.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What the engine found about one statement."""

    statement: Statement
    outcome: Outcome
    #: The outcome with its condition, or the reason, in words.
    words: str
    #: Whether a correct account finds this.
    as_expected: bool
    #: One per case; empty for what is given and for what could not be solved.
    proofs: tuple[CaseProof, ...] = ()
    #: Whether the condition was proved necessary; None where there is none.
    necessary: bool | None = None
    #: Grounds that follow only on a condition, which this statement therefore needs too.
    inherited: tuple[str, ...] = ()
    #: What is wrong with its units; empty where they are right.
    unit_error: str = ""

    @property
    def number(self) -> str:
        return self.statement.number

    @property
    def holds(self) -> bool:
        """Whether other statements may rely on it."""
        return self.outcome is not Outcome.DOES_NOT_FOLLOW


#: Tries a statement that was judged, of an account given by number, on numbers; returns what they say against it.
Hear = Callable[[Verdict, Mapping[str, Statement]], str]


def prove(statements: Sequence[Statement], hear: Hear | None = None) -> tuple[Verdict, ...]:
    """Judge each statement from its grounds, in order; it holds only if everything it rests on holds.

    What `hear` objects to does not follow, whatever its proof.

    Raises
    ------
    RequirementError
        If a number appears twice, or a statement rests on what is not stated before it, or on a copy of itself. As
        each statement rests on earlier ones only, no chain of premises can be circular.
    """
    earlier: dict[str, Statement] = {}
    verdicts: dict[str, Verdict] = {}
    for statement in statements:
        if statement.number in earlier:
            raise RequirementError(f"{statement.number} is stated twice")
        check_grounds(statement, earlier)
        verdict, error = judge(statement, earlier, verdicts), statement.unit_error()
        # What does not follow may be wrong in its units too, nothing else may.
        verdict = replace(verdict, unit_error=error, as_expected=verdict.as_expected and not (error and verdict.holds))
        earlier[statement.number] = statement
        if hear is not None and verdict.as_expected:
            verdict = overrule(verdict, hear(verdict, earlier))
        verdicts[statement.number] = verdict
    return tuple(verdicts.values())


def check_grounds(statement: Statement, earlier: Mapping[str, Statement]) -> None:
    """Raise `RequirementError` if a statement rests on what is not stated before it, or on a copy of itself."""
    if statement.kind.is_given == bool(statement.grounds):
        wanted = "has no" if statement.kind.is_given else "needs"
        raise RequirementError(f"{statement.number}: a statement of kind {statement.kind} {wanted} grounds")
    for ground in statement.grounds:
        if ground.number not in earlier:
            raise RequirementError(f"{statement.number} rests on {ground.number}, which is not stated before it")
        # A tie between `law.py` and the paper compares two transcriptions, so there a copy is the point.
        # A special case of an earlier statement is a result; the statement itself is not.
        premise = earlier[ground.number]
        is_copy = premise.symbol == statement.symbol and agree(premise.members[-1], statement.members[-1])
        if is_copy and statement.kind is not Kind.LAW and ground.derivative is None:
            raise RequirementError(f"{statement.number} rests on a copy of itself, {ground.number}")


def overrule(verdict: Verdict, objection: str) -> Verdict:
    """Return a verdict after the referee; with an objection the statement does not follow."""
    if not objection:
        return verdict
    words = f"does not follow: {objection}"
    return replace(verdict, outcome=Outcome.DOES_NOT_FOLLOW, words=words, as_expected=False)


def judge(statement: Statement, earlier: Mapping[str, Statement], verdicts: Mapping[str, Verdict]) -> Verdict:
    """Judge one statement by its logic alone, from the earlier ones and their verdicts, both by number."""

    def verdict(finding: Finding, **found: Any) -> Verdict:
        return Verdict(
            statement=statement,
            outcome=finding.outcome,
            words=finding.words,
            as_expected=finding.outcome is statement.expected and not finding.flawed,
            necessary=finding.necessary,
            **found,
        )

    if statement.kind.is_given:
        return verdict(Finding(Outcome.GIVEN, statement.kind.value))
    try:
        proofs = _proofs(statement, earlier)
    except NotDerivedError as reason:
        return verdict(Finding(Outcome.DOES_NOT_FOLLOW, f"does not follow: {reason}", flawed=True))
    unsound = [ground.number for ground in statement.grounds if not verdicts[ground.number].holds]
    if unsound:
        words = f"rests on {', '.join(unsound)}, which does not follow"
        return verdict(Finding(Outcome.DOES_NOT_FOLLOW, words, flawed=True), proofs=proofs)
    finding = _finding(statement, proofs)
    inherited = tuple(dict.fromkeys(n for ground in statement.grounds for n in _conditional(verdicts[ground.number])))
    others = f"on the condition of {', '.join(inherited)}"
    if inherited and finding.outcome is Outcome.FOLLOWS:
        finding = Finding(Outcome.FOLLOWS_IF, f"follows {others}")
    elif inherited and finding.outcome is Outcome.FOLLOWS_IF:
        finding = replace(finding, words=f"{finding.words}, and {others}")
    return verdict(finding, proofs=proofs, inherited=inherited)


def _conditional(verdict: Verdict) -> tuple[str, ...]:
    itself = (verdict.number,) if verdict.necessary is not None else ()
    return itself + verdict.inherited if verdict.outcome is Outcome.FOLLOWS_IF else ()


def _finding(statement: Statement, proofs: Sequence[CaseProof]) -> Finding:
    differences = [value for proof in proofs for value in proof.discrepancies if value != 0]
    if statement.condition is not None:
        return judge_condition(statement.condition, differences)
    if differences:
        return Finding(Outcome.DOES_NOT_FOLLOW, "does not follow")
    if statement.positive_if is None:
        return Finding(Outcome.FOLLOWS, "follows")
    positive_if = statement.positive_if
    claim = sympy.sstr(positive_if)
    if all(_sign_agrees(positive_if, proof) for proof in proofs):
        return Finding(Outcome.FOLLOWS, f"follows; positive exactly if {claim}")
    return Finding(Outcome.DOES_NOT_FOLLOW, f"does not follow: positive not exactly if {claim}", flawed=True)


def _sign_agrees(positive_if: Relational, proof: CaseProof) -> bool:
    """Whether the derived value is positive in just the cases in which the claim is true."""
    claim = positive_if.xreplace(dict(proof.case.at))
    if claim == sympy.true:
        return proof.derived.is_positive is True
    if claim == sympy.false:
        return proof.derived.is_nonpositive is True
    # The claim's own margin, times something positive, is the value: the two have one sign.
    if not isinstance(claim, sympy.StrictGreaterThan | sympy.StrictLessThan):
        return False
    return sympy.factor(sympy.cancel(sympy.factor(proof.derived) / (claim.gts - claim.lts))).is_positive is True


def _proofs(statement: Statement, earlier: Mapping[str, Statement]) -> tuple[CaseProof, ...]:
    """Derive every case."""
    proofs = []
    chosen: set[sympy.Basic] = set()
    for case in statement.cases or (Case((), ""),):
        at = dict(case.at)
        relations = tuple(relation_of(earlier[ground.number], ground, at) for ground in statement.grounds)
        nonzero = tuple((one.lhs - one.rhs).xreplace(at) for one in statement.provided)
        solution, steps = solve_relations(relations, (statement.symbol, *_eliminated(statement, relations)), nonzero)
        derived = solution[statement.symbol]
        branches = [_branch(member, at, solution, chosen) for member in statement.members]
        members = [branch.xreplace(at) for branch in branches]
        published = [member.xreplace(solution) for member in members]
        differences = tuple(sympy.S.Zero if agree(derived, member) else derived - member for member in published)
        proofs.append(
            CaseProof(
                case=case,
                derived=derived,
                discrepancies=differences,
                solution=solution,
                steps=steps,
                reached=derived if any(differences) else members[-1],
                published=branches[-1],
            )
        )
    pieces = [member.args for member in statement.members if isinstance(member, sympy.Piecewise)]
    idle = [sympy.sstr(condition) for args in pieces for _, condition in args if condition not in chosen]
    if idle:
        raise NotDerivedError(f"no case stands for {', '.join(idle)}")
    return tuple(proofs)


def _eliminated(statement: Statement, relations: Sequence[Relation]) -> tuple[Name, ...]:
    """Return what is solved for beside the symbol: what the grounds are about, as many as there are grounds."""
    if statement.eliminate is not None:
        return statement.eliminate
    named = dict.fromkeys((statement.symbol, *(relation.left for relation in relations)))
    return tuple(named)[1 : len(relations)]


def _branch(
    member: sympy.Expr, case: Mapping[Name, sympy.Expr], solution: Mapping[Name, sympy.Expr], chosen: set[sympy.Basic]
) -> sympy.Expr:
    """Return a member, of a piecewise one the branch that holds in a case, whose condition joins `chosen`."""
    if not isinstance(member, sympy.Piecewise):
        return member
    for value, condition in member.args:
        decided = condition.xreplace(case).xreplace(solution)
        if decided == sympy.true:
            chosen.add(condition)
            return value
        if decided != sympy.false:
            break
    raise NotDerivedError("a case does not decide between the branches of the statement itself")


def relation_of(
    statement: Statement, ground: Ground, case: Mapping[Name, sympy.Expr] = MappingProxyType({})
) -> Relation:
    """Return a statement as a ground takes it, in a case of the statement that rests on it."""
    name, value = statement.symbol, statement.members[ground.member]
    if ground.derivative is not None:
        by, name = ground.derivative
        value = sympy.diff(value, by)
    # xreplace replaces all symbols at once, so that u_i -> -u_i does not eat its own result.
    replacements = dict(ground.at)
    return Relation(
        ground=ground,
        left=name.xreplace(replacements).xreplace(case),
        right=value.xreplace(replacements).xreplace(case),
    )
