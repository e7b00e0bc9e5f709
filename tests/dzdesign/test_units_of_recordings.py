"""What a person is shown is in the units of the recordings, from `identify` to the report; files and keys are not."""

import io
import json
import re
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest
from bench_loggers import command_text
from corpus_units import BOTH_WAYS, bench, ramp

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.identify.identification import identify_sides
from dzdesign.identify.plots.style import plot_style
from dzdesign.identify.plots.valve_plots import draw_figures
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.reading.scaling import units_of
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import Chain
from dzdesign.report.figure import figure_style
from dzdesign.report.sections.quantities import characteristic_curves, characteristic_quantities
from dzdesign.report.sections.valve import conditions_section, thresholds_section
from dzdesign.report.summary import key_figures
from tests.support.synthetic import needs_compiler

#: A number in the units in which all is computed; a range or an example is quoted.
COMPUTED = re.compile(r"\d\s?(mV|V|MPa|L/min)\b")
COLUMNS = "u=set (mA):4..20 mA = 0..10 V"
BIPOLAR = "u=set (mA):4..20 mA = -10..10 V"
LAG = ("--meter-lag", "0 s +- 0.02 s")
#: What two tested pressure drops need.
LINE = ("--curve", "line")
#: The bench's truth on opening and closing, in mA of 4..20 mA = 0..10 V.
OPENS, CLOSES = 4 + 1.6 * 4.66, 4 + 1.6 * 4.54


def write_ramp(
    folder, name, dp, seed, command=None, scale=lambda u: 4 + 1.6 * u, label="set (mA)", gain=1.0, **options
):
    rows = bench(command or ramp(20.0), edge=dp, seed=seed, **options)
    rows["Q"] = gain * rows["Q"]
    path = folder / name
    path.write_text(command_text(rows, label, scale(rows["u"]), flow="gpm"), encoding="utf-8")
    return str(path)


def run(*words) -> tuple[int, str]:
    """Return what a command prints, with all details but the log; its messages where it fails."""
    out, log = io.StringIO(), io.StringIO()
    detailed = ["-v"] if words[0] in ("identify", "design", "verify") else []
    with redirect_stdout(out), redirect_stderr(log if detailed else out):
        status = main([*detailed, *(str(word) for word in words)])
    return status, out.getvalue() if status == 0 else out.getvalue() + log.getvalue()


