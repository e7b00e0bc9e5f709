"""The subset of the language that is verified: what MATLAB and Octave read alike, and which can do nothing else.

No loop, no file, no evaluation of text, no function beside those of `CALLED` and the text's own: so it may be run. Not
in it, as one of the two tools reads it otherwise or not at all: `+=`, `!`, `#`, `endif`, texts in double quotes, block
comments, and the quote that transposes.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from dzdesign.core.errors import InputError

TOKENS = re.compile(
    r"(?P<blank>[ \t]+)|(?P<comment>%[^\n]*)|(?P<next>\.\.\.[^\n]*\n)|(?P<line>\n)|(?P<text>'(?:[^'\n]|'')*')"
    r"|(?P<number>\d+\b(?!\.\d))|(?P<refused>\+\+|--|[-+*^|&]=)|(?P<name>[A-Za-z]\w*)"
    r"|(?P<sign>==|~=|<=|>=|&&|\|\||\.\*|[-+*^<>&|~=(){}\[\],;:])"
)
KEYWORDS = frozenset({"function", "if", "end"})
#: Functions that both tools have, none of which changes anything but its result.
CALLED = frozenset({
    "bitshift", "class", "double", "error", "find", "fix", "int32", "int64", "isempty", "isequal", "isnumeric",
    "isreal", "issparse", "mat2str", "max", "min", "nargin", "nargout", "numel", "prod", "repmat", "reshape", "size",
    "uint16",
})  # fmt: skip
#: Characters of a text; digits of a number, as of one of 64 bits.
LONGEST, MOST_DIGITS = 200_000, 20
#: Heading of a function file: outputs, name, inputs.
OUTPUTS, INPUTS = ("compare", "status", "beta"), ("u_adc", "p_a_adc", "p_b_adc")


@dataclass(frozen=True, slots=True)
class Token:
    """A word of the text."""

    kind: str
    text: str
    line: int


@dataclass(frozen=True, slots=True)
class ReadFunction:
    """One function of a file."""

    name: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    #: Words behind the heading, without blanks and comments.
    body: tuple[Token, ...]


def read_functions(text: str, source: str) -> list[ReadFunction]:
    """Return the functions of a file; a text that is not of the subset is an `InputError` with its line."""
    words = list(_tokens(text, source))
    starts = [place for place, word in enumerate(words) if word.text == "function" and word.kind == "name"]
    if not starts or any(word.kind != "line" for word in words[: starts[0]]):
        raise InputError(f"{source} does not begin with a function")
    pieces = [words[begin:end] for begin, end in zip(starts, [*starts[1:], len(words)], strict=True)]
    functions = [_function(piece, source) for piece in pieces]
    own = {each.name for each in functions}
    for each in functions:
        _check_names(each, own, source)
    first = functions[0]
    if (first.outputs, first.inputs) != (OUTPUTS, INPUTS) or f"{first.name}.m" != source:
        heading = f"[{', '.join(OUTPUTS)}] = {source.removesuffix('.m')}({', '.join(INPUTS)})"
        raise InputError(f"{source} does not begin with the function {heading}")
    return functions


def _tokens(text: str, source: str) -> Iterator[Token]:
    """Yield the words of a text, without blanks, comments and what continues a line."""
    line, place = 1, 0
    if not text.isascii():
        raise InputError(f"{source} is not ASCII text")
    if len(text) > LONGEST:
        raise InputError(f"{source} has {len(text)} characters, expected at most {LONGEST}")
    while place < len(text):
        found = TOKENS.match(text, place)
        if found is None or found.lastgroup == "refused":
            near = text[place : place + 12]
            raise InputError(f"{source}, line {line}: {near!r} is outside the verified subset")
        kind, word = str(found.lastgroup), found[0]
        if kind == "number" and len(word) > MOST_DIGITS:
            raise InputError(f"{source}, line {line}: a number has {len(word)} digits, expected at most {MOST_DIGITS}")
        if kind == "comment" and word[1:2] in ("{", "}"):
            raise InputError(f"{source}, line {line}: a block comment is outside the verified subset")
        if kind not in ("blank", "comment", "next"):
            yield Token(kind, word, line)
        line += word.count("\n")
        place = found.end()


def _function(words: list[Token], source: str) -> ReadFunction:
    """Return a function: its heading, such as ``[a, b] = f(c)`` or ``a = f(c)``, and its body up to its ``end``."""
    stop = next(place for place, word in enumerate(words) if word.kind == "line" or place == len(words) - 1)
    heading = "".join(word.text for word in words[1:stop])
    found = re.fullmatch(r"(\w+|\[\w+(?:,\w+)*\])=(\w+)\((\w+(?:,\w+)*)\)", heading)
    body = words[stop:]
    opened = sum({"if": 1, "end": -1}.get(word.text, 0) for word in body if word.kind == "name")
    if found is None or opened != -1:
        raise InputError(f"{source}, line {words[0].line}: a function's heading or its end is not of the subset")
    outputs, name, inputs = found.groups()
    return ReadFunction(
        name=name, outputs=tuple(outputs.strip("[]").split(",")), inputs=tuple(inputs.split(",")), body=tuple(body)
    )


def _check_names(function: ReadFunction, own: set[str], source: str) -> None:
    """Refuse a name that is neither a variable nor a function of the subset, and a variable with a function's name."""
    assigned = {*function.inputs, *_assigned(function)}
    if shadowed := sorted(assigned & (CALLED | own | KEYWORDS)):
        raise InputError(f"{source}: {shadowed[0]} is a function, and a variable has its name")
    known = KEYWORDS | CALLED | own | assigned
    for word in function.body:
        if word.kind == "name" and word.text not in known:
            raise InputError(f"{source}, line {word.line}: {word.text} is outside the verified subset")


def _assigned(function: ReadFunction) -> Iterator[str]:
    """Yield the variables that are assigned, each at the start of a statement: ``name = ...``, ``name(...) = ...``."""
    body = function.body
    for place, word in enumerate(body):
        starts = place == 0 or body[place - 1].kind == "line" or body[place - 1].text == ";"
        if word.kind != "name" or not starts:
            continue
        behind = place + 1
        depth = 0
        while behind < len(body) and body[behind].kind != "line" and (depth or body[behind].text == "("):
            depth += {"(": 1, ")": -1}.get(body[behind].text, 0)
            behind += 1
        if behind < len(body) and body[behind].text == "=":
            yield word.text
