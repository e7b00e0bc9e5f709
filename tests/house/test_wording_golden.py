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


def test_every_message_is_of_a_test():
    """A name is ``group: case``; the group stands in the tests as it is written, or is the name of their file."""
    groups = {name.partition(": ")[0] for name in read_messages()}
    sources = [(path.stem, path.read_text(encoding="utf-8")) for path in TESTS.rglob("test_*.py")]
    asked = set(re.findall(r"wording\(\s*f?[\"']([^:\"'{]+): ", "".join(text for _, text in sources)))
    asked |= {name_of_tests(stem) for stem, text in sources if re.search(r"wording\.(refusal|of_test)\(", text)}
    assert groups and groups == asked