def numbers_as_computed(text):
    """Return numbers in V, MPa or L/min in lines that are about the recordings.

    The controller's own command is in V: `--command-signal` declares it, and the bench's signal says nothing of it.
    """
    plain = re.sub(r"'[^']*'|\"[^\"]*\"|\([^()]*\.\.[^()]*\)", "", text)
    plain = re.sub(r"ADC code \d+ is zero, \d+ is 10 V|% of command, [\d.]+ V|\| (0|10) V(?= \||, 100)", "", plain)
    return [found[0] for found in COMPUTED.finditer(plain)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recordings")


@pytest.fixture(scope="module")
def ramps(folder):
    return [write_ramp(folder, f"r{dp:g}_{n}.csv", dp, seed=n + int(10 * dp)) for dp in (1.0, 4.0) for n in (1, 2)]


@pytest.fixture(scope="module")
def printed(folder, ramps):
    status, text = run("identify", *ramps, "--columns", COLUMNS, *LAG, *LINE, "-o", folder / "valve.json")
    assert status == 0, text
    return text


@pytest.fixture(scope="module")
def valve(folder, printed):
    return read_artefact((folder / "valve.json").read_bytes(), ValveModel, "valve.json")


def test_the_files_stay_in_volts_and_say_what_is_shown(folder, printed):
    document = json.loads((folder / "valve.json").read_text(encoding="utf-8"))
    test = document["sides"]["positive"]["tests"][0]
    assert abs(test["u_knee_rising_V"] - 4.66) < 0.02 and abs(test["dp_MPa"] - 1) < 0.02 and test["q_max_L_min"] > 12
    command = document["recorded_units"]["command"]
    assert (command["unit"], command["at_zero"], command["factor"]) == ("mA", 4.0, 1.6)
    assert document["recorded_units"]["pressure"] == {"unit": "bar", "factor": 10.0}
    assert document["recorded_units"]["flow"]["factor"] == pytest.approx(1 / 3.785411784, rel=1e-11)


def test_identify_and_design_print_no_other_unit(folder, printed, ramps):
    pages = {
        "identify": printed,
        "design": run("design", folder / "valve.json", "-o", folder / "compensator.json")[1],
    }
    for words in (["identify", *ramps, "--columns", COLUMNS, *LAG, *LINE], ["design", str(folder / "valve.json")]):
        with redirect_stdout(out := io.StringIO()):
            assert main([*words, "-o", str(folder / f"brief_{words[0]}.json")]) == 0
        assert not numbers_as_computed(out.getvalue()) and "bar" in out.getvalue()
    for name, text in pages.items():
        assert not numbers_as_computed(text), name
        assert "bar" in text and "mA" in text and "gpm" in text, name
    row = next(line for line in printed.splitlines() if line.lstrip().startswith("r1_")).split()
    assert float(row[-7]) == pytest.approx(OPENS, abs=0.03) and float(row[-6]) == pytest.approx(CLOSES, abs=0.03)
    offsets = re.findall(r"^ +[\d.]+ +(1\d\.\d+) .*\d$", pages["design"], re.MULTILINE)
    assert "offset (mA)" in pages["design"] and len(offsets) == 2
    assert all(4 < float(offset) < CLOSES for offset in offsets)


def test_the_premise_and_what_cannot_be_seen_too(folder, ramps):
    every = [write_ramp(folder, f"p{dp:g}.csv", dp, seed=int(10 * dp)) for dp in (1.0, 2.0, 3.0, 4.0)]
    words = ["identify", *every, "--columns", COLUMNS, *LAG, "--meter-floor", "0.1 gpm", "-o", folder / "smooth.json"]
    status, text = run(*words, "--curve", "smooth", "--curvature", "10 mV/MPa^2")
    assert status == 0 and re.search(r"M = 0\.00016\d* mA/bar² \(declared", text), text
    found = read_artefact((folder / "smooth.json").read_bytes(), ValveModel, "smooth.json")
    reasons = found.positive.tests[0].not_observable.values()
    assert "below 0.100 gpm" in " ".join(reasons) and not any(map(numbers_as_computed, reasons))


def test_the_firmware_speaks_in_them(folder):
    """Comments of the C, and the README's table of signals: volts there are those at the pin alone."""
    ramps = [
        write_ramp(folder, f"percent_{dp:g}.csv", dp, int(10 * dp), scale=lambda u: 10 * u, label="set (%)")
        for dp in (1.0, 4.0)
    ]
    words = ["identify", *ramps, "--columns", "u=set (%)", *LAG, *LINE, "-o", folder / "percent.json"]
    status, text = run(*words)
    assert status == 0 and not numbers_as_computed(text), text
    compensator = folder / "for_firmware.json"
    options = ["--hysteresis", "play", "--pressure-b", "0..3 V = 25 MPa", "--output-max", "90 %"]
    assert run("design", folder / "percent.json", *options, "-o", compensator)[0] == 0
    assert run("codegen", compensator, "-o", folder / "spoken_firmware")[0] == 0
    for path in (folder / "spoken_firmware" / "core").iterdir():
        assert not numbers_as_computed(path.read_text(encoding="utf-8")), path.name
    header = (folder / "spoken_firmware" / "core" / "dz_valve.h").read_text(encoding="utf-8")
    assert "full command being 100 %" in header and " bar (the converter's code" in header
    readme = (folder / "spoken_firmware" / "f28335" / "README.md").read_text(encoding="utf-8")
    assert "| command u_i, 0 % to 100 % |" in readme and "| pressure A, 0 bar to 200 bar |" in readme
    assert "| 50 %, 50 %" not in readme and "MPa" not in readme


@pytest.mark.slow
@needs_compiler
def test_verify_speaks_of_what_was_recorded(folder, printed):
    compensator, firmware = folder / "for_verify.json", folder / "firmware"
    assert run("design", folder / "valve.json", "--target", "host", "-o", compensator)[0] == 0
    assert run("codegen", compensator, "--target", "host", "-o", firmware)[0] == 0
    status, text = run("verify", firmware, "-o", folder / "evidence")
    assert status == 0 and not numbers_as_computed(text), (status, numbers_as_computed(text))
    for unit in ("dP (bar)", "(gpm)", " mA", "10.0 bar", "pressure readings stuck at 10.0 bar"):
        assert unit in text, unit
    page = (folder / "evidence" / "report.html").read_text(encoding="utf-8")
    assert "requirements that were checked hold" in page
    # Options stand as they were given, or in the unit of their default.
    unshown = r"<style>.*?</style>|href=\"[^\"]*\"|<li>Options of \w+: .*?</li>"
    shown = re.sub(unshown, "", page, flags=re.DOTALL)
    texts = " | ".join(re.findall(r">([^<>]+)<", shown))
    assert not numbers_as_computed(texts), numbers_as_computed(texts)
    assert not re.search(r"\((mV|V|MPa|L/min)\)", texts)


def test_warnings_carry_the_units_in_the_file_too(valve):
    texts = {warning.code: warning.text for warning in valve.warnings}
    assert "mA" in texts["few-repeats"] and not any(numbers_as_computed(text) for text in texts.values())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"gain": 0.0}, r"to \d+\.\d+ mA the flow rises by \d\.\d+ gpm"),
        ({"gain": -1.0}, r"by \d\.\d+ gpm from zero to \d+\.\d\d mA"),
        ({"scale": lambda u: 4 + 0.05 * u}, r"runs from \d\.\d+ to 4\.\d+ mA"),
        ({"dp": 1e-7}, r"the pressure drop is \S+ bar, expected \S+ to \S+ bar"),
    ],
)
def test_refusals_speak_of_what_was_recorded(options, said, tmp_path):
    dp = options.pop("dp", 1.0)
    path = write_ramp(tmp_path, "bad.csv", dp, 5, **options)
    status, text = run("identify", path, "--columns", COLUMNS, "-o", tmp_path / "valve.json")
    assert status == 2 and re.search(said, text), text
    assert not numbers_as_computed(text)


