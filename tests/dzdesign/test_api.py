"""The API gives what the commands give, is light to import, is typed, and shows its results safely in a notebook."""

import inspect
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.command_line.parser import arguments_of_command, in_file
from tests.support.html_pages import Page
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

NOTEBOOK = ROOT / "examples" / "notebook" / "ramps_to_firmware.ipynb"
HOSTILE = '<script>alert("1")</script>&'


@pytest.fixture(scope="module")
def ramps(example_folder):
    return sorted((example_folder / "ramps").glob("*.csv.gz"))[:2]


def test_a_notebook_completes_the_api_and_nothing_else():
    assert dir(api) == sorted(api.__all__)
    assert all(callable(getattr(api, name)) for name in dir(api))


def test_the_api_writes_the_bytes_of_the_commands(ramps, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = ["--meter-lag", "0.1 s", "--x-max", "1.8 mm", "--confidence", "0.95"]
    assert main(["identify", *map(str, ramps), *options]) == 0
    assert main(["design", "valve.json", "--guard", "mean", "--target", "host"]) == 0
    assert main(["codegen", "compensator.json", "--target", "host"]) == 0
    valve = api.identify(ramps, meter_lag="0.1 s", x_max="1.8 mm", confidence=0.95, output="api_valve.json")
    compensator = api.design(valve, guard="mean", target="host", output="api_compensator.json")
    api.generate(compensator, target="host", output="api_firmware")
    pairs = ("valve.json", "compensator.json", "firmware/manifest.json")
    assert all(Path(name).read_bytes() == Path(f"api_{name}").read_bytes() for name in pairs)
    assert capsys.readouterr().out.count("Written") == 2  # by the commands; the API prints nothing
    by_path = api.generate(Path("compensator.json"), target="host")
    assert by_path == api.generate(api.design("valve.json", guard="mean", target="host"), target="host")


def test_an_options_file_stands_behind_the_keywords_as_behind_the_command_line(ramps, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lines = ['meter-lag = "0.1 s"', 'x-max = "1.8 mm"', 'guard = "mean"', "[record]", 'serial = "4711"', 'oil = "46"']
    Path("dzdesign.toml").write_text("\n".join(lines))
    words = ["--config", "dzdesign.toml", "--x-max", "2 mm", "--record", "serial = 4712"]
    assert main(["identify", *map(str, ramps), *words]) == 0
    assert main(["design", "valve.json", "--config", "dzdesign.toml"]) == 0
    record = {"serial": "4712"}
    valve = api.identify(ramps, config=Path("dzdesign.toml"), x_max="2 mm", record=record, output="api_valve.json")
    api.design(valve, config="dzdesign.toml", output="api_compensator.json")
    for name in ("valve.json", "compensator.json"):
        assert Path(name).read_bytes() == Path(f"api_{name}").read_bytes()
    assert valve.record == {"serial": "4712", "oil": "46"}
    Path("wrong.toml").write_text('u-max = "10"\n')
    for config, told in (
        ("wrong.toml", "'wrong.toml': u-max is '10' without a unit; write for example u-max = \"10 V\""),
        ("none.toml", "config file 'none.toml' does not exist"),
        ("", "config: expected a path, got ''"),
    ):
        with pytest.raises(api.InputError) as error:
            api.identify(ramps, config=config)
        assert str(error.value).startswith(told)
    with pytest.raises(api.InputError, match="read_calibration has no option 'config'"):
        api.read_calibration("block.bin", config="dzdesign.toml")
    assert main(["identify", *map(str, ramps), "--config", ""]) == 2
    assert "--config is empty, expected the name of a file" in capsys.readouterr().err


def test_the_options_are_those_of_the_commands():
    for command in ("init", "identify", "design", "codegen", "verify", "simulate", "assess", "report", "batch"):
        function = getattr(api, "generate" if command == "codegen" else command)
        arguments = (*arguments_of_command(command), *in_file(command))
        options = [argument.name for argument in arguments if argument.name != "list_targets"]
        assert set(inspect.signature(function).parameters) == {*options, "config"}
        for name in options:
            assert re.search(rf"^{name} : \w+", inspect.getdoc(function), re.MULTILINE), (command, name)
        assert re.search(r"\n\n *Raises\n *------\n", function.__doc__)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda ramps: api.identify(ramps, u_max="10 bar"), "u_max is '10 bar'"),
        (lambda ramps: api.identify("nothing_*.csv"), "no file matches 'nothing_*.csv'"),
        (lambda ramps: api.identify([ramps[0], ramps[0]]), "an exact copy of the recording"),
        (lambda ramps: api.identify(ramps, output=ramps[0]), "not overwritten; choose another name with output"),
        (lambda ramps: api.design("nothing.json"), "'nothing.json' does not exist"),
        (lambda ramps: api.design("nothing.json", target="f28334"), "did you mean 'f28335'?"),
        (lambda ramps: api.verify("nothing"), "does not exist"),
        (lambda ramps: api.init("nothing_*.csv"), "no file matches 'nothing_*.csv'"),
        (lambda ramps: api.simulate(dp=["1 MPa", "1 MPa"]), "dp repeats a pressure drop"),
        (lambda ramps: api.simulate(dp="1 MPa", seed=-1), "seed is -1, expected a whole number"),
        (lambda ramps: api.assess(ramps, ramps), "an exact copy of the recording"),
        (lambda ramps: api.assess(ramps, ramps, limits={"linearty": "5 %"}), "did you mean 'linearity'?"),
        (lambda ramps: api.report("nothing"), "nothing"),
        (lambda ramps: api.batch("nothing", output="lot"), "'nothing'"),
        (lambda ramps: api.batch(".", output="lot", meter_lagg="0 s"), "did you mean 'meter_lag'?"),
    ],
)
def test_bad_input_is_one_sentence(call, words, ramps):
    with pytest.raises(api.InputError) as error:
        call(ramps)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: api.simulate(dp=1), "dp: expected text with a unit such as '1 MPa', got 1"),
        (lambda: api.simulate(dp=[1]), "dp[0]: expected text with a unit such as '1 MPa', got 1"),
        (lambda: api.simulate(ramp_time=5), "ramp_time: expected text with a unit such as '100 s', got 5"),
        (lambda: api.simulate(plant=5), "plant: expected a path, got 5"),
        (lambda: api.identify("x", meter_lag=0.1), "meter_lag: expected text with a unit such as '0.1 s', got 0.1"),
        (lambda: api.identify("x", dp={"x": 5}), "dp['x']: expected text with a unit such as '1 MPa', got 5"),
        (lambda: api.identify("x", record=5), "record: expected a mapping of names to values, got 5"),
        (lambda: api.identify(["x", 5]), "ramps[1]: expected a path, got 5"),
        (lambda: api.design("x", transition=1), "transition: expected text with a unit such as '1 %', got 1"),
        (lambda: api.design("x", accept=["x"]), "accept: expected text, got ['x']"),
        (lambda: api.design("x", target=28335), "target: expected text, got 28335"),
        (lambda: api.design("x", output=""), "output: expected a path, got ''"),
        (lambda: api.identify(["x", ""]), "ramps[1]: expected a path, got ''"),
        (lambda: api.design(5), "valve: expected a path, got 5"),
        (lambda: api.generate(None), "compensator: expected a path, got None"),
        (lambda: api.verify(5), "firmware: expected a path, got 5"),
        (
            lambda: api.assess("x", "y", reading_flow=0.6),
            "reading_flow: expected text with a unit such as '0.6 L/min', got 0.6",
        ),
        (lambda: api.assess("x", "y", limits={"z": 5}), "limits['z']: expected text with a unit such as '5 %', got 5"),
        (lambda: api.init(5), "ramps: expected a path, got 5"),
        (lambda: api.init(b"x"), "ramps: expected a path, got b'x'"),
        (lambda: api.report(None), "folder: expected a path, got None"),
        (
            lambda: api.batch(".", output="lot", transition=1),
            "transition: expected text with a unit such as '1 %', got 1",
        ),
        (
            lambda: api.identify("x", kneewindow="20-60"),
            "identify has no option 'kneewindow' (did you mean 'knee_window'?); see help(identify)",
        ),
        (lambda: api.verify("x", Plant="p"), "verify has no option 'Plant' (did you mean 'plant'?); see help(verify)"),
        (lambda: api.report("x", zzz=1), "report has no option 'zzz'; see help(report)"),
        (lambda: api.batch(".", record=5), "record: expected a mapping of names to values, got 5"),
    ],
)
def test_what_is_no_text_is_one_sentence(call, words):
    with pytest.raises(api.InputError) as error:
        call()
    assert str(error.value) == words


