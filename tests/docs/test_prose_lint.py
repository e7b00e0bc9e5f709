"""The linters of prose see what they must: a fault that is put into a page, by the page's name."""

import doctest
import subprocess
import sys

import pytest

from tests.docs import prose_lint
from tests.docs.prose_lint import lint, pages
from tests.support.paths import ROOT

pytest.importorskip("proselint", reason="the linters of prose come with the extra `test`")

GOOD = "# Page\n\nThe valve opens at `5 V` or `5 V`, 20 or 20 times, and a listing is no prose:\n\n    the the\n"


def test_the_example_of_the_prose_holds():
    assert doctest.testmod(prose_lint) == (0, 1)


def test_a_fault_of_a_page_is_found_and_named(tmp_path):
    good, wrong = tmp_path / "good.md", tmp_path / "wrong.md"
    good.write_text(GOOD)
    assert lint([good]) == (0, "")
    for fault in ("It is very good.", "It opens the the valve.", "It is a most unique valve."):
        wrong.write_text(f"{GOOD}\n{fault}\n")
        status, text = lint([good, wrong])
        assert status == 1 and f"{wrong}:" in text and str(good) not in text, fault


def test_the_pages_are_those_of_the_repository():
    found = {str(page.relative_to(ROOT)) for page in pages()}
    assert {"README.md", "CHANGELOG.md", "docs/tutorial.md", "docs/concepts/glossary.md"} <= found
    assert len(found) > 40 and not any("_build" in page or "_made" in page for page in found)


def test_a_word_that_is_spelled_wrong_is_found(tmp_path):
    command = [sys.executable, "-m", "codespell_lib", "--toml", str(ROOT / "pyproject.toml")]
    page = tmp_path / "page.md"
    for text, status in ((GOOD, 0), (GOOD.replace("valve", "vavle"), 65)):
        page.write_text(text)
        assert subprocess.run([*command, str(page)], capture_output=True, check=False).returncode == status