def test_u_max_is_said_in_the_unit_of_the_command(tmp_path):
    path = write_ramp(tmp_path, "high.csv", 1.0, 6)
    status, text = run("identify", path, "--columns", COLUMNS, "--u-max", "5 V", "-o", tmp_path / "valve.json")
    assert status == 2 and re.search(r"reaches 20\.\d\d mA, above u_max = 12 mA", text), text


def test_plots_are_drawn_in_the_units_of_the_recordings(folder, ramps):
    found = identify_sides([read_ramp_file(path, columns={"u": COLUMNS[2:]}) for path in map(Path, ramps)])
    with plot_style():
        figures = dict(draw_figures(found))
    flow, thresholds = figures["flow_1_MPa"], figures["thresholds"]
    edge = next(axes for axes in flow.axes if axes.get_title("left") == "the edge, enlarged")
    assert (edge.get_xlabel(), edge.get_ylabel()[-5:]) == ("command u (mA)", "(gpm)")
    assert edge.get_xlim()[0] < CLOSES < OPENS < edge.get_xlim()[1]
    whole = next(axes for axes in flow.axes if axes.get_title("left") == "whole range")
    assert whole.get_xlim() == pytest.approx((4, 20), abs=0.05) and 3 < whole.get_ylim()[1] < 6
    axes = thresholds.axes[0]
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("command u (mA)", "pressure drop dP (bar)")
    assert axes.get_xlim()[0] < 10 < 40 < axes.get_xlim()[1] and axes.get_ylim()[0] < CLOSES < axes.get_ylim()[1]
    assert not any(numbers_as_computed(figure.get_suptitle()) for figure in figures.values())


def test_the_report_leads_with_them(valve):
    with figure_style():
        section = thresholds_section(valve, None, None)
    table = section.tables[0]
    columns = dict(zip(table.columns, table.rows[0], strict=True))
    assert float(columns["knee opening (mA)"].text) == pytest.approx(OPENS, abs=0.03)
    assert float(columns["dP (bar)"].text) == pytest.approx(10, abs=0.2)
    assert float(columns["slope (gpm/mA)"].text) == pytest.approx(3.5 / 3.785 / 1.6, rel=0.05)
    figures = [figure for figure in section.figures if figure]
    for figure in figures:
        assert not numbers_as_computed(figure.description + figure.caption), figure.name
    assert ">pressure drop dP (bar)<" in figures[0].svg and "(mA)<" in figures[0].svg
    assert "knee_opening_V" in figures[0].csv.splitlines()[0]  # a file is in V
    assert not numbers_as_computed(" ".join(conditions_section(valve, None).lines))
    found = characteristic_quantities(valve, None, (), characteristic_curves(valve, None, {}))
    assert not any(numbers_as_computed(f"{each.value} {each.note}") for each in key_figures(Chain(valve=valve), found))


def test_assess_prints_them(folder, ramps, tmp_path):
    after = [write_ramp(tmp_path, f"after_{n}.csv", 1.0, seed=40 + n) for n in (1, 2)]
    limits = "flow_at_zero = 0.001 L/min"
    output = tmp_path / "assessment.json"
    words = ["assess", *ramps[:2], "--after", *after, "--columns", COLUMNS, *LAG, "--limits", limits, "-o", output]
    status, text = run("-v", *words)
    assert status in (0, 1) and output.exists(), text
    assert not numbers_as_computed(text) and "10.0 bar" in text and "gpm/mA" in text
    document = json.loads(output.read_text(encoding="utf-8"))
    assert document["pressures"][0]["quantities"]["largest_flow"]["before"]["value"] > 12  # L/min
    assert document["recorded_units"]["flow"]["unit"] == "gpm"


