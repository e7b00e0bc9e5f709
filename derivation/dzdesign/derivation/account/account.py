"""The whole account of the paper, in its order: every equation, and the theorems, each after what it rests on."""

from collections.abc import Sequence
from dataclasses import replace

from dzdesign.derivation.account.equations import APPROACH, AT_REFERENCE, OFF_REFERENCE
from dzdesign.derivation.account.law_theorems import FULL_COMMAND, SHAPE, TARGET, TIES, TRANSITION, ZERO_COMMAND
from dzdesign.derivation.account.measured_flow import FLOW_OVER_PRESSURE, IDENTIFIABILITY, METER_FLOOR
from dzdesign.derivation.account.model_and_codes import CODES, IMPLEMENTATION, SIMULATION_MODEL, TRANSFER_FUNCTION
from dzdesign.derivation.account.proof import Verdict, prove
from dzdesign.derivation.account.referee import hear
from dzdesign.derivation.account.statement import Statement

SECTIONS = {
    "1 Proposed compensation approach": APPROACH,
    "1.1 At the reference point": AT_REFERENCE,
    "1.2 At a non-reference point": OFF_REFERENCE,
    "2.1 Simulation model": SIMULATION_MODEL,
    "3 Implementation of the compensator": IMPLEMENTATION,
    "The law of this tool": TIES,
    "Theorem 1: which flow the laws give": TARGET,
    "Theorem 2: full command": FULL_COMMAND,
    "Theorem 3: zero command": ZERO_COMMAND,
    "Theorem 4: the law's shape": SHAPE,
    "Theorem 5: codes and duty cycle": CODES,
    "Theorem 6: transfer function": TRANSFER_FUNCTION,
    "Theorem 7: flow over pressure drop": FLOW_OVER_PRESSURE,
    "Theorem 8: what flow can tell": IDENTIFIABILITY,
    "Theorem 9: the meter's floor": METER_FLOOR,
    "Theorem 10: zero band and transition": TRANSITION,
}

STATEMENTS = tuple(
    replace(statement, section=section) for section, statements in SECTIONS.items() for statement in statements
)


def verify_statements(statements: Sequence[Statement] = STATEMENTS) -> tuple[Verdict, ...]:
    """Derive each statement from the premises that it names; each stands after those it rests on.

    Examples
    --------
    >>> all(verdict.as_expected for verdict in verify_statements())
    True
    """
    return prove(statements, hear)
