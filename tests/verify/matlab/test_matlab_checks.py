"""`verify` of a folder for MATLAB: what it finds, must not overlook, and does not run. On few inputs."""

import json
import os
from pathlib import Path

import pytest

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.matlab import asked_codes as asked_module
from dzdesign.verify.matlab import checks as checks_module
from dzdesign.verify.matlab import octave as octave_module
from dzdesign.verify.matlab.checks import judged_in_octave
from dzdesign.verify.matlab.octave import run_octave
from dzdesign.verify.outputs.folder import read_output_manifest
from tests.support.block_mutants import evenly
from tests.support.matlab_mutants import killers, mutants
from tests.support.octave import OCTAVE, compensator_of, needs_octave, sampled_codes, written
from tests.support.paths import GOLDENS, GOLDENS_FULL
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
SIDES = {"dz_comp": 1, "dz_comp_negative": -1}


@pytest.fixture(scope="module")
def full():
    return compensator_of(GOLDENS_FULL)


@pytest.fixture
def folder(tmp_path):
    return written(compensator_of(GOLDENS), tmp_path / "matlab")


@pytest.fixture
def few(monkeypatch):
    """Let every input be few: some pressure drops, and no pairs of pressures besides."""
    assembled = PreparedInputs._assembled

    def thinned(self, rows, places, stride, how):
        return assembled(self, rows[:: 211 if rows.size > 1000 else 1], places, 257, {**how, "cube": False})

    monkeypatch.setattr(PreparedInputs, "_assembled", thinned)
    # Of few rows no drive at zero command is known where it is asked for.
    monkeypatch.setattr(checks_module, "input_check", few_counts)


def few_counts(prepared, sha256, found):
    from dzdesign.verify.exhaustive import all_inputs

    scale, corners = prepared._corners
    law = (corners[0][1] // scale).astype(int)[prepared._law_of[:-1]]
    object.__setattr__(found, "at_zero", law)
    return all_inputs.input_check(prepared, sha256, found)


def checks_of(folder):
    manifest = read_output_manifest(folder)
    return checks_module.checks(folder, manifest, read_compensator(folder), lambda _: None)


def edited(folder: Path, name, old, new, *, told=True):
    """Change a file, and where `told` its hash in the manifest too."""
    path, manifest = folder / name, folder / "manifest.json"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    if told:
        document = json.loads(manifest.read_text())
        document["files"][name] = sha256_of(path.read_bytes())
        manifest.write_text(json.dumps(document))


@needs_octave
def test_a_good_folder_holds_and_function_and_c_give_the_same(few, folder):
    found = checks_of(folder)
    assert all(check.holds for check in found.checks), [check for check in found.checks if not check.holds]
    assert {check.id for check in found.checks} == {
        "matlab-subset", "matlab-ranges", "exact-law", "monotone", "over-compensation", "above-tests",
        "pressure-difference", "fallback", "matlab-inputs",
    }  # fmt: skip
    of_c, of_function = found.inputs
    assert of_c.wrong == of_function.wrong == 0 and "octave" in found.versions
    assert of_c.inputs == of_function.inputs > 100_000 and of_c.outputs_hash == of_function.outputs_hash


@needs_octave
@pytest.mark.parametrize("name", SIDES)
def test_the_function_is_the_exact_law_on_a_sample(name, full, tmp_path):
    folder = written(full, tmp_path / "matlab")
    with sampled_codes(folder, full, SIDES[name]) as asked:
        found = judged_in_octave(OCTAVE, name, (folder / f"{name}.m").read_bytes(), asked)
        assert found.faults == asked.compiled.faults == 0 and found.inputs == asked.compiled.inputs > 5_000
        assert found.outputs_hash == asked.compiled.outputs_hash


@needs_octave
@pytest.mark.parametrize(
    ("old", "new", "count"),
    [
        ("HALF = int64(", "HALF = int64(1", "wrong"),
        ("a = p_a - PRESSURE_A_ZERO;", "a = p_a - PRESSURE_A_ZERO + min(max(p_b - 900, 0), 1);", "wrong"),
        ("law_beta(failed) = LAW_LEAST", "law_beta(failed) = LAW_LEAST + LAW_NODES(1)", "bad_fallbacks"),
        ("uint16(b_failed) * 4", "uint16(b_failed) * 2", "bad_status"),
        ("BETA_SHIFT = ", "BETA_SHIFT = 1 + ", "bad_betas"),
    ],
)
def test_what_is_wrong_is_counted_as_what_it_is(folder, old, new, count):
    text = (folder / "dz_comp.m").read_text()
    assert old in text
    with sampled_codes(folder, compensator_of(GOLDENS)) as asked:
        found = judged_in_octave(OCTAVE, "dz_comp", text.replace(old, new, 1).encode(), asked)
    assert getattr(found, count) > 0


@needs_octave
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("uint16(quotient), shape", "uint32(quotient), shape", "uint32"),
        ("reshape(uint16(quotient), shape)", "uint16(0)", "size"),
        ("left = LAW_NODES(row + 1)", "left = LAW_NODES(row)", "LAW_NODES"),
        ("codes = int32(values);", "codes = codes_of(values, name);", "recursion"),
    ],
)
def test_a_function_that_fails_does_not_hold(folder, old, new, words):
    text = (folder / "dz_comp.m").read_text()
    assert old in text
    asked = sampled_codes(folder, compensator_of(GOLDENS))
    with asked as codes, pytest.raises(RequirementError, match=words):
        judged_in_octave(OCTAVE, "dz_comp", text.replace(old, new, 1).encode(), codes)


