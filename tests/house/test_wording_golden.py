"""The file of all messages: what compares with it sees a change, and no message is kept that no test asks for."""

import re

import pytest

from tests.support.paths import TESTS
from tests.support.wording import Wording, name_of_tests, read_messages, write_messages


def test_a_changed_text_is_seen_and_an_update_keeps_it(tmp_path):
    path = tmp_path / "messages.txt"
    write_messages({"b": "two\nlines", "a": "one"}, path)
    assert read_messages(path) == {"a": "one", "b": "two\nlines"} and list(read_messages(path)) == ["a", "b"]
    compare, update = (Wording(update, tmp_path, path) for update in (False, True))
    compare("a", "one\n")
    for name, text in (("a", "another"), ("c", "one")):
        with pytest.raises(AssertionError):
            compare(name, text)
        update(name, f"{text} in {tmp_path}")
        compare(name, f"{text} in FOLDER")


def test_every_message_is_of_a_test(request):
    """A name is ``group: case``: that of a file of tests and one of them, or a test has it, its group at least."""
    sources = {path: path.read_text(encoding="utf-8") for path in TESTS.rglob("test_*.py")}
    tests = {
        f"{name_of_tests(path.stem)}: {name_of_tests(name)}"
        for path, text in sources.items()
        for name in re.findall(r"^ *def (test_\w+)", text, re.MULTILINE)
    }
    asked = "".join(sources.values())
    groups = set(re.findall(r"f[\"']([^:\"'{]+): [^\"']*{", asked))
    messages = read_messages()
    of_no_test = {
        name
        for name in messages
        if re.sub(r"( \[.*\])?( \(\d+\))?$", "", name, flags=re.DOTALL) not in tests
        and f'"{name}"' not in asked
        and name.partition(": ")[0] not in groups
    }
    if request.config.getoption("--update-goldens"):
        write_messages({name: text for name, text in messages.items() if name not in of_no_test})
    else:
        assert messages and of_no_test == set()
