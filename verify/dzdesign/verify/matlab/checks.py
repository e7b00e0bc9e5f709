"""Checks of a folder for MATLAB: the function's text, every input of it in Octave, and of the C code beside it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from dzdesign.core.artefact_files import read_bytes, sha256_of
from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.scratch import scratch_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.all_inputs import input_check, input_checks
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.matlab.asked_codes import AskedCodes, answers_of, asked_codes
from dzdesign.verify.matlab.octave import Octave, available_octave, run_octave
from dzdesign.verify.matlab.operations import operations_check
from dzdesign.verify.matlab.subset import ReadFunction, read_functions
from dzdesign.verify.output_evidence import OutputChecks, TriedInputs
from dzdesign.verify.requirements import EXACT_LAW, MATLAB_INPUTS, MATLAB_SUBSET, Check
from dzdesign.verify.toolchain.compiled_core import SOURCE, CompiledCore, Findings

Say = Callable[[str], None]
NAMES = {1: "dz_comp", -1: "dz_comp_negative"}
SETUP, HEADER = "setup_c_caller.m", "core/dz_comp.h"
#: Faults that a sentence names, and cases of inputs that are tried at least.
MOST_NAMED, LEAST_CASES = 3, 40


def checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder for MATLAB; what is not as the manifest has it, or not of the subset, is not run."""
    texts, others = _unchanged(folder, manifest, compensator)
    if others:
        text = f"not run, because {and_more(others, MOST_NAMED)} is not as the manifest has it; make the folder again"
        return OutputChecks(checks=(EXACT_LAW.check(holds=False, text=text),))
    functions = {sign: texts[f"{NAMES[sign]}.m"] for sign in compensator.signals.signs}
    try:
        read = {sign: read_functions(text.decode("ascii", "replace"), f"{NAMES[sign]}.m")
                for sign, text in functions.items()}  # fmt: skip
    except InputError as error:
        return OutputChecks(checks=(MATLAB_SUBSET.check(holds=False, text=str(error)),))
    lines, parts = sum(len(text.splitlines()) for text in functions.values()), sum(map(len, read.values()))
    words = f"{lines} lines, {parts} functions that MATLAB and Octave interpret alike: integers, without loops, "
    words += "files or eval"
    found, tried = [MATLAB_SUBSET.check(holds=True, text=words)], []
    octave = available_octave()
    for sign, content in functions.items():
        try:
            of_side, inputs = _of_side(folder, compensator, sign, content, read[sign][0], octave, say)
        except RequirementError as error:
            name = f"{NAMES[sign]}: {EXACT_LAW.title}"
            found.append(EXACT_LAW.check(holds=False, text=str(error), name=name))
            continue
        found += of_side
        tried += inputs
        if octave.path:
            found.append(_inputs(octave.path, sign, texts))
    return OutputChecks(checks=tuple(found), inputs=tuple(tried), versions=octave.versions)


def _unchanged(folder: Path, manifest: OutputManifest, compensator: Compensator) -> tuple[dict[str, bytes], list[str]]:
    """Return the files that are run or compiled, and the names of those that are not as the manifest has them."""
    signs = compensator.signals.signs
    core = (f"core/{name}" for name in (SOURCE, "dz_calibration.h", "dz_valve.h"))
    names = [*(f"{NAMES[sign]}.m" for sign in signs), SETUP, HEADER, *core]
    others, texts = [], {}
    for name in names:
        path = folder / name
        texts[name] = read_bytes(path, "file of the output") if path.is_file() else b""
        if not path.is_file() or sha256_of(texts[name]) != manifest.files.get(name):
            others.append(name)
    return texts, others


def _of_side(
    folder: Path, compensator: Compensator, sign: int, text: bytes, read: ReadFunction, octave: Octave, say: Say
) -> tuple[list[Check], list[TriedInputs]]:
    """Return what trying every input of one side found: of the C code, and where Octave is there of the function."""
    prepared = PreparedInputs(ExactLaw(compensator, sign))
    core, name, units = CompiledCore(folder, sign), f"{NAMES[sign]}.m", compensator.valve.recorded_units
    say(f"trying every input of core/{core.name}")
    with asked_codes(core, sign, prepared.everything(), prepared.exact.zero) as asked:
        of_c = input_check(prepared, core.sha256, asked.compiled)
        found = [_named(check, f"core/{core.name}: ") for check in input_checks(of_c, units, both_signs=False)]
        found.append(operations_check(read, prepared))
        tried = [_tried(f"core/{core.name}", of_c)]
        # Of wrong C the check asks for more inputs than of right one, so there is no list of them.
        missing = "not run, because the C code beside it is wrong" if of_c.wrong + of_c.odd_pairs else octave.missing
        if missing:
            found.append(EXACT_LAW.check(holds=None, text=missing, name=f"{name}: {EXACT_LAW.title}"))
            return found, tried
        say(f"trying every input of {name} in Octave")
        findings = judged_in_octave(octave.path, NAMES[sign], text, asked)
    of_function = input_check(prepared, sha256_of(text), findings)
    found += [_named(check, f"{name}: ") for check in input_checks(of_function, units, both_signs=False)]
    return found, [*tried, _tried(name, of_function)]


def judged_in_octave(octave: str, name: str, text: bytes, asked: AskedCodes) -> Findings:
    """Return what the check finds of a function that Octave runs; one that ends with an error: `RequirementError`."""
    answers = answers_of(octave, {name: text}, asked)[name]
    for reason in answers.values():
        if isinstance(reason, str):
            raise RequirementError(f"{name}.m ended with an error: {reason}")
    paths = {output: path for output, path in answers.items() if isinstance(path, Path)}
    return asked.judged(paths, text, f"{name}.m")


def _named(check: Check, prefix: str) -> Check:
    """Return a check with the file that it is of before its name."""
    return replace(check, name=prefix + check.name)


def _tried(name: str, inputs: InputCheck) -> TriedInputs:
    return TriedInputs(
        name=f"{name}: codes, {inputs.side} commands", inputs=inputs.inputs, wrong=inputs.wrong,
        outputs_hash=inputs.outputs_hash,
    )  # fmt: skip


def _inputs(octave: str, sign: int, texts: dict[str, bytes]) -> Check:
    """Tell whether inputs are taken and refused as the function's help says, and whether the script parses."""
    name = NAMES[sign]
    title = f"{name}.m: {MATLAB_INPUTS.title}"
    try:
        cases = input_cases(octave, name, {f"{name}.m": texts[f"{name}.m"], SETUP: texts[SETUP]})
    except RequirementError as error:
        return MATLAB_INPUTS.check(holds=False, text=str(error), name=title)
    faults = [text for holds, text in cases if not holds]
    text = f"{len(cases)} cases of classes, sizes and refusals agree with its help; {SETUP} was parsed but not run"
    return MATLAB_INPUTS.check(holds=not faults, text=and_more(faults, MOST_NAMED) if faults else text, name=title)


def input_cases(octave: str, name: str, files: dict[str, bytes]) -> list[tuple[bool, str]]:
    """Return each case of inputs of a function: whether it is as described, and what it was."""
    with scratch_folder() as place:
        for path, content in files.items():
            (place / path).write_bytes(content)
        printed = run_octave(octave, "inputs_of.m", [name, SETUP.removesuffix(".m")], place)
    cases = [(line[0] == "1", line[2:]) for line in printed.splitlines() if line[:2] in ("0 ", "1 ")]
    if len(cases) < LEAST_CASES:
        raise RequirementError(f"Octave tried {len(cases)} cases of inputs, expected at least {LEAST_CASES}")
    return cases
