"""Whole texts of messages, kept in one file: a better sentence changes that file and no test.

A test gives a text and says which it is; ``pytest --update-goldens`` writes the file anew. Read the diff.
"""

import re
from pathlib import Path

from tests.support.paths import GOLDENS

MESSAGES = GOLDENS / "messages.txt"
ABOUT = "Messages as users see them, each under the name by which its test asks for it."


def read_messages(path: Path = MESSAGES) -> dict[str, str]:
    """Return name -> text."""
    _, *blocks = re.split(r"^== (.*)\n", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {name: text.rstrip("\n") for name, text in zip(blocks[::2], blocks[1::2], strict=True)}


def write_messages(messages: dict[str, str], path: Path = MESSAGES) -> None:
    """Write the file, in the order of the names."""
    blocks = (f"== {name}\n{text}\n" for name, text in sorted(messages.items()))
    path.write_text("\n".join([f"{ABOUT}\n", *blocks]), encoding="utf-8", newline="")


class Wording:
    """Compares texts with those that are kept.

    Parameters
    ----------
    update : bool
        Keep what comes, in place of comparing.
    folder : Path
        Of the test: its path stands in no text.
    """

    def __init__(self, update: bool, folder: Path, path: Path = MESSAGES) -> None:
        self._update, self._folder, self._path = update, folder, path

    def __call__(self, name: str, text: str) -> None:
        """Fail unless `text` is what is kept under `name`."""
        # A NUL, in a name that can't be one, would make the file binary for git.
        text = text.replace(str(self._folder), "FOLDER").replace("\0", "\\0").rstrip("\n")
        messages = read_messages(self._path)
        if self._update:
            write_messages(messages | {name: text}, self._path)
        else:
            assert messages.get(name) == text, f"the text of '{name}'; if that is meant: pytest --update-goldens"
