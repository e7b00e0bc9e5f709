"""Wrong versions of a function's text, one change each, and what catches them."""

import re
from pathlib import Path

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.matlab.asked_codes import OUTPUTS, answers_of
from dzdesign.verify.matlab.checks import SETUP, input_cases
from dzdesign.verify.matlab.subset import read_functions
from tests.support.block_mutants import Mutant, blank

HIDDEN = re.compile(r"%[^\n]*|\.\.\.[^\n]*|'(?:[^'\n]|'')*'")
TOKEN = re.compile(r"~=|==|<=|>=|&&|\|\||\.\*|(?<![\w.])\d+\b|[-+*<>&|~]|\b(?:max|min)\b")
OTHERS = {
    "+": "-", "-": "+", ".*": "+", "*": "+", "<": "<=", ">": ">=", "<=": "<", ">=": ">", "==": "~=", "~=": "==",
    "&": "|", "|": "&", "&&": "||", "||": "&&", "max": "min", "min": "max", "~": "",
}  # fmt: skip


def mutants(text):
    """Return every mutant of a text, in its order: an operator exchanged or left out, a number larger."""
    hidden = HIDDEN.sub(lambda found: blank(found[0]), text)
    found = []
    for match in TOKEN.finditer(hidden):
        old = match[0]
        new = number_of(old, text, match.start()) if old.isdigit() else OTHERS[old]
        changed = text[: match.start()] + new + text[match.end() :]
        found.append(Mutant(text.count("\n", 0, match.start()) + 1, f"{old} to {new or 'nothing'}", changed))
    return found


def number_of(old, text, place):
    """Return a number one more; of a table, where one is far below a count, a thousandth more."""
    line = text[text.rfind("\n", 0, place) : text.index("\n", place)]
    return str(int(old) + (int(old) // 1000 if re.match(r"\s*\d+;", line) else 1))


def killers(chosen, octave, text, script, name, sample, everything=None):
    """Return what catches each mutant, in their order: a text; empty where nothing does.

    All run on a sample in one process, what is left tries the cases of inputs, each by itself, and with `everything`
    what is left then runs on every input.
    """
    found = {place: _refused(mutant, name) for place, mutant in enumerate(chosen)}
    _judge(found, chosen, octave, text, sample, "a sample")
    for place, mutant in enumerate(chosen):
        if not found[place]:
            found[place] = _by_cases(octave, name, mutant.text, script)
    if everything is not None:
        _judge(found, chosen, octave, text, everything, "every input")
    return [found[place] for place in range(len(chosen))]


def _refused(mutant, name):
    try:
        read_functions(mutant.text, f"{name}.m")
    except InputError:
        return "refused"
    return ""


def _judge(found, chosen, octave, text, asked, what):
    left = [place for place, killer in found.items() if not killer]
    functions = {"right": text.encode()} | {f"mutant_{place}": chosen[place].text.encode() for place in left}
    answers = answers_of(octave, functions, asked)
    right = {output: answers["right"][output].read_bytes() for output in OUTPUTS}
    for place in left:
        for output in OUTPUTS:
            other = answers[f"mutant_{place}"][output]
            if not found[place] and (not isinstance(other, Path) or other.read_bytes() != right[output]):
                found[place] = what


def _by_cases(octave, name, text, script):
    try:
        cases = input_cases(octave, name, {f"{name}.m": text.encode(), SETUP: script})
    except RequirementError:
        return "inputs"
    return "" if all(holds for holds, _ in cases) else "inputs"
