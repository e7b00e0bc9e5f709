"""The words of a verdict, the same in the terminal, in the report and in every description of an artefact."""

HOLDS, DOES_NOT_HOLD, NOT_CHECKED = "HOLDS", "DOES NOT HOLD", "NOT CHECKED"
#: Of a check that is made on request: without one nothing is open.
NOT_ASKED_FOR = "NOT RUN (optional)"
#: Of a finding that stands beside a requirement, and on which its verdict does not depend.
NOT_REQUIRED = "NOT REQUIRED"


def verdict_words(holds: bool | None) -> str:
    """Return the words for a verdict; None: it was to be checked, and could not be.

    Examples
    --------
    >>> verdict_words(True), verdict_words(False), verdict_words(None)
    ('HOLDS', 'DOES NOT HOLD', 'NOT CHECKED')
    """
    return NOT_CHECKED if holds is None else HOLDS if holds else DOES_NOT_HOLD
