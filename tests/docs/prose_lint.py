"""Run proselint over the prose of the pages and return its exit status: ``python -m tests.docs.prose_lint [PAGE ...]``.

It takes no Markdown: a table or a listing would be full of repeated words to it. So it reads a file of the paragraphs
alone for each page, in which each piece of code and each number is a word of its own.
"""

import itertools
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.docs.sentences import blocks_of, sentences_of
from tests.support.paths import ROOT

NUMBER = re.compile(r"\bCode\b|[-±]?\d[\w.,:/-]*\b")


def prose_of(markdown: str) -> str:
    """Return the paragraphs of a page as proselint takes them: no quotes, and no two pieces of code or numbers alike.

    Each ends with a full stop: a word at the end of a list's item is not repeated by the next one.

    Examples
    --------
    >>> print(prose_of("Use `a` or `b` of \\"five\\".\\n\\n- 20 or 20 V\\n- V a."))
    Use Code0 or Code1 of five.
    <BLANKLINE>
    N2 or N3 V.
    <BLANKLINE>
    V a.
    """
    blocks = (" ".join(sentences_of(block)) for block in blocks_of(markdown))
    paragraphs = "\n\n".join(block if block.endswith((".", "!", "?")) else f"{block}." for block in blocks)
    count = itertools.count()
    words = NUMBER.sub(lambda found: f"{'Code' if found[0] == 'Code' else 'N'}{next(count)}", paragraphs)
    return re.sub(r'["“”…]|\.\.\.', "", words)


def lint(pages: Iterable[Path]) -> tuple[int, str]:
    """Return proselint's exit status and what it says, with the pages' names in place of those of the files it read."""
    with TemporaryDirectory() as folder:
        files = {}
        for page in pages:
            name = "-".join(page.relative_to(ROOT).parts if page.is_relative_to(ROOT) else page.parts[-1:])
            files[Path(folder, name).with_suffix(".txt")] = page
        for file, page in files.items():
            file.write_text(prose_of(page.read_text("utf-8")), encoding="utf-8")
        command = [sys.executable, "-m", "proselint", "check", *map(str, files)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    text = done.stdout + done.stderr
    for file, page in files.items():
        text = text.replace(str(file), str(page))
    return done.returncode, text


def pages() -> list[Path]:
    """Return all pages of the repository, without what is built of them."""
    found = (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
    return sorted(page for page in found if not {"_build", "_made"} & {*page.parts})


if __name__ == "__main__":
    status, text = lint([Path(word).resolve() for word in sys.argv[1:]] or pages())
    print(text, end="")
    sys.exit(status)
