"""Structured Text cut into words, whole numbers and signs, each with its place; comments and spaces are left out."""

import re
from typing import NamedTuple

from dzdesign.core.errors import InputError, quoted
from dzdesign.verify.structured_text.syntax import Place

TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+|\(\*(?!\))(?:(?!\(\*).)*?\*\))|(?P<word>[A-Za-z_]\w*)|(?P<whole>\d+)(?![\w#])"
    r"|(?P<sign>:=|<>|<=|>=|\.\.|\((?!\*)|[-+*/=<>)\[\],:;])",
    re.DOTALL,
)


class Token(NamedTuple):
    """A word, whole number or sign; an empty text ends the input."""

    text: str
    kind: str
    place: Place


def tokens_of(text: str, source: str) -> list[Token]:
    """Return what a text is made of, and its end; a sign that the subset has not is an `InputError`."""
    found, position, line, begin = [], 0, 1, 0
    while position < len(text):
        place = Place(line, position - begin + 1)
        match = TOKEN.match(text, position)
        if match is None:
            stranger = quoted(text[position : position + 10])
            raise InputError(f"{source}, {place}: {stranger} is outside the verified subset")
        if match.lastgroup != "space":
            found.append(Token(match[0], str(match.lastgroup), place))
        breaks = match[0].count("\n")
        line += breaks
        begin = match.start() + match[0].rindex("\n") + 1 if breaks else begin
        position = match.end()
    return [*found, Token("", "end", Place(line, position - begin + 1))]
