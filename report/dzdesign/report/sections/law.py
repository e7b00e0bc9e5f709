"""The law's derivation, as the report shows it: proved again when the report is made."""

from dataclasses import dataclass
from functools import cache

from dzdesign.derivation.account.equations import APPROACH, AT_REFERENCE, OFF_REFERENCE
from dzdesign.derivation.account.proof import prove
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.account.target_flow import TARGET, TIES
from dzdesign.derivation.law import law
from dzdesign.derivation.presentation.content import DerivationReport, Entry
from dzdesign.derivation.presentation.prose import Words
from dzdesign.derivation.presentation.report import closure, compose
from dzdesign.derivation.presentation.writers import HtmlWriter

#: All that the laws rest on: sections of the account. Of the others some take a second to import.
STATEMENTS = (*APPROACH, *AT_REFERENCE, *OFF_REFERENCE, *TIES, *TARGET)


@dataclass(frozen=True, slots=True, kw_only=True)
class LawAccount:
    """Where a law comes from: what it and all that it rests on are derived to be.

    `note` says what the law does and does not achieve; `main` has the numbers of the law and of what it rests on
    directly, whose steps are shown; `page` writes words and formulas.
    """

    note: Words
    derived: DerivationReport
    main: frozenset[str]
    page: HtmlWriter

    def outcome(self, entry: Entry) -> str:
        """Return the kind of a verdict's cell."""
        if not entry.as_expected or entry.outcome is Outcome.DOES_NOT_FOLLOW:
            return "bad"
        return {Outcome.FOLLOWS: "good", Outcome.FOLLOWS_IF: "open"}.get(entry.outcome, "text")


@cache
def account_of(law_name: str) -> LawAccount:
    """Derive a law from the paper's premises."""
    number = law(law_name).stated_as
    numbers = closure(STATEMENTS, [number])
    statements = [statement for statement in STATEMENTS if statement.number in numbers]
    return LawAccount(
        note=Words(law(law_name).note),
        derived=compose(prove(statements), numbers),
        main=frozenset(ground.number for ground in statements[-1].grounds) | {number},
        page=HtmlWriter(numbers),
    )
