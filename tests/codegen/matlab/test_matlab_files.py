"""The function for MATLAB and the script beside it, as they are written: language, ranges, numbers, refusals."""

import re
from dataclasses import replace

import pytest

from dzdesign.codegen.core.integer_form import integer_form
from dzdesign.codegen.matlab.constants import matlab_integer
from dzdesign.codegen.matlab.files import law_function, note_of, output_files
from dzdesign.codegen.matlab.ranges import Range, proved_ranges
from dzdesign.codegen.project import generate, target_named
from dzdesign.command_line.cli import main
from dzdesign.core.errors import DzdesignError, InputError
from tests.support.example_coil import SENSORS, with_current
from tests.support.octave import compensator_of, output_of
from tests.support.paths import GOLDENS, GOLDENS_FULL

DIGEST = "0" * 64
CASES = {"one solenoid": (GOLDENS, 1), "two solenoids": (GOLDENS_FULL, 1), "negative": (GOLDENS_FULL, -1)}


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES.keys())
def case(request):
    root, sign = request.param
    return compensator_of(root), sign


def code_of(text):
    """Return a text without comments and texts in quotes."""
    return re.sub(r"'(?:[^'\n]|'')*'|%[^\n]*|\.\.\.[^\n]*", "", text)


def test_it_is_plain_ascii_with_the_compensators_hash(case):
    text = law_function(case[0], DIGEST, case[1])
    assert text.isascii() and DIGEST in text and "\t" not in text and len(text.splitlines()) < 300
    assert max(map(len, text.splitlines())) <= 140


def test_it_is_of_what_both_tools_read_alike(case):
    code = code_of(law_function(case[0], DIGEST, case[1]))
    assert not re.search(r"[#!@\"`/\\?]|\+=|-=|\*=|\+\+|--|\bend[a-z]+|\b(?:for|while|eval|global)\b", code)
    # Of quotients none is left: integer classes round them to the nearest.
    assert "idivide" not in code and not re.search(r"[^.]\.[^.*\d]", code)


def test_no_number_is_more_than_a_double_holds(case):
    numbers = list(map(int, re.findall(r"\b\d+\b", code_of(law_function(case[0], DIGEST, case[1])))))
    assert max(numbers) < 2**53 and len(numbers) > 100


def test_numbers_beyond_a_double_are_two_factors():
    assert matlab_integer(2**53 - 1, "int64") == f"int64({2**53 - 1})"
    assert matlab_integer(-5 * 2**55, "int64") == "int64(-5) * int64(2^55)"
    for value, kind in ((2**53 + 1, "int64"), (2**60, "int32")):
        with pytest.raises(DzdesignError):
            matlab_integer(value, kind)


def test_every_range_holds_a_value_of_the_law(case):
    """At the extremes of the inputs the intermediate values lie in the ranges that are printed."""
    made, sign = case
    form = integer_form(made, sign)
    ranges = proved_ranges(made, form, sign)
    step, nodes = made.beta_step_codes, form.table[:-2]
    assert ranges["law_beta"] == Range(min(nodes) * step, max(nodes) * step)
    assert ranges["difference"].low < 0 < ranges["difference"].high < 2**31
    assert all(str(value) in law_function(made, DIGEST, sign) for name, value in ranges.items()
               if name in ("factor", "row", "beyond", "missing", "quotient"))  # fmt: skip


@pytest.mark.parametrize("change", [{"slope": 2**40}, {"offset": 2**62}, {"half": 2**63}, {"transition": 2**45}])
def test_what_leaves_its_class_is_refused(change):
    made = compensator_of(GOLDENS)
    with pytest.raises(InputError, match=r"dz_comp\.m"):
        proved_ranges(made, replace(integer_form(made), **change), 1)


def test_too_few_nodes_are_refused():
    made = compensator_of(GOLDENS)
    form = integer_form(made)
    with pytest.raises(InputError, match="nodes"):
        proved_ranges(made, replace(form, table=form.table[5:]), 1)


def test_the_folder_holds_the_c_of_the_firmware_and_is_the_same_bytes_again():
    made = compensator_of(GOLDENS_FULL)
    files, firmware = output_of(made).files, generate(made, "host").files
    assert list(files) == ["dz_comp.m", "dz_comp_negative.m", "setup_c_caller.m", "core/dz_comp.h",
                           "core/dz_calibration.h", "core/dz_valve.h", "core/dz_comp.c",
                           "compensator.json"]  # fmt: skip
    assert files == output_of(made).files
    core = [name for name in files if name.startswith("core/")]
    # The banner has the hash of the file that each was made from.
    hashless = [re.sub(r"[0-9a-f]{64}", "", text) for name in core for text in (files[name].decode(), firmware[name])]
    assert hashless[::2] == hashless[1::2]


def test_the_script_names_every_file_and_function_of_the_core():
    for root, functions in ((GOLDENS, ["dz_comp"]), (GOLDENS_FULL, ["dz_comp", "dz_comp_negative"])):
        script = output_of(compensator_of(root)).files["setup_c_caller.m"].decode()
        called = ", ".join(f"'{name}'" for name in functions)
        assert f"    sources = {{'dz_comp.c'}};\n    functions = {{{called}}};\n" in script


def test_what_a_function_leaves_out_is_said():
    note = note_of(compensator_of(GOLDENS_FULL), {})
    assert all(name in note for name in ("dither", "ramps", "debouncing", "latching", "interlock"))


def test_current_control_is_refused(wording):
    made = with_current(compensator_of(GOLDENS), target_named("f28335"), SENSORS["supply unknown"])
    with wording.refusal(InputError):
        output_files(made, None, {})


@pytest.mark.parametrize("options", ["--dialect codesys", "--calibration block", "--vectors 4000", "--interface codes"])
def test_a_wrong_option_writes_nothing(options, tmp_path, capsys, wording):
    source, folder = GOLDENS / "compensator.json", tmp_path / "matlab"
    assert main(["codegen", str(source), "--target", "matlab", *options.split(), "-o", str(folder)]) == 2
    wording.of_test(capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []
