"""Bad input through the command line: one line that says what and where, status 2, and no file touched."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from tests.support.synthetic import needs_compiler

HEADER = "time_s,u_V,dP_MPa,Q_Lmin"
#: What is told on stderr of the work under way, before it is found that it can't be done.
PROGRESS = ("dzdesign: fitting", "dzdesign: compiling", "dzdesign: comparing", "dzdesign: running")


def ramp(dp_MPa=1.0, knee=5.0, ramp_s=20, rate_Hz=25):
    """Return rows of time, command, pressure drop and flow: up and down over a dead zone of half the range."""
    up = np.linspace(0, 10, ramp_s * rate_Hz)
    u = np.concatenate([up, up[::-1]])
    edge = np.where(np.arange(u.size) < up.size, knee, knee - 0.1)
    noise = np.random.default_rng(round(1000 * dp_MPa)).standard_normal(u.size)
    q = np.clip(4 * np.sqrt(dp_MPa) * (u - edge), 0, None) + 0.02 * noise
    return np.column_stack([np.arange(u.size) / rate_Hz, u, np.full(u.size, dp_MPa), q])


def csv(rows, header=HEADER):
    return "\n".join([header, *(",".join(f"{value:.4f}" for value in row) for row in rows)]) + "\n"


def tree(folder):
    return {path: path.read_bytes() for path in sorted(Path(folder).rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A folder with two ramp tests and everything that is made of them."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "a.csv").write_text(csv(ramp(1.0)))
    (folder / "b.csv").write_text(csv(ramp(4.0, knee=4.8)))
    names = {name: str(folder / name) for name in ("a.csv", "b.csv", "valve.json", "compensator.json", "firmware")}
    assert main(["identify", names["a.csv"], names["b.csv"], "--curve", "line", "-o", names["valve.json"]]) == 0
    assert main(["design", names["valve.json"], "-o", names["compensator.json"]]) == 0
    assert main(["codegen", names["compensator.json"], "-o", names["firmware"]]) == 0
    return folder


@pytest.fixture
def bench(good, tmp_path, monkeypatch, capsys):
    """A copy of the good folder, as the working folder."""
    folder = tmp_path / "bench"
    shutil.copytree(good, folder)
    monkeypatch.chdir(folder)
    capsys.readouterr()
    return folder


def short(text):
    """Return the beginning of a text, on one line: the name of a case."""
    line = " ".join(text.split())
    return line if len(line) <= 50 else f"{line[:50]}... ({len(text)} characters)"


@pytest.fixture
def refusal(bench, capsys):
    """Run a command that must refuse, and return its one line; nothing may have been written or lost."""

    def refusal(*argv):
        before = tree(bench)
        assert main([str(word) for word in argv]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        *progress, line = err.splitlines()
        assert all(told.startswith(PROGRESS) for told in progress)
        assert line.startswith("dzdesign: ") and err.endswith("\n")
        assert tree(bench) == before
        return line

    return refusal


# one table of what a command refuses, and of the words that name the fault and its place


def of_columns(*columns, header=HEADER, scale=1):
    """Return a recording in which some columns of the ramp are left, scaled."""
    return csv((ramp() * scale)[:, columns], header).encode()


ALL = (0, 1, 2, 3)
FIRMWARE = "dzdesign.firmware/1"
BAD_RAMP, WITH_OPTIONS = "identify a.csv bad.csv", "design valve.json --config options.toml"
#: Files that are written into the bench before, the command, and what its one line says.
REFUSED = {
    # ramp tests: how a file is read is in tests/identify/reading/test_refusals.py
    "no header": ({"bad.csv": csv(ramp()).partition("\n")[2]}, BAD_RAMP, "'bad.csv' has no header row"),
    "no text": ({"bad.csv": csv(ramp()).encode("utf-16-le")}, BAD_RAMP, "'bad.csv' is not a text file"),
    "no flow": ({"bad.csv": of_columns(*ALL, scale=[1, 1, 1, 0])}, BAD_RAMP, "does not show the valve opening"),
    "no command": ({"bad.csv": of_columns(*ALL, scale=[1, 0, 1, 1])}, BAD_RAMP,
                   "'bad.csv' holds no ramp of the command"),
    "swapped ports": ({"bad.csv": of_columns(*ALL, scale=[1, 1, -1, 1])}, BAD_RAMP, "swap pA and pB"),
    "above full command": ({"bad.csv": of_columns(*ALL, scale=[1, 1.2, 1, 1])}, BAD_RAMP, "give --u-max"),
    "mPa": ({"bad.csv": of_columns(*ALL, header="time_s,u_V,dP_mPa,Q_Lmin")}, BAD_RAMP,
            "correct the unit in the header"),
    "500 MPa": ({"bad.csv": of_columns(*ALL, scale=[1, 1, 500, 1])}, BAD_RAMP, "the pressure drop is 500 MPa"),
    "levels of 2 V": (
        {"bad.csv": csv(np.column_stack([ramp()[:, 0], 2 * np.round(ramp()[:, 1] / 2), ramp(2.0)[:, 2:]]))},
        BAD_RAMP, "at 1 levels of",
    ),
    "19 rows": ({"bad.csv": csv(ramp()[:19])}, BAD_RAMP, "has 19 complete rows, expected at least 20"),
    "no pressure of one": ({"c.csv": of_columns(0, 1, 3, header="time_s,u_V,Q_Lmin")}, "identify a.csv c.csv",
                           "'c.csv' has no column of dP"),
    "a copy": ({"again.csv": csv(ramp(1.0))}, "identify a.csv again.csv",
               "'again.csv' is an exact copy of the recording 'a.csv'; give it once"),
    "no file": ({}, "identify a.csv nowhere.csv", "ramp file 'nowhere.csv' does not exist"),
    "a folder": ({}, "identify a.csv firmware", "'firmware' is a folder"),
    "no match": ({}, "identify a.csv *.mat", "no file matches '*.mat'"),
    "below a file": ({}, "identify a.csv a.csv/b", "a.csv/b' does not"),
    "a name that steers the terminal": ({}, ["identify", "two\nlines\x1b2J.csv"],
                                        "ramp file 'two lines 2J.csv' does not exist"),
    "options in UTF-16": ({"options.toml": "u-max = '10 V'".encode("utf-16")}, "identify a.csv --config options.toml",
                          "'options.toml' is not TOML"),
    # where plots can't go
    **{f"plots in {place!r}": ({}, ["identify", "a.csv", "-o", "new.json", "--plots", place], words)
       for place, words in (
        ("a.csv", "'a.csv' is a file, expected a folder"), ("a.csv/plots", "a.csv' is a file, expected a folder"),
        ("", "--plots is empty"), ("new.json", "where -o puts a file"), ("new.json/plots", "where -o puts a file"),
        ("no\0name", "can't be written"),
    )},
    # artefacts: what is no JSON is in tests/core/test_artefact_types.py
    "no JSON": ({"bad.json": ""}, "design bad.json -o new", "'bad.json' is not JSON"),
    "another version": ({"bad.json": '{"schema": "dzdesign.valve/9"}'}, "design bad.json -o new",
                        "'bad.json' has the schema 'dzdesign.valve/9'"),
    "a compensator for a valve": ({}, "design compensator.json",
                                  "has the schema 'dzdesign.compensator/1', expected dzdesign.valve/1"),
    "a valve for a compensator": ({}, "codegen valve.json -o new", "which `dzdesign design` writes"),
    "firmware for a compensator": ({}, "codegen firmware/manifest.json -o new", f"has the schema '{FIRMWARE}'"),
    "C for a compensator": ({}, "codegen firmware/core/dz_comp.c -o new", "is not JSON"),
    "no plant": ({}, "verify firmware --plant nowhere.toml", "plant file 'nowhere.toml' does not exist"),
    "firmware of no schema": ({"firmware/manifest.json": "{}"}, "verify firmware",
                              f"has the schema 'None', expected {FIRMWARE}"),
    "firmware of no JSON": ({"firmware/manifest.json": "no JSON"}, "verify firmware", "is not JSON"),
    "firmware without a tool": ({"firmware/manifest.json": f'{{"schema": "{FIRMWARE}"}}'}, "verify firmware",
                                "lacks the key 'tool'"),
    "firmware with a list of files": ({"firmware/manifest.json": f'{{"schema": "{FIRMWARE}", "files": []}}'},
                                      "verify firmware", "'files' is [], expected object"),
    "firmware of no compensator": ({"firmware/compensator.json": '{"schema": "dzdesign.compensator/1"}'},
                                   "verify firmware", "lacks the key"),
    "firmware without its compensator": ({"firmware/compensator.json": None}, "verify firmware",
                                         "compensator.json' does not exist"),
    # tables of options
    "an option of the machine above": ({"options.toml": 'oil = "0.2 %"'}, WITH_OPTIONS, "oil"),
    "no option of the machine": ({"options.toml": '[machine]\nguard = "mean"'}, WITH_OPTIONS, "guard"),
    "a near miss of the machine": ({"options.toml": '[machine]\ncoil-temperatur = "20 degC"'},
                                   WITH_OPTIONS, "coil-temperature"),
    "no table of the machine": ({"options.toml": 'machine = "1 %"'}, WITH_OPTIONS, "machine"),
    "a table in the machine": ({"options.toml": "[machine]\noil = {}"}, WITH_OPTIONS, "oil"),
    "twice in the machine": ({"options.toml": '[machine]\nbench-coil = "20 degC"\nbench_coil = "20 degC"'},
                             WITH_OPTIONS, "twice"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_in_one_line(refusal, bench, name):
    files, command, words = REFUSED[name]
    for place, content in files.items():
        (bench / place).unlink(missing_ok=True)
        if content is not None:
            (bench / place).write_bytes(content if isinstance(content, bytes) else content.encode())
    line = refusal(*(command.split() if isinstance(command, str) else command))
    assert words in line and all(Path(place).name in line for place in files)


def test_a_recording_that_was_saved_again_is_no_repetition(refusal, bench, wording):
    """In another encoding, with other line ends, without comments and with fewer decimals, it has the same samples."""
    lines = [line for line in (bench / "a.csv").read_text().splitlines() if not line.startswith("#")]
    rows = [",".join(f"{float(cell):.3f}" for cell in line.split(",")) for line in lines[1:]]
    (bench / "again.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join([lines[0], *rows, ""]).encode())
    wording("bad recordings: a copy that was saved again", refusal("identify", "a.csv", "again.csv"))


def test_a_valve_without_pressure_is_not_designed_for(refusal, bench, capsys):
    (bench / "c.csv").write_text(csv(ramp()[:, [0, 1, 3]], "time_s,u_V,Q_Lmin"))
    assert main(["identify", "c.csv", "-o", "c.json"]) == 0
    capsys.readouterr()
    assert "record the ramp test again with a column of dP" in refusal("design", "c.json")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps its file names in Unicode")
def test_a_file_name_in_another_encoding(bench, capsys):
    name = b"Ventil_\xfc.csv".decode("utf-8", "surrogateescape")
    shutil.copy("a.csv", name)
    assert main(["identify", name, "-o", "umlaut.json"]) == 0
    assert json.loads(Path("umlaut.json").read_text())["made_from"][0]["source"] == "Ventil_?.csv"


# the command line and its file of options


@pytest.mark.parametrize(
    "argv",
    [
        "",
        "identfy a.csv",
        "identify",
        "identify a.csv --meter-flor 1",
        "identify a.csv --dp0",
        "identify a.csv --dp0 1",
        "identify a.csv --dp0 1V",
        "identify a.csv --dp0 1mpa",
        "identify a.csv --dp0 one_MPa",
        "identify a.csv --dp0 0MPa",
        "identify a.csv b.csv --dp0 2MPa",
        "identify a.csv --u-max 5V",
        "identify a.csv --u-max 0V",
        "identify a.csv --u-max 1e999V",
        "identify a.csv --x-max 1.8",
        "identify a.csv --meter-lag=-1s",
        "identify a.csv --meter-floor 1%",
        "identify a.csv --meter-floor 1000L/min",
        *(f"identify a.csv --repeatability={text}" for text in ("0.1", "-1%", "12%", "nan%", "1e-3%", "5mV")),
        "identify a.csv --confidence 1",
        "identify a.csv --confidence 0.4",
        "identify a.csv --confidence nan",
        "identify a.csv --confidence high",
        "identify a.csv --knee-window 50-12",
        "identify a.csv --knee-window 12",
        "identify a.csv --knee-window a-b",
        "identify a.csv --knee-window 12-500",
        "identify a.csv --knee-window 99-100",
        "design valve.json --law papr",
        "design valve.json --pressure-span 2MPa",
        "design valve.json --pressure-span 0MPa",
        "design nowhere.json",
        "codegen nowhere.json",
        "codegen compensator.json --target f28334",
        "derive --format htm",
        *(f"simulate --dp 1MPa --repeats {number}" for number in ("0", "101", "two")),
        *(f"simulate --dp 1MPa --repeatability {share}" for share in ("0.1", "11%")),
        "simulate --seed nan",
        "simulate --seed=-1",
        "simulate --ramp-time 0s",
        "simulate --dp 1MPa --dp 10bar",
        "verify nowhere",
        "verify a.csv",
        "identify a.csv --config nowhere.toml",
    ],
)
def test_a_bad_command_line(refusal, argv, wording):
    wording(f"bad command line: {argv or 'none'}", refusal(*argv.split()).replace("\\", "/"))


@pytest.mark.parametrize(
    "text",
    [
        "meter-flor = '1 L/min'",
        "meter_flor = '1 L/min'",
        "u-max: 10 V",
        "u-max = ",
        "a = " + "[" * 5000,
        "seed = " + "9" * 5000,
        "u-max = 10",
        "meter_lag = 0.1",
        "dp0 = 'one'",
        "u-max = '10 bar'",
        "knee-window = '12'",
        "confidence = 'high'",
        "u-max = ['10 V']",
        "u-max = true",
        "u-max = {V = 10}",
        "u-max = 1979-05-27",
        "dp = []",
        "dp = [['1 MPa']]",
        "u-max = '10 V'\nu_max = '9 V'",
        "confidence = nan",
        "valve = 'valve.json'",
        "run = 'other'",
        "output = ''",
        'output = "a\\u0000b"',
    ],
)
def test_a_bad_file_of_options(refusal, bench, text, wording):
    (bench / "options.toml").write_text(text)
    wording(f"bad options file: {short(text)}", refusal("identify", "a.csv", "b.csv", "--config", "options.toml"))


def test_what_the_command_line_says_is_not_blamed_on_the_file(refusal, bench):
    (bench / "options.toml").write_text("u-max = '10 V'\nmeter-lag = '0.1 s'\n")
    said = refusal("identify", "a.csv", "--config", "options.toml", "--u-max", "9")
    assert said.endswith("--u-max is '9' without a unit; write for example '9 V'") and "options.toml" not in said


def test_an_example_for_a_part_of_a_value_is_none_for_the_whole():
    from dzdesign.command_line.invocation import in_words_of_the_file

    values = {"ramp_up": "0.5 s / 0.8", "ramp": "1"}
    said = in_words_of_the_file("--ramp-up is '0.8' without a unit; write for example '0.8 s'", "dz.toml", values)
    assert said == "'dz.toml': ramp-up is '0.8' without a unit; write for example '0.8 s'"
    assert in_words_of_the_file("'a.csv' has no column of u", "dz.toml", values) == "'a.csv' has no column of u"


MACHINE_TABLE = """pressure-span = "25 MPa"