@needs_octave
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("values <= 65535 & ", ""),
        ("isreal(values)", "isreal(1)"),
        ("issparse(values)", "issparse(1)"),
        ("numel(codes) == 1", "numel(codes) == 0"),
        ("reshape(found, shape)", "found"),
        ("nargin ~= 3", "nargin > 3"),
    ],
)
def test_wrong_classes_and_sizes_are_seen(folder, old, new, few):
    edited(folder, "dz_comp.m", old, new)
    found = {check.id: check.holds for check in checks_of(folder).checks if check.name.startswith("dz_comp.m: ")}
    assert found["matlab-inputs"] is False


def test_an_octave_that_does_not_run_is_not_there(tmp_path, monkeypatch):
    for name in ("true", str(tmp_path)):
        monkeypatch.setattr(octave_module, "find_octave", lambda name=name: name)
        octave = octave_module.available_octave()
        assert not octave.path and octave.missing and not octave.versions


@needs_octave
def test_a_script_that_does_not_parse_is_seen(folder, few):
    edited(folder, "setup_c_caller.m", "end\n", "\n")
    assert [check.holds for check in checks_of(folder).checks if check.id == "matlab-inputs"] == [False]


def test_wrong_c_does_not_hold(folder, few, monkeypatch):
    monkeypatch.setattr(octave_module, "find_octave", lambda: None)
    edited(folder, "core/dz_comp.c", "#define FACTOR_OFFSET INT32_C(", "#define FACTOR_OFFSET INT32_C(1")
    found = {check.name: check.holds for check in checks_of(folder).checks}
    assert found["core/dz_comp.c: equals the exactly rounded law"] is False
    assert found["dz_comp.m: equals the exactly rounded law"] is None


def test_without_octave_the_function_is_not_checked_and_the_c_is(folder, few, monkeypatch):
    monkeypatch.setattr(octave_module, "find_octave", lambda: None)
    found = checks_of(folder)
    assert {check.name: check.holds for check in found.checks}["dz_comp.m: equals the exactly rounded law"] is None
    assert "apt install octave" in next(check.text for check in found.checks if check.holds is None)
    assert sum(check.holds is True for check in found.checks) >= 7 and not found.versions


@pytest.mark.parametrize("name", ["dz_comp.m", "setup_c_caller.m", "core/dz_comp.c", "core/dz_comp.h"])
def test_what_is_not_as_generated_is_not_run(folder, name, monkeypatch):
    for runs in ("run_program", "run_child"):
        monkeypatch.setattr(octave_module, runs, lambda *_, **__: pytest.fail("a program was run"))
    edited(folder, name, "\n", "\n\n", told=False)
    (check,) = checks_of(folder).checks
    assert (check.id, check.holds) == ("exact-law", False) and name in check.text
    (folder / name).unlink()
    assert not checks_of(folder).checks[0].holds


