"""What the tests of the account share: its verdicts, found once."""

import pytest

from dzdesign.derivation.account.account import verify_statements


@pytest.fixture(scope="session")
def verdicts():
    """The verdict of every statement, by number."""
    return {verdict.number: verdict for verdict in verify_statements()}
