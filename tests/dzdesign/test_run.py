"""`run`: the whole chain from one file; a stage whose inputs have not changed is not run again."""

import shutil

import pytest

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError
from tests.support.synthetic import needs_compiler

OPTIONS = """\
ramps = ["{ramps}"]
meter-lag = "0.1 s"
curve = "line"
target = "{target}"
"""


def written(folder, ramps, target="host", more=""):
    file = folder / "dzdesign.toml"
    file.write_text(more + OPTIONS.format(ramps=(ramps / "ramp_dP[135]_1.csv.gz").as_posix(), target=target))
    return file


def unchanged(run):
    return [each.stage for each in run.stages if each.unchanged]


@pytest.fixture
def ramps(example_folder):
    return example_folder / "ramps"


@needs_compiler
@pytest.mark.slow
def test_what_has_not_changed_is_not_run_again(ramps, tmp_path, capsys):
    file, folder = written(tmp_path, ramps), tmp_path / "valve"
    assert main(["run", str(file), "-o", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert "the certificate covers the valve as recorded" in printed and "onset-hidden" in printed
    assert (folder / "evidence" / "report.html").is_file()
    again = api.run(file, output=folder)
    assert again.holds and unchanged(again) == ["identify", "design", "codegen", "verify"]
    # A file that was lost, an option of one stage, and a result that was edited.
    (folder / "firmware" / "core" / "dz_comp.c").unlink()
    assert unchanged(api.run(file, output=folder)) == ["identify", "design", "verify"]
    written(tmp_path, ramps, more='guard = "mean"\n')
    assert unchanged(api.run(file, output=folder)) == ["identify"]
    shutil.copy(ramps / "ramp_dP2_1.csv.gz", tmp_path / "more.csv.gz")
    file.write_text(file.read_text().replace('ramps = ["', f'ramps = ["{(tmp_path / "more.csv.gz").as_posix()}", "'))
    assert unchanged(api.run(file, output=folder)) == []


@pytest.mark.slow
def test_another_output_is_run_too(ramps, tmp_path):
    file = written(tmp_path, ramps, target="amplifier", more='device = "west"\n')
    found = api.run(file, output=tmp_path / "valve")
    assert found.holds and found.stages[2].path.name == "amplifier" and found.report.name == "evidence.json"


@pytest.mark.parametrize(
    ("text", "says"),
    [("u-max = '10 V'\n", "names no recordings"), ("ramps = ['nothing_*.csv']\n", "no file matches 'nothing_"),
     ("ramp = ['a.csv']\n", "there is no option 'ramp'"), ("ramps = ['a.csv']\ntarget = 'f28334'\n", "f28335")],
)  # fmt: skip
def test_a_file_that_does_not_do_is_refused_and_nothing_is_written(text, says, tmp_path):
    file = tmp_path / "options.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=says):
        api.run(file, output=tmp_path / "valve")
    assert not (tmp_path / "valve" / "valve.json").exists()


def test_without_a_file_it_is_said_which_one_is_missing(tmp_path):
    with pytest.raises(InputError, match=r"dzdesign\.toml"):
        api.run(output=tmp_path)
