"""What the tests of `design` share."""

from functools import cache

import pytest

from dzdesign.design import options


@pytest.fixture(scope="session", autouse=True)
def each_current_drive_once():
    """Choose the loop of a coil once: many designs are of the same coil, and choosing takes most of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(options, "design_current_drive", cache(options.design_current_drive))
        yield