@pytest.mark.parametrize("line", ["system('touch it');", "if true\nend", "x = @sin;", "!touch it", "cd ..;"])
def test_what_is_not_of_the_subset_is_not_run_though_the_manifest_has_it(folder, line, monkeypatch):
    for runs in ("run_program", "run_child"):
        monkeypatch.setattr(octave_module, runs, lambda *_, **__: pytest.fail("a program was run"))
    edited(folder, "dz_comp.m", "    % ---- signals ----\n", f"    {line}\n")
    (check,) = checks_of(folder).checks
    assert (check.id, check.holds) == ("matlab-subset", False)


@needs_octave
def test_octave_runs_nothing_of_the_users(folder, tmp_path, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    (home / ".octaverc").write_text("error('the user''s settings were run');\n")
    for name, value in (("HOME", home), ("OCTAVE_SITE_INITFILE", home / ".octaverc"), ("OCTAVE_PATH", home)):
        monkeypatch.setenv(name, str(value))
    (home / "bitshift.m").write_text("error('a function of the user''s was run');\n")
    with sampled_codes(folder, compensator_of(GOLDENS)) as asked:
        assert judged_in_octave(OCTAVE, "dz_comp", (folder / "dz_comp.m").read_bytes(), asked).faults == 0


@needs_octave
def test_octave_that_fails_or_hangs_is_a_requirement_error(tmp_path, monkeypatch):
    with pytest.raises(RequirementError, match="exit status"):
        run_octave(OCTAVE, "no_such_program.m", [], tmp_path)
    monkeypatch.setattr(octave_module, "TIMEOUT_S", 0.01)
    with pytest.raises(RequirementError, match="did not end"):
        run_octave(OCTAVE, "inputs_of.m", ["dz_comp", "setup_c_caller"], tmp_path)
    with pytest.raises(RequirementError, match="did not start"):
        run_octave(os.devnull, "inputs_of.m", [], tmp_path)


@needs_octave
def test_pieces_of_the_inputs_give_the_same_answers(folder, monkeypatch):
    text = (folder / "dz_comp.m").read_bytes()
    with sampled_codes(folder, compensator_of(GOLDENS)) as asked:
        whole = judged_in_octave(OCTAVE, "dz_comp", text, asked)
        monkeypatch.setattr(asked_module, "WORTH_A_PROCESS", 1000)
        monkeypatch.setattr(asked_module.os, "cpu_count", lambda: 3)
        assert len(asked_module._pieces(asked.count("core"))) == 3
        again = judged_in_octave(OCTAVE, "dz_comp", text, asked)
        assert (again.outputs_hash, again.faults) == (whole.outputs_hash, 0)


def test_answers_for_other_codes_are_refused(folder):
    """The check must have asked for all answers, and got one for each."""
    with sampled_codes(folder, compensator_of(GOLDENS)) as asked:
        size = {output: 2 * asked.count(output) for output in asked_module.OUTPUTS}
        for by in (-2, 2):
            answers = {output: asked.folder / f"{output}.zeros" for output in size}
            for output, path in answers.items():
                path.write_bytes(bytes(size[output] + (by if output == "status" else 0)))
            if by < 0:
                with pytest.raises(RequirementError, match="answers"):
                    asked.judged(answers, b"", "zeros")
        # All answers are zero: every input but those of no drive is wrong.
        answers["status"].write_bytes(bytes(size["status"]))
        assert asked.judged(answers, b"", "zeros").wrong > 5_000


@needs_octave
def test_most_wrong_functions_are_caught_by_a_sample(folder):
    """Twenty here; benchmarks/outputs/matlab_mutants.py judges sixty of each function on every input."""
    text, script = (folder / "dz_comp.m").read_text(), (folder / "setup_c_caller.m").read_bytes()
    assert len(mutants(text)) > 150
    chosen = evenly(mutants(text), 20)
    with sampled_codes(folder, compensator_of(GOLDENS)) as sample:
        found = killers(chosen, OCTAVE, text, script, "dz_comp", sample)
    left = [mutant for mutant, killer in zip(chosen, found, strict=True) if not killer]
    assert len(left) <= 4, [(mutant.line, mutant.change) for mutant in left]
