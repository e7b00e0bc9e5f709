"""Whole texts of messages, kept in one file: a better sentence changes that file and no test.

A test gives a text and says which it is; ``pytest --update-goldens`` writes the file anew. Read the diff.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.paths import GOLDENS

MESSAGES = GOLDENS / "messages.txt"
HASH = re.compile(r"\b(?=\d*[a-f])[0-9a-f]{39,64}\b")
ABOUT = "Messages as users see them, each under the name by which its test asks for it."


def read_messages(path: Path = MESSAGES) -> dict[str, str]:
    """Return name -> text."""
    _, *blocks = re.split(r"^== (.*)\n", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {name: text.rstrip("\n") for name, text in zip(blocks[::2], blocks[1::2], strict=True)}


def write_messages(messages: dict[str, str], path: Path = MESSAGES) -> None:
    """Write the file, in the order of the names."""
    blocks = (f"== {name}\n{text}\n" for name, text in sorted(messages.items()))
    path.write_text("\n".join([f"{ABOUT}\n", *blocks]), encoding="utf-8", newline="")


def name_of_tests(name: str) -> str:
    """Return the name of a test or of their file as words."""
    return name.removeprefix("test_").replace("_", " ")


class Wording:
    """Compares texts with those that are kept.

    Parameters
    ----------
    update : bool
        Keep what comes, in place of comparing.
    folder : Path
        Of the test: its path stands in no text.
    test : str
        Under which a text is kept to which the test gives no name.
    """

    def __init__(self, update: bool, folder: Path, path: Path = MESSAGES, test: str = "") -> None:
        self._update, self._folder, self._path, self._test, self._count = update, folder, path, test, 0

    @contextmanager
    def refusal(self, error: type[Exception], name: str = "") -> Iterator[pytest.ExceptionInfo[Exception]]:
        """Fail unless what follows raises `error` with the text that is kept under `name`, or else for this test."""
        with pytest.raises(error) as caught:
            yield caught
        if name:
            self(name, str(caught.value))
        else:
            self.of_test(str(caught.value))

    def of_test(self, text: str) -> None:
        """Fail unless `text` is what is kept for this test; several are counted."""
        self._count += 1
        self(self._test + (f" ({self._count})" if self._count > 1 else ""), text)

    def __call__(self, name: str, text: str) -> None:
        """Fail unless `text` is what is kept under `name`; a hash, which hangs on last digits, is not kept."""
        text = text.replace(str(self._folder), "FOLDER").replace(str(self._folder.parent), "FOLDERS").rstrip("\n")
        # A NUL, in a name that can't be one, would make the file binary for git.
        text = HASH.sub("HASH", text).replace("\0", "\\0")
        messages = read_messages(self._path)
        if self._update:
            write_messages(messages | {name: text}, self._path)
        else:
            assert messages.get(name) == text, f"the text of '{name}'; if that is meant: pytest --update-goldens"