def test_a_declared_pressure_drop_is_shown_as_it_was_declared(tmp_path):
    path = write_ramp(tmp_path, "no_dp.csv", 2.0, 7)
    lines = [",".join(line.split(",")[:2] + line.split(",")[3:]) for line in Path(path).read_text().splitlines()]
    Path(path).write_text("\n".join(lines), encoding="utf-8")
    status, text = run("identify", path, "--columns", COLUMNS, "--dp", "290 psi", "-o", tmp_path / "valve.json")
    assert status == 0 and "dP (psi)" in text and re.search(r"\s290\.0\s", text), text


def test_a_side_whose_reading_falls_counts_outwards(tmp_path):
    def scale(u):
        return 12 + 0.8 * u

    path = write_ramp(tmp_path, "both.csv", 1.0, 8, command=BOTH_WAYS, scale=scale, positive=False)
    status, text = run("identify", path, "--columns", BIPOLAR, *LAG, "-o", tmp_path / "valve.json")
    assert status == 0 and "12 mA being zero" in text and "count from zero command outwards" in text
    valve = read_artefact((tmp_path / "valve.json").read_bytes(), ValveModel, "valve.json")
    negative = next(part for part in text.split("Thresholds")[2:] if "negative side" in part)
    row = next(line for line in negative.splitlines() if "both.csv" in line).split()
    assert float(row[-7]) == pytest.approx(12 - 0.8 * 3.26, abs=0.02)
    table = thresholds_section(valve, None, None).tables[1]
    assert float(table.rows[0][1].text) == pytest.approx(12 - 0.8 * 3.26, abs=0.02)
    signal, made = ["--command-signal", "-10..10 V x 0.12 + 1.5 V"], tmp_path / "compensator.json"
    text = run("design", tmp_path / "valve.json", *signal, "-o", made)[1]
    # The bench's 4..20 mA are not what the controller reads.
    assert "ADC code 2048 is zero, 3686 is 10 V, 409 is -10 V" in text
    assert run("codegen", made, "--target", "f28335", "-o", tmp_path / "firmware")[0] == 0
    assert "command u_i, -10 V to +10 V" in (tmp_path / "firmware/f28335/README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("header", "shown"),
    [
        ("time_s,u_V,dP_MPa,Q_Lmin", ("V", "MPa", "L/min")),
        ("t [ms],u [mV],dP [N/mm2],Q [l/min]", ("mV", "MPa", "L/min")),
        ("time_s,u (%),dP (barg),Q (lpm)", ("%", "bar", "L/min")),
        ("time_s,u_V,dP_psid,Q_m3s", ("V", "psi", "m3/s")),
        ("time_s,u_V,dP_kPa,Q_gpm", ("V", "kPa", "gpm")),
        ("time_s,u_V,pA_bar,pB_bar,Q_Lmin", ("V", "bar", "L/min")),
        ("time_s,u_V,pA_bar,pB_psi,Q_Lmin", ("V", "MPa", "L/min")),
        ("time_s,u_V,Q_Lmin", ("V", "MPa", "L/min")),
    ],
)
def test_units_are_those_of_the_columns(header, shown, tmp_path):
    path = tmp_path / "ramp.csv"
    rows = [",".join(str(1e-3 * (row + place)) for place in range(header.count(",") + 1)) for row in range(1, 60)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    units = units_of([read_ramp_file(path)])
    assert (units.command.unit, units.pressure.unit, units.flow.unit) == shown


def test_a_mixture_is_shown_in_what_the_file_holds(tmp_path):
    bar, psi = (tmp_path / f"{unit}.csv" for unit in ("bar", "psi"))
    for path in (bar, psi):
        rows = "\n".join(f"{row},{0.1 * row},{1 + row},{row}" for row in range(40))
        path.write_text(f"time_s,u_V,dP_{path.stem},Q_gpm\n{rows}\n", encoding="utf-8")
    tests = [read_ramp_file(path) for path in (bar, psi)]
    assert units_of(tests) == units_of(tests[::-1])
    assert (units_of(tests).pressure.unit, units_of(tests).flow.unit) == ("MPa", "gpm")
    assert units_of(tests).differ == ("pressure",)
