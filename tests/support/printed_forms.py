"""Integer operations as they are printed, run by Python number by number: a reader of both texts for tests alone."""

import re

import numpy as np

from dzdesign.codegen.integers.text import matlab_body, st_body

#: Operators and calls as Python writes them.
ST = ((r"\(\*.*?\*\)", ""), (r"\bAND\b", "and"), (r"\bOR\b", "or"), (r"\bNOT\b", "not"), (r"\bMOD\b", "%"), (":=", "="))
MATLAB = ((r"%.*", ""), (r"\.\.\.\n", " "), (r"\.\*", "*"), (r"\|", " or "), ("&", " and "), ("~", " not "),
          (r"(?m)^(\w+)\(([\w ]+)\) = (.*)$", r"if \2: \1 = \3"))  # fmt: skip


class Word(int):
    """An integer whose quotients are rounded towards zero."""

    def __truediv__(self, other):
        return Word(abs(self) // int(other) * (1 if self >= 0 else -1))

    def __mod__(self, other):
        return self - self / other * other


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "neg"):
    _made = getattr(int, f"__{_name}__")
    setattr(Word, f"__{_name}__", lambda self, *others, made=_made: Word(made(int(self), *map(int, others))))


class Rows(tuple):
    """A table, whose first element is 0 in Structured Text and 1 for MATLAB."""

    def __call__(self, place):
        return Word(self[place - 1])


CALLS = {
    "MIN": lambda *given: Word(min(given)), "MAX": lambda *given: Word(max(given)), "BOOL_TO_DINT": Word,
    "SEL": lambda condition, no, yes: yes if condition else no, "int64": Word,
    "bitshift": lambda value, shift: Word(int(value) >> -shift),
}  # fmt: skip
CALLS |= {"min": CALLS["MIN"], "max": CALLS["MAX"]}


def printed_values(form, given):
    """Return the values of every name, by arrays of inputs that broadcast: of 32 bits by the text for a PLC."""
    text, rules = ("\n".join(st_body(form)), ST) if form.bits == 32 else ("\n".join(matlab_body(form)), MATLAB)
    for old, new in rules:
        text = re.sub(old, new, text)
    statements = [" ".join(each.split()) for each in text.split(";")]
    code = compile("\n".join(filter(None, statements)), "the text", "exec")
    constants = {each.name: Rows(map(Word, each.values)) if len(each.values) > 1 else Word(each.values[0])
                 for each in form.constants}  # fmt: skip
    arrays = np.broadcast_arrays(*given.values())
    found = []
    for numbers in zip(*(each.ravel().tolist() for each in arrays), strict=True):
        values = {name: one if isinstance(one, bool) else Word(one) for name, one in zip(given, numbers, strict=True)}
        exec(code, {**CALLS, **constants}, values)
        found.append(values)
    return {name: np.array([each[name] for each in found]).reshape(arrays[0].shape) for name in found[0]}
