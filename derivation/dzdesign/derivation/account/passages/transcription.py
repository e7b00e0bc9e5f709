"""Whether the numbers that were transcribed are the paper's: each beside a digest of the passage that it stands in.

The paper's words are not stored. Of a passage, six words before the number and six after, two digests are: the place's,
made of the words with a gap for the number, and the number's, made of the place's and the number as printed. Without
the paper a number that was mistyped, or changed since, differs from its digest. Who changes number and digest alike is
found with the paper only: then the place is looked up in its text, and the number must stand in it.
"""

import hashlib
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import sympy

from dzdesign.derivation.account.passages.digests import PASSAGES
from dzdesign.derivation.account.published import transcribed
from dzdesign.derivation.account.statement import Statement

_WORDS = 6  # before the number, and as many after it
_TOKEN = re.compile(r"\d+(?:\.\d+)?|[^\W\d_]+")


class Passage(NamedTuple):
    """A place in the paper where a number stands, and the digests of both."""

    place: str
    digest: str


def passages_of(text: str, number: str) -> Iterator[Passage]:
    """Yield the passages of a text in which a number stands, as printed; signs, spaces and case do not matter."""
    tokens = _TOKEN.findall(unicodedata.normalize("NFKC", text).lower())
    for position, token in enumerate(tokens):
        if token == number:
            around = [*tokens[max(0, position - _WORDS) : position], "", *tokens[position + 1 : position + 1 + _WORDS]]
            place = _digest(" ".join(around))
            yield Passage(place, digest_of(place, number))


def digest_of(place: str, number: str) -> str:
    """Return the digest of a number in a place."""
    return _digest(f"{place} {number}")


def find_transcription_faults(
    numbers: Mapping[str, str] | None = None, passages: Mapping[str, Sequence[str]] = PASSAGES, paper: str | None = None
) -> list[str]:
    """Say which numbers are not those of their passages; with the text of the paper, which do not stand there.

    `numbers` are those of `published.py` unless given, as printed, by name; `passages` has place and digest by name.
    """
    numbers = transcribed() if numbers is None else numbers
    faults = [f"{name}: the passage has a digest, but no number is transcribed" for name in passages.keys() - numbers]
    for name, number in numbers.items():
        if name not in passages:
            faults.append(f"{name}: {number} is transcribed, but its passage has no digest")
            continue
        passage = Passage(*passages[name])
        if digest_of(passage.place, number) != passage.digest:
            faults.append(f"{name}: {number} is not the number that stands in its passage of the paper")
        elif paper is not None and passage not in passages_of(paper, number):
            faults.append(f"{name}: the text given has no {number} in the passage recorded")
    return sorted(faults)


def find_value_faults(statements: Sequence[Statement]) -> list[str]:
    """Say which printed numbers beside statements are not the paper's, or differ from ours without a remark."""
    printed, faults = {*transcribed().values()}, []
    for statement, value in ((one, each) for one in statements for each in one.values if each.published):
        where = f"{statement.number}, {value.label}: {value.published}"
        if value.published not in printed:
            faults.append(f"{where} is called printed, and the paper has no such number")
        elif not value.agrees(statement) and not value.remark:
            ours = sympy.N(value.exact(statement), 4)
            faults.append(f"{where} is printed, the statement gives {ours}, and no remark says why")
    return faults


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
