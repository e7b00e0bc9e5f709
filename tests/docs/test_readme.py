"""The front page: short, with a picture that is there, and figures that other tests hold."""

import re

from tests.docs.prose import words_of
from tests.support.paths import ROOT, TESTS

README = (ROOT / "README.md").read_text("utf-8")
MOST_WORDS = 900


def test_the_readme_is_short():
    assert 500 < len(words_of(README)) <= MOST_WORDS


def test_the_first_commands_are_those_that_ci_runs():
    commands = re.findall(r"^    (make .+)$", README, re.MULTILINE)
    assert commands == ["make demo", "make test"]
    assert "\nmake test " in (ROOT / ".ci/run").read_text("utf-8")
    assert README.index("make demo") < README.index("pip install")


def test_the_instructions_are_those_of_the_generated_readme():
    """tests/codegen/test_core_costs.py measures them."""
    generated = (TESTS / "goldens/cortex-m4/cortex_m4/README.md").read_text("utf-8")
    (default,) = re.findall(r"^\| `dz_comp\(\)`, most instructions of a call \| (\d+) \|", generated, re.MULTILINE)
    assert f"With the default options a call takes {default} instructions on a Cortex-M4" in README