@pytest.mark.parametrize("zero", [0, 0.0, "0", "0 %"])
def test_zero_needs_no_unit_and_no_quotes(ramps, zero):
    found = api.identify(ramps, meter_lag="0.1 s", repeatability=zero)
    same = api.identify(ramps, meter_lag="0.1 s", repeatability="0.0 %")
    assert found == replace(same, options=found.options)  # which are stated as they were written


def test_paths_may_come_from_anything_that_gives_them(ramps):
    assert len(api.identify((path for path in ramps), meter_lag="0.1 s").made_from) == len(ramps)


@pytest.mark.slow
def test_what_stands_around_the_stages_writes_the_bytes_of_the_commands(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    two = ["--dp", "1 MPa", "--dp", "2 MPa", "--ramp-time", "20 s"]
    assert main(["simulate", *two, "-o", "lot/V1"]) == 0 and main(["simulate", *two, "--seed", "2", "-o", "after"]) == 0
    files = api.simulate(dp=["1 MPa", "2 MPa"], ramp_time="20 s", output="again").files
    assert {path.name: path.read_bytes() for path in Path("lot/V1").glob("*.gz")} == files
    assert Path("again/manifest.json").read_bytes() == Path("lot/V1/manifest.json").read_bytes()
    pairs = []
    assert main(["init", "lot/V1/*.gz", "-o", "init.toml"]) == 0
    proposal = api.init("lot/V1/*.gz", output="api_init.toml")
    assert not proposal.opens and "largest command: 10.00 V" in proposal.seen
    pairs.append(("init.toml", "api_init.toml"))
    limits = ["--limits", "dead_zone_opening = 60 %", "--meter-lag", "0.1 s"]
    assert main(["assess", "lot/V1/*.gz", "--after", "after/*.gz", *limits]) == 0
    compared = {"limits": {"dead_zone_opening": "60 %"}, "meter_lag": "0.1 s", "output": "api_assessment.json"}
    assert api.assess("lot/V1/*.gz", "after/*.gz", **compared).holds
    pairs.append(("assessment.json", "api_assessment.json"))
    Path("lot.toml").write_text('meter-lag = "0.1 s"\nguard = "mean"\ncurve = "line"\n')
    assert main(["batch", "lot", "--config", "lot.toml", "--jobs", "1", "-o", "done"]) == 0
    capsys.readouterr()
    said = {"meter_lag": "0.1 s", "guard": "mean", "curve": "line", "jobs": 1}
    summary = api.batch(Path("lot"), output=Path("api_done"), **said)
    assert summary.calibrated == summary.valves == 1
    pairs += [(f"done/{name}", f"api_done/{name}") for name in ("batch.json", "valves.csv", "report.html")]
    made = api.report("done", output="api_report.html")
    assert made.holds is None and "NOT VERIFIED" in made.verdict
    pairs.append(("done/report.html", "api_report.html"))
    for name, other in pairs:
        assert Path(name).read_bytes() == Path(other).read_bytes(), name
    assert capsys.readouterr() == ("", "")  # the API prints nothing


def test_a_valve_of_a_lot_that_fails_is_no_error_of_the_api(ramps, tmp_path):
    for name, content in (("V1", ramps[0].read_bytes()), ("V2", b"no table")):
        (tmp_path / "lot" / name).mkdir(parents=True)
        (tmp_path / "lot" / name / "a.csv").write_bytes(content)
    summary = api.batch(tmp_path / "lot", output=tmp_path / "out", jobs=1)
    assert [each.name for each in summary.failed] == ["V2"] and summary.calibrated == 1


def test_print_sums_a_result_up(example_valve, example_compensator, example_firmware):
    side, text = example_valve.positive, str(example_valve)
    assert text.startswith("Valve of 10 V, positive side, from 18 recordings\n")
    for test in side.tests:
        numbers = f"{test.dp_MPa:.3f} {test.u_knee_rising_V:.3f} {test.u_knee_falling_V:.3f} {test.u_knee_se_V:.4f}"
        assert re.search(r" +".join(map(re.escape, numbers.split())), text)
    assert "trend with dP: decreasing" in text and "warning [simulated] " in text
    for outside in ("below 0.50 MPa", "above 5.00 MPa"):
        assert f"note: {outside} the offset" in str(example_compensator)
    assert str(example_compensator).startswith("Compensator for f28335, law paper, of a valve of 10 V\n")
    assert "core/: dz_valve.h" in str(example_firmware)
    for result in (example_valve, example_compensator, example_firmware):
        assert repr([result]) == f"[<{str(result).splitlines()[0]}>]"
        assert len(str(result)) < 4000
    steered = replace(example_valve, warnings=(replace(example_valve.warnings[0], text="\x1b[31m\nred"),))
    assert "\x1b" not in str(steered) and str(steered).splitlines()[-1].endswith("red")


def test_a_notebook_shows_what_the_command_prints(example_valve, capsys):
    from dzdesign.terminal import brief, tables

    printed = []
    for print_valve in (brief.print_valve, tables.print_valve):
        print_valve(example_valve)
        printed.append(capsys.readouterr().out)
    heading = repr(example_valve).strip("<>")
    page = Page(example_valve._repr_html_())
    shown = f"{heading}{printed[0].replace(brief.MORE, '')}All of it{printed[1]}"
    assert "".join(page.text.split()) == re.sub(r"[\s\u2500]", "", shown)
    assert [tag for tag, _ in page.tags].count("table") >= 2
    assert str(example_valve).partition("\n")[2].split() == printed[1].split()


def test_what_a_notebook_shows_is_escaped(example_valve, example_compensator, example_firmware):
    side = example_valve.positive
    tests = (replace(side.tests[0], source=HOSTILE, ramps=(HOSTILE,)), *side.tests[1:])
    valve = replace(
        example_valve,
        sides={"positive": replace(side, tests=tests)},
        warnings=(replace(example_valve.warnings[0], text=HOSTILE, source=HOSTILE),),
    )
    files = {**example_firmware.files, HOSTILE: "int x;"}
    manifest = replace(example_firmware.manifest, target=HOSTILE, law=HOSTILE)
    firmware = replace(example_firmware, files=files, manifest=manifest)
    for result, count in ((valve, 3), (replace(example_compensator, costs=(HOSTILE,)), 1), (firmware, 3)):
        page = Page(result._repr_html_())
        assert {tag for tag, _ in page.tags} <= {"b", "caption", "details", "div", "summary", "table", "td", "th", "tr"}
        assert page.text.count(HOSTILE) >= count  # shown, as text


def test_importing_the_api_is_light():
    heavy = ("numpy", "scipy", "casadi", "sympy", "cvxpy", "matplotlib", "pint", "polars", "jinja2", "rich")
    code = f"import sys, dzdesign.api; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


#: What hangs on the machine's compilers: the object's hash, and which of them were tried.
OF_THE_MACHINE = ((r"object [0-9a-f]{64}", "object …"), (r"(-Werror): [\w, .+-]*", r"\1: …"))


def stored_outputs(cell):
    """Return the outputs of an executed cell as the notebook keeps them: the table where there is one, a row a line."""
    kept = []
    for output in cell.outputs:
        assert output.output_type == "execute_result", output
        shown = output.data.get("text/html")
        text = shown or output.data["text/plain"]
        for pattern, instead in OF_THE_MACHINE:
            text = re.sub(pattern, instead, text)
        lines = text.splitlines(keepends=True)
        data = {"text/html" if shown else "text/plain": lines}
        kept.append(
            {"data": data, "execution_count": cell.execution_count, "metadata": {}, "output_type": "execute_result"}
        )
    return kept


@pytest.mark.slow
@needs_compiler
def test_the_notebook_gives_what_it_shows(tmp_path, request):
    """Its outputs are stored; `pytest tests/dzdesign/test_api.py -k notebook --update-docs` stores them anew."""
    document = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    client = NotebookClient(notebook, timeout=300, record_timing=False, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    found = [stored_outputs(cell) for cell in notebook.cells if cell.cell_type == "code"]
    cells = [cell for cell in document["cells"] if cell["cell_type"] == "code"]
    if request.config.getoption("--update-docs"):
        for number, (cell, outputs) in enumerate(zip(cells, found, strict=True), start=1):
            cell.update(execution_count=number, outputs=outputs)
        NOTEBOOK.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    assert [cell["outputs"] for cell in cells] == found
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    shown = [Page("".join(each[-1]["data"]["text/html"])).text for each in found if "text/html" in each[-1]["data"]]
    assert len(shown) == 4 and "Every requirement holds" in shown[3]
    assert "27250688 inputs checked, 0 wrong" in shown[3] and "core/: dz_valve.h" in shown[2]


RIGHT = """\
from dzdesign import api
firmware = api.generate(api.design(api.identify("ramps/*.csv", dp0="1 MPa")), target="host")
holds: bool = api.verify(firmware).holds
holds = api.assess("a.csv", ["b.csv"], limits={"hysteresis": "5 %"}).holds
names: list[str] = list(api.simulate(dp="1 MPa").files)
text: str = api.init().text
page: str = api.report("evidence").html
failed: object = api.batch("lot", output="out", meter_lag="0.1 s").failed
"""
WRONG = """\
from dzdesign import api
holds: str = api.verify(api.design("valve.json")).holds
api.identify(meter_lag=0.1)
api.design("valve.json", transitoin="1 %")
"""


@pytest.mark.slow
def test_the_api_and_its_use_are_typed_strictly(tmp_path):
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text(WRONG)
    ours = ("api", "keywords", "stages.identify", "stages.design", "stages.verify", "core.options")
    modules = [option for name in ours for option in ("-m", f"dzdesign.{name}")]
    uses = [option for name in ("right", "wrong") for option in ("-m", name)]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *modules, *uses],
        cwd=ROOT, env={**os.environ, "MYPYPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    errors = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert all(Path(line.partition(":")[0]).name == "wrong.py" for line in errors), done.stdout
    # A bool is no str, a verification takes no compensator, the recordings are missing, a lag is text with its unit,
    # an option is mistyped.
    kinds = sorted(line.rsplit("[", 1)[1] for line in errors)
    assert kinds == ["arg-type]", "arg-type]", "assignment]", "call-arg]", "call-arg]"], done.stdout


def test_the_notebook_is_small_and_has_no_path_of_a_machine():
    document = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    text = json.dumps(document, ensure_ascii=False)  # as it stands in the file: a line of a table is one character wide
    assert len(text) < 40_000
    assert not re.search(r"/home|/tmp|/root|/usr|C:\\\\|\d{4}-\d\d-\d\d", text), "a path, or a date"
    assert "iopub" not in text and "version" not in document["metadata"]["language_info"]
