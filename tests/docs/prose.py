"""The sentences of a text in Markdown, and what makes prose hard to read: sentences that are too long, a word twice."""

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

from tests.support.paths import ROOT

#: Words of a sentence, on average over a text and at most.
MEAN, MOST = 18, 30
#: A full stop behind one of these ends no sentence.
ABBREVIATIONS = re.compile(r"\b(e\.g|i\.e|vs|Eqs?|Figs?|Nos?|approx|al)\.(?=[\s,)])")
#: A sentence ends before a capital, a digit or code, and before a choice of an option: ``hold: ...``.
END = re.compile(r"(?<=[.!?])[)\"'\]]*\s+(?=[(\"'\[]*[^\W_a-z]|[a-z][\w-]*: )")
#: What a message quotes: a file, a value. An apostrophe within a word begins none.
QUOTATION = re.compile(r"(?<!\w)'[^']*'|\"[^\"]*\"")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+\.|:)\s+")
TWICE = re.compile(r"\b([a-z]{2,}) \1\b")


def pages() -> list[Path]:
    """Return all pages of the repository, without what is built of them."""
    found = (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
    return sorted(page for page in found if not {"_build", "_made"} & {*page.parts})


def blocks_of(markdown: str) -> Iterator[str]:
    """Yield the paragraphs and list items of a page: prose alone, without headings, tables, terms, code and comments.

    Examples
    --------
    >>> list(blocks_of("# T\\n\\nOne\\nline.\\n\\n- a\\n  b\\n- c\\n\\n    code\\n\\n| x |\\n\\nterm\\n: Is it.\\n"))
    ['One line.', 'a b', 'c', 'Is it.']
    """
    text = re.sub(r"<!--.*?-->", "", markdown, flags=re.DOTALL)
    text = re.sub(r"^( *)(```+|~~~+|:::+).*?^\1\2 *$", "", text, flags=re.DOTALL | re.MULTILINE)
    block: list[str] = []
    is_code = False
    for line, after in pairwise([*text.splitlines(), "", ""]):
        is_code = not line.strip() or (line.startswith("    ") and (is_code or not block))
        is_skipped = is_code or re.match(r"\s*[#|>]|\(\S+\)=|<", line) or re.match(r": ", after)
        if block and (is_skipped or ITEM.match(line)):
            yield " ".join(block)
            block = []
        if not is_skipped:
            block.append(ITEM.sub("", line, count=1).strip())
    if block:
        yield " ".join(block)


def sentences_of(block: str) -> list[str]:
    """Return the sentences of a paragraph; a piece of code counts as one word, a link or picture as its text.

    Examples
    --------
    >>> sentences_of("Run `a b. C`, see Eq. (5) of [it](x.md). Then 2 ways. hold: stay. lower: e.g. by 2.5 %.")
    ['Run Code, see Eq (5) of it.', 'Then 2 ways.', 'hold: stay.', 'lower: eg by 2.5 %.']
    """
    text = re.sub(r"(`+).+?\1", "Code", block)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text).replace("*", "")
    text = ABBREVIATIONS.sub(lambda found: found[1].replace(".", ""), text)
    return [sentence for sentence in END.split(text) if words_of(sentence)]


def clauses_of(message: str) -> list[str]:
    """Return the parts of a message that are read at once: sentences, cut at a semicolon too; a quotation is a word.

    Examples
    --------
    >>> clauses_of("dzdesign: 'a b.csv' row 2 is empty, expected \\"1 V\\"; give one. See `a; b`.")
    ['Code row 2 is empty, expected Code', 'give one.', 'See Code.']
    """
    lines = (QUOTATION.sub("`quoted`", line.removeprefix("dzdesign: ")) for line in message.splitlines())
    return [clause for line in lines for sentence in sentences_of(line) for clause in sentence.split("; ")]


def words_of(text: str) -> list[str]:
    """Return the words of a text: what stands between blanks and has a letter or a digit."""
    return [word for word in text.split() if re.search(r"\w", word)]


def faults_of(blocks: Iterable[str], *, mean: int = MEAN, most: int = MOST) -> list[str]:
    """Return what makes a text hard to read: a sentence of more than `most` words, a word twice, too high a mean."""
    sentences = [sentence for block in blocks for sentence in sentences_of(block)]
    counts = [len(words_of(sentence)) for sentence in sentences]
    faults = [f"{count} words: {each}" for each, count in zip(sentences, counts, strict=True) if count > most]
    faults += [f"'{found[0]}': {each}" for each in sentences for found in TWICE.finditer(each)]
    if sum(counts) > mean * len(counts):
        faults.append(f"{sum(counts) / len(counts):.1f} words in a sentence on average")
    return faults