[machine]
coil-temperature = "-20..80 degC"
supply = "18..32 V"
"""


def test_the_machine_has_a_table_of_its_own(bench):
    from dzdesign.command_line.invocation import parse

    (bench / "options.toml").write_text(MACHINE_TABLE)
    arguments = parse(["design", "valve.json", "--config", "options.toml", "--supply", "20..30 V"]).arguments
    assert (arguments.coil_temperature, arguments.supply) == ("-20..80 degC", "20..30 V")
    assert arguments.pressure_span == "25 MPa"


def test_options_from_a_file_stand_in_for_the_defaults(bench, capsys):
    (bench / "options.toml").write_text(
        "\ufeffu-max = '20 V'\nconfidence = 0.9\ndp = ['2 MPa']\ntarget = 'f28335'\n", "utf-8"
    )
    assert main(["identify", "a.csv", "-o", "new.json", "--config", "options.toml", "--confidence", "0.8"]) == 0
    valve = json.loads(Path("new.json").read_text())
    assert valve["u_max_V"] == 20 and valve["sides"]["positive"]["certificate"]["confidence"] == 0.8


@pytest.mark.parametrize(
    ("text", "argv", "expected"),
    [
        ("dp = '2 MPa'", [], ["2 MPa"]),
        ("dp = ['2 MPa', '3 MPa']", [], ["2 MPa", "3 MPa"]),
        ("dp = ['2 MPa', '3 MPa']", ["--dp", "1 MPa"], ["1 MPa"]),
        ("seed = 3", [], ()),
    ],
)
def test_an_option_given_several_times_replaces_the_file(bench, text, argv, expected):
    from dzdesign.command_line.invocation import parse

    (bench / "options.toml").write_text(text)
    assert parse(["simulate", *argv, "--config", "options.toml"]).arguments.dp == expected


# artefacts


def altered(document, path, change):
    """Return a copy in which the value at `path` is replaced by `change`, or gone if that is None."""
    document = json.loads(json.dumps(document))
    *way, last = path
    place = document
    for key in way:
        place = place[key]
    if change is None:
        del place[last]
    else:
        place[last] = change
    return document


SIDE = ("sides", "positive")
VALVES = [
    (("u_max_V",), None),
    (("u_max_V",), "10"),
    (("u_max_V",), True),
    (("u_max_V",), 0),
    (("sides",), []),
    ((*SIDE, "tests"), []),
    ((*SIDE, "tests", 0), None),
    ((*SIDE, "tests", 1, "dp_MPa"), "4"),
    ((*SIDE, "tests", 1, "u_guard_lower_V"), None),
    ((*SIDE, "tests", 1, "u_knee_rising_V"), "x"),
    ((*SIDE, "reference", "u_min_V"), "5"),
    ((*SIDE, "reference", "u_min_V"), -5),
    ((*SIDE, "k_x_max_over_u_max"), 10**40),
    ((*SIDE, "trend"), "downhill"),
    ((*SIDE, "beta", "beta", 0), 1e308),
    ((*SIDE, "beta", "dp_MPa"), [4, 1]),
    ((*SIDE, "certified", "closing", "offset_V"), []),
    ((*SIDE, "certified", "closing", "offset_V", 0), 9),
    ((*SIDE, "certified", "closing", "premise"), "parabola"),
    ((*SIDE, "certified", "closing", "curvature_V_MPa2"), -0.1),
    ((*SIDE, "certified", "closing", "curvature_is"), "guessed"),
    ((*SIDE, "identified"), {}),
    ((*SIDE, "identified", "closing", "beta_se", 0), -1),
    ((*SIDE, "identified", "closing", "u_V"), [5]),
    ((*SIDE, "k_x_max_over_u_max_se"), -1),
    ((*SIDE, "certificate", "confidence"), "high"),
    ((*SIDE, "certified"), []),
    ((*SIDE, "certified", "mean"), 5),
    ((*SIDE, "certified", "mean", "offset_V"), None),
    ((*SIDE, "certified", "mean", "u_lower_V", 1), "5"),
    ((*SIDE, "certified", "opening", "u_min0_V"), 0),
    ((*SIDE, "certified", "opening", "dp_MPa"), [4, 1]),
    ((*SIDE, "certified", "opening", "dp_MPa"), [1, 3]),
    ((*SIDE, "certified", "opening", "u_threshold_V"), [5]),
    ((*SIDE, "certified", "opening", "offset_dp_MPa"), [1, 3]),
    ((*SIDE, "certified", "opening", "u_lower_V", 0), 9),
    ((*SIDE, "certified", "closing", "u_min0_V"), 4),
    ((*SIDE, "certificate", "guard"), "shut"),
    ((*SIDE, "tests", 1, "ramps"), None),
    ((*SIDE, "tests", 1, "ramps"), []),
    ((*SIDE, "tests", 1, "ramps"), "a.csv"),
    ((*SIDE, "opening_curve"), []),
    ((*SIDE, "opening_curve", "u_V"), None),
    ((*SIDE, "opening_curve", "u_V", 0), None),
    ((*SIDE, "opening_curve", "u_V"), [1, 1]),
    ((*SIDE, "opening_curve", "u_V"), [8, 9]),
    ((*SIDE, "opening_curve", "dp_MPa"), [1, 3]),
    (("warnings",), ["none"]),
    (("made_from",), {}),
]
POSITIVE = ("sides", "positive")
COMPENSATORS = [
    (("signals",), None, "lacks the key 'signals'"),
    (("valve",), None, "lacks the key 'valve'"),
    (("valve", "u_max_V"), None, "lacks the key 'valve.u_max_V'"),
    (("made_from",), [], "'made_from' has 0 files, expected valve.json alone"),
    (("law",), "papr", "unknown law 'papr' (did you mean 'paper'?)"),
    (("u_max_V",), [10, 0], "'u_max_V' is [10, 0], expected [numerator, denominator]: whole numbers"),
    (("u_max_V",), [10], "'u_max_V' is [10], expected [numerator, denominator]"),
    (("u_max_V",), 10.0, "'u_max_V' is 10.0, expected [numerator, denominator]"),
    (("u_max_V",), [-10, 1], "'u_max_V' is -10, not that of its valve"),
    ((*POSITIVE, "drive_range_over_u_max", 0), 10**70, "'sides.positive.drive_range_over_u_max' is [1000"),
    ((*POSITIVE, "drive_range_over_u_max", 0), -1, "k x_max/u_max must be positive"),
    ((*POSITIVE, "drive_range_over_u_max", 1), -(2**16), "the denominator above zero"),
    ((*POSITIVE, "u_min0_over_u_max"), [3, 2], "u_min0 is 1.500 of u_max, expected between 0 and 1"),
    ((*POSITIVE, "beta"), [1, 2], "the transition's beta must have as many nodes"),
    ((*POSITIVE, "beta", 3), 0, "'sides.positive.beta[3]' is 0"),
    ((*POSITIVE, "beta", 3), 1.5, "'sides.positive.beta[3]' is 1.5, expected int"),
    ((*POSITIVE, "transition_beta"), [1, 2], "the transition's beta must have as many nodes"),
    (("transition_codes",), 0, "a transition needs the opening threshold's beta"),
    (("beta_denominator",), 3, "beta_denominator is 3, expected a power of two"),
    (("beta_step_codes",), 0, "'beta_step_codes' is 0"),
    (("below_dp0",), "held", "'below_dp0' is 'held'"),
    (("reverse_codes",), -1, "'reverse_codes' is -1"),
    (("reverse_codes",), "40", "'reverse_codes' is '40'"),
    (("signals", "compare_max"), 10**9, "'signals.compare_max' is 1000000000, expected int <= 65535"),
    (("signals", "compare_max"), 1000, "the compare limit is 60000, above full drive, 1000"),
    (("signals", "pressure_a", "span_MPa"), [0, 1], "the sensor's span is 0 MPa"),
    (("signals", "pressure_b", "zero_code"), 4095, "a pressure sensor has codes 4095 to 3822"),
    (("signals", "command", "full_code"), 0, "zero and full command have the same code, 0"),
    (("signals", "command", "negative_full_code"), 9, "expected the other side of zero"),
    (("signals", "command", "valid_codes"), [0, 9], "full_code is 4095, outside the valid codes 0 to 9"),
    (("drive_functions", "dither_ticks"), 0, "'drive_functions.dither_ticks' is 0"),
    ((*POSITIVE, "certificate", "dp_MPa"), [[1, 1]], "dp_MPa' is [[1, 1]], expected array of length 2"),
]


@pytest.mark.parametrize(("path", "change"), VALVES)
def test_a_valve_whose_value_does_not_fit(refusal, bench, path, change, wording):
    document = json.loads((bench / "valve.json").read_text())
    (bench / "bad.json").write_text(json.dumps(altered(document, path, change)))
    place = ".".join(map(str, path))
    change = "gone" if change is None else short(str(change))
    wording(f"bad valve.json: {place} {change}", refusal("design", "bad.json", "-o", "new.json"))


@pytest.mark.slow
@pytest.mark.parametrize(("path", "change", "words"), COMPENSATORS)
def test_a_compensator_whose_value_does_not_fit(refusal, bench, path, change, words):
    document = json.loads((bench / "compensator.json").read_text())
    (bench / "bad.json").write_text(json.dumps(altered(document, path, change)))
    assert words in refusal("codegen", "bad.json", "-o", "new")


# where the output goes


@pytest.mark.parametrize(
    "argv",
    [
        "identify a.csv -o firmware",
        "identify a.csv -o a.csv/valve.json",
        "identify a.csv -o nowhere/valve.json",
        "identify a.csv -o a.csv",
        "identify -o b.csv a.csv",
        "design valve.json -o valve.json",
        "derive -o nowhere/equations.txt",
        "codegen compensator.json -o a.csv",
        "codegen compensator.json -o a.csv/firmware",
        "codegen compensator.json -o .",
        "verify firmware -o .",
        "verify firmware -o firmware",
        "simulate -o a.csv/ramps",
        "simulate -o .",
        "demo a.csv",
        "demo a.csv/demo",
    ],
)
def test_an_output_that_cannot_be_written(refusal, argv, wording):
    wording(f"bad output: {argv}", refusal(*argv.split()))


def test_a_changed_firmware_is_not_overwritten_and_an_added_file_stays(refusal, bench, capsys):
    (bench / "firmware" / "core" / "notes.txt").write_text("mine")
    assert main(["codegen", "compensator.json", "-o", "firmware", "--target", "f28335"]) == 0
    assert (bench / "firmware" / "core" / "notes.txt").read_text() == "mine"
    capsys.readouterr()
    core = bench / "firmware" / "core" / "dz_comp.c"
    core.write_text(core.read_text() + "/* tuned on the bench */\n")
    line = refusal("codegen", "compensator.json", "-o", "firmware")
    assert "dz_comp.c' was changed since dzdesign wrote it and would be lost" in line


def test_a_full_disk_leaves_the_old_output(refusal, monkeypatch):
    import os

    def full(*_):
        raise OSError(28, "No space left on device")

    for name in ("fsync", "replace"):
        with monkeypatch.context() as patched:
            patched.setattr(os, name, full)
            assert "No space left on device" in refusal("identify", "a.csv", "-o", "valve.json")
    monkeypatch.setattr(os, "replace", full)
    assert "No space left on device" in refusal("codegen", "compensator.json", "-o", "firmware")


# verify


def test_no_compiler_says_what_to_do(refusal, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)  # no ziglang either
    said = refusal("verify", "firmware")
    assert "no C compiler was found (tried $CC, cc, gcc, clang, zig); install one" in said
    assert "pip install ziglang" in said


@pytest.mark.parametrize(
    "text",
    [
        "K_q = 60.0",
        "K_a = -1",
        "K_a = nan",
        "K_a = 0",
        "K_a = 'big'",
        "preload_N = '27.6 N'",
        "K_a = true",
        "K_a = " + "9" * 400,
        "K_a = " + "9" * 5000,
        "K_a = " + "[" * 5000,
        "K_a: 4",
        "stroke_mm = 0.1",
        "m_e_kg = 1e-9",
    ],
)
def test_a_bad_plant(refusal, bench, text, wording):
    (bench / "plant.toml").write_text(text)
    wording(f"bad plant: {short(text)}", refusal("verify", "firmware", "--plant", "plant.toml"))


@pytest.mark.slow
@needs_compiler
def test_a_plant_that_stays_shut_is_no_evidence(bench, capsys):
    """The spring holds it shut: no flow at zero command means nothing."""
    (bench / "plant.toml").write_text("preload_N = 1e6")
    assert main(["verify", "firmware", "--plant", "plant.toml"]) == 1
    assert "DOES NOT HOLD  the plant of the closed loop opens" in capsys.readouterr().out


# the installed program


def program(*argv, cwd):
    """Run the installed script, or the module where there is none."""
    script = Path(sys.executable).with_name("dzdesign")
    module = [sys.executable, "-c", "import dzdesign.command_line.cli as c; exit(c.main())"]
    command = [str(script)] if script.exists() else module
    return subprocess.run([*command, *argv], cwd=cwd, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("argv", "line"),
    [
        (
            ("identify", "nowhere.csv"),
            "dzdesign: ramp file 'nowhere.csv' does not exist; check the name and the folder\n",
        ),
        (("codegen", "compensator.json", "-o", "a.csv"), "' is a file, expected a folder to write into; "),
    ],
)
def test_the_installed_program(bench, argv, line):
    before = tree(bench)
    done = program(*argv, cwd=bench)
    assert done.returncode == 2 and done.stdout == ""
    assert line in done.stderr and done.stderr.count("\n") == 1
    assert tree(bench) == before
