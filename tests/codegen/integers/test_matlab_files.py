"""The function for MATLAB and the script beside it, as they are written: language, numbers, inputs, refusals."""

import re
import subprocess
from pathlib import Path

import pytest

from dzdesign.codegen.integers.matlab import law_function, note_of, output_files
from dzdesign.codegen.integers.text import matlab_integer
from dzdesign.codegen.project import generate, target_named
from dzdesign.core.errors import DzdesignError, InputError
from dzdesign.verify.outputs.texts import FLAGS
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.octave import OCTAVE, needs_octave, output_of, written

DIGEST = "0" * 64
CASES = {"one solenoid": (GOLDENS, 1), "two solenoids": (FULL, 1), "negative": (FULL, -1)}
INPUTS = Path(__file__).parents[2] / "support" / "matlab_inputs.m"


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES.keys())
def text(request):
    root, sign = request.param
    return law_function(golden_compensator(root=root), DIGEST, sign)


def code_of(text):
    """Return a text without comments and texts in quotes."""
    return re.sub(r"'(?:[^'\n]|'')*'|%[^\n]*|\.\.\.[^\n]*", "", text)


def test_it_is_plain_ascii_of_what_both_tools_read_alike(text):
    assert text.isascii() and DIGEST in text and "\t" not in text and len(text.splitlines()) < 300
    assert max(map(len, text.splitlines())) <= 140
    code = code_of(text)
    assert not re.search(r"[#!@\"`/\\?]|\+=|-=|\*=|\+\+|--|\bend[a-z]+|\b(?:for|while|eval|global)\b", code)
    # Of quotients none is left: integer classes round them to the nearest.
    assert "idivide" not in code and not re.search(r"[^.]\.[^.*\d]", code)
    numbers = list(map(int, re.findall(r"\b\d+\b", code)))
    assert max(numbers) < 2**53 and len(numbers) > 100


def test_numbers_beyond_a_double_are_two_factors():
    assert matlab_integer(2**53 - 1) == f"int64({2**53 - 1})"
    assert matlab_integer(-5 * 2**55) == "int64(-5) * int64(2^55)"
    with pytest.raises(DzdesignError):
        matlab_integer(2**53 + 1)


@needs_octave
@pytest.mark.parametrize(("root", "name"), [(GOLDENS, "dz_comp"), (FULL, "dz_comp_negative")])
def test_inputs_of_every_class_and_size_are_taken_or_refused_as_its_help_says(root, name, tmp_path):
    folder = written(golden_compensator(root=root), tmp_path / "matlab")
    command = [OCTAVE, *FLAGS, str(INPUTS), name, "setup_c_caller"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True, timeout=120)
    lines = done.stdout.splitlines()
    assert len(lines) == 48 and [line for line in lines if not line.startswith("1 ")] == []


@needs_octave
@pytest.mark.parametrize(
    ("old", "new"),
    [("values <= 65535 & ", ""), ("isreal(values)", "isreal(1)"), ("numel(codes) == 1", "numel(codes) == 0"),
     ("status = reshape(uint16(status), shape)", "status = uint16(status)"), ("nargin ~= 3", "nargin > 3")],
)  # fmt: skip
def test_a_function_that_takes_what_it_must_not_is_seen(old, new, tmp_path):
    path = written(golden_compensator(), tmp_path / "matlab") / "dz_comp.m"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    command = [OCTAVE, *FLAGS, str(INPUTS), "dz_comp", "setup_c_caller"]
    done = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, check=True, timeout=120)
    assert any(line.startswith("0 ") for line in done.stdout.splitlines())


def test_the_folder_holds_the_c_of_the_firmware_and_is_the_same_bytes_again():
    made = golden_compensator(root=FULL)
    files, firmware = output_of(made).files, generate(made, "host").files
    assert {"dz_comp.m", "dz_comp_negative.m", "setup_c_caller.m", "core/dz_comp.h", "core/dz_comp.c"} <= set(files)
    assert files == output_of(made).files
    core = [name for name in files if name.startswith("core/")]
    # The banner has the hash of the file that each was made from.
    hashless = [re.sub(r"[0-9a-f]{64}", "", text) for name in core for text in (files[name].decode(), firmware[name])]
    assert hashless[::2] == hashless[1::2]


def test_the_script_names_every_file_and_function_of_the_core():
    for root, functions in ((GOLDENS, ["dz_comp"]), (FULL, ["dz_comp", "dz_comp_negative"])):
        script = output_of(golden_compensator(root=root)).files["setup_c_caller.m"].decode()
        called = ", ".join(f"'{name}'" for name in functions)
        assert f"    sources = {{'dz_comp.c'}};\n    functions = {{{called}}};\n" in script


def test_what_a_function_leaves_out_is_said():
    note = note_of(golden_compensator(root=FULL), {})
    assert all(name in note for name in ("dither", "ramps", "debouncing", "latching", "interlock"))


def test_current_control_is_refused(wording):
    made = with_current(golden_compensator(), target_named("f28335"), SENSORS["supply unknown"])
    with wording.refusal(InputError):
        output_files(made, None, {})
