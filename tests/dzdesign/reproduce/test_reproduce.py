"""`dzdesign reproduce`: nothing agrees that was fitted, nothing is missed without a reason that reaches so far."""

import copy
import json
import re
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from pathlib import Path
from types import SimpleNamespace

import pytest

from dzdesign.codegen.project import generate
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.derivation.account.published import RAMP_S, SIMULATION, VALVES
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.identify.plots.frame import saved
from dzdesign.identify.plots.style import plot_style
from dzdesign.identify.valve.model import ValveModel
from dzdesign.reproduce import figures, numbers, recovered_valves, runs
from dzdesign.reproduce.artefact import Reproduction
from dzdesign.reproduce.explanations import Reason
from dzdesign.reproduce.recovered_valves import recover_valves
from dzdesign.reproduce.runs import DIRECT, PRODUCT, WITHOUT_BETA
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, dead_zone
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]
NUMBERS = ("06", "07", "16", "17", "18", "19", "23")
#: Of the figures, the first, drawn a second time.
REDRAWN = 3
FIGURES = {f"figure_{number}.svg" for number in NUMBERS}


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """The command as a user runs it: its folder, the chains that it ran, and the figures that it drew."""
    folder, chains, run_chain = tmp_path_factory.mktemp("reproduce") / "out", [], runs.run_chain
    drawn, save = [], figures.saved

    def kept(figure, form):
        drawn.append(figure)
        # To write all of them as SVG takes as long as two valves; `make bench-paper` does, twice.
        return save(figure, form) if len(drawn) <= REDRAWN else b"<svg/>"

    def recorded(valve, say):
        chains.append(run_chain(valve, say=say))
        return chains[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "run_chain", recorded)
        patch.setattr(figures, "saved", kept)
        assert main(["reproduce", "-o", str(folder)]) == 0
    return folder, chains, dict(zip(NUMBERS, drawn, strict=True))


def again(chains, monkeypatch, folder, *arguments):
    """Run the command on runs that are there, without its figures."""
    known = {each.valve.valve: each for each in chains}
    monkeypatch.setattr(runs, "run_chain", lambda valve, say: known[valve.published.name])
    monkeypatch.setattr(figures, "figure_files", lambda valves: {})
    return main(["reproduce", "-o", str(folder / "again"), *arguments])


def document_of(reproduced):
    return json.loads((reproduced[0] / "reproduction.json").read_text())


def test_every_valve_and_figure_is_there_with_its_origin(reproduced):
    folder, *_ = reproduced
    document = document_of(reproduced)
    assert document["holds"] is True
    assert {path.name for path in folder.glob("*.svg")} == FIGURES
    for valve, recovered in zip(document["valves"], recover_valves(), strict=True):
        place = folder / valve["valve"].replace(" ", "_")
        for name, key in (("valve.json", "valve_json"), ("compensator.json", "compensator_json")):
            assert sha256_of((place / name).read_bytes()) == valve["sha256"][key]
        assert read_plant(place / "plant.toml") == recovered.plant
        marked = {name for name, entry in valve["parameters"].items() if entry.get("rounding")}
        assert marked == set(recovered.rounding)


def test_the_valves_are_tested_at_the_papers_pressure_drops_only(reproduced):
    """Seeded once: a test at 1.1 MPa, which the paper has not, made all rows agree."""
    assert runs.TESTED_MPA == (1.0, 5.0)
    for valve in document_of(reproduced)["valves"]:
        assert set(valve["sha256"]["ramp_tests"]) == {"ramp_dP1.csv", "ramp_dP5.csv"}


def test_rounding_of_a_print_is_half_its_last_digit():
    assert [recovered_valves.half_digit(text) for text in ("15", "53.5", "0.95")] == pytest.approx([0.5, 0.05, 0.005])


# --- agreement, and reasons ----------------------------------------------------------------------------------


def test_only_what_is_predicted_agrees_and_every_miss_has_its_reason(reproduced):
    numbers = document_of(reproduced)["numbers"]
    for number in numbers:
        where = f"{number['valve']}: {number['quantity']} at {number['dp_MPa']}"
        assert number["tolerance"], where
        if number["agrees"] is False:
            low, high = number["explained"]
            assert number["reason"] and low <= number["value"] <= high, where
        if number["kind"] == "fitted":  # where the valve was recovered, the closed loop shows it
            assert number["agrees"], where
    kinds = [number["kind"] for number in numbers]
    assert [kinds.count(kind) for kind in ("fitted", "predicted")] == [13, 26]


#: What the paper and the bench say of their errors: the meter, 0.5 % of 150 L/min; 100 records a second of 100 s.
ERROR = {"L/min": 0.75, "%": 0.01, "V": 0.001, "mm": 0.0, "1/1000": 0.1}


def test_no_range_is_wider_than_the_printed_digits_and_a_stated_error(reproduced):
    """By another way than the rows': from what is printed and the unit alone."""
    compared = 0
    for number in document_of(reproduced)["numbers"]:
        simulated = number["valve"] == "simulation"
        low, high = number["allowed"]
        error = 0.0 if simulated and number["unit"] == "L/min" else ERROR[number["unit"]]
        if number["published"] == "none":
            assert low == 0 and high <= (0.005 if simulated else error)
        elif "-" in number["published"]:
            bottom, top = map(float, number["published"].split("-"))
            assert low >= bottom - error - 1e-9 and high <= top + error + 1e-9
        else:
            middle = float(number["published"])
            half = 0.5 * 10.0 ** -len(number["published"].partition(".")[2]) + error
            assert middle - half - 1e-9 <= low < middle < high <= middle + half + 1e-9, number["quantity"]
        compared += 1
    assert compared == 39


def test_a_miss_for_no_reason_is_exit_status_one(reproduced, monkeypatch, tmp_path, capsys):
    """Seeded: reasons are forgotten."""
    row = numbers.row
    monkeypatch.setattr(numbers, "row", lambda *given, reason=None, **more: row(*given, **more))
    assert again(reproduced[1], monkeypatch, tmp_path) == 1
    out = capsys.readouterr().out
    assert "18 MISSED FOR NO REASON" in out and " ".join(out.split()).count("NOBODY KNOWS WHY") == 18
    assert again(reproduced[1], monkeypatch, tmp_path, "--json") == 1
    assert json.loads(capsys.readouterr().out)["holds"] is False


def tampered(chains, place, drive, scale, *, at_MPa=5.0):
    """The chains with one valve's flow scaled, under one driver at one pressure drop."""
    ours = list(chains)
    ramps = dict(ours[place].runs.ramps)
    run = ramps[drive, at_MPa]
    ramps[drive, at_MPa] = replace(run, q_mean_L_min=run.q_mean_L_min * scale)
    ours[place] = replace(ours[place], runs=replace(ours[place].runs, ramps=ramps))
    return ours


@pytest.mark.parametrize(
    ("place", "drive", "scale", "at_MPa", "quantity"),
    [
        (0, PRODUCT, 0.99, 5.0, "largest flow with"),
        (1, DIRECT, 0.9, 1.0, "largest flow without"),
        (1, PRODUCT, 0.9, 5.0, "largest flow with"),  # misses as it is; the reason does not reach so far
        (1, PRODUCT, 1.1, 5.0, "largest flow with"),
        (1, PRODUCT, 0.2, 1.0, "dead zone with"),
        (2, PRODUCT, 0.3, 5.0, "dead zone with"),
        # Those were explained as well, by reasons that reached from zero to what is printed, or to the meter's error.
        (1, PRODUCT, 0.98, 5.0, "largest flow with"),
        (1, DIRECT, 0.98, 5.0, "largest flow, about"),
        (1, PRODUCT, 0.9, 1.0, "dead zone with"),
    ],
)
def test_a_reason_explains_no_more_than_it_says(
    reproduced, monkeypatch, tmp_path, capsys, place, drive, scale, at_MPa, quantity
):
    """Seeded: flows that are off by 1 to 80 %."""
    chains = tampered(reproduced[1], place, drive, scale, at_MPa=at_MPa)
    assert again(chains, monkeypatch, tmp_path, "--json") == 1
    unexplained = {
        (number["quantity"], number["dp_MPa"])
        for number in json.loads(capsys.readouterr().out)["numbers"]
        if number["holds"] is False
    }
    assert (quantity, at_MPa) in unexplained


def test_a_flow_at_zero_command_is_not_explained(reproduced, monkeypatch, tmp_path, capsys):
    """Seeded: the product opens the valve at zero command, with beta and without."""
    ours = list(reproduced[1])
    ramps = dict(ours[1].runs.ramps)
    for drive in (PRODUCT, WITHOUT_BETA):
        ramps[drive, 5.0] = replace(ramps[drive, 5.0], q_largest_L_min=ramps[drive, 5.0].q_largest_L_min + 0.78)
    ours[1] = replace(ours[1], runs=replace(ours[1].runs, ramps=ramps))
    assert again(ours, monkeypatch, tmp_path, "--json") == 1
    wrong = {each["quantity"] for each in json.loads(capsys.readouterr().out)["numbers"] if each["holds"] is False}
    assert wrong == {"zero command without beta", "zero command with beta"}


def a_number(kind, published, value, allowed, reason=None):
    """A number of the first valve, as `row` makes it."""
    runs = SimpleNamespace(valve=recover_valves()[1])
    more = {"allowed": allowed, "tolerance": "digits", "reason": reason}
    return numbers.row(runs, 3.0, "", "", published, kind, "valve", value, **more)


def test_a_miss_holds_as_far_as_its_reason_reaches():
    outside = a_number("predicted", "53.9", 54.1, (53.8, 54.0))
    assert outside.agrees is False and outside.holds is False
    reasoned = a_number("predicted", "53.9", 54.1, (53.8, 54.0), Reason("because", (54.0, 54.2)))
    assert reasoned.holds and not replace(reasoned, value=54.3).holds and not reasoned.agrees


# --- what is written and printed -----------------------------------------------------------------------------


def test_the_document_fits_its_schema(reproduced):
    from tests.support.schema_checks import problems

    content = (reproduced[0] / "reproduction.json").read_bytes()
    assert to_json_bytes(read_artefact(content, Reproduction, "reproduction.json")) == content
    document = json.loads(content)
    assert problems("reproduction", document) == []
    spoilt = copy.deepcopy(document)
    del spoilt["numbers"][0]["by"]
    assert problems("reproduction", spoilt) != []


def test_the_page_shows_what_is_printed(reproduced, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("COLUMNS", "100")
    assert again(reproduced[1], monkeypatch, tmp_path) == 0
    printed = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    page = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")
    lines = [" ".join(line.split()) for line in page.splitlines() if line.startswith("    ")]
    shown = [line for line in lines if "dzdesign reproduce" not in line and line]
    assert len(shown) > 20
    assert [line for line in shown if line not in printed] == []


def test_the_readme_shows_what_is_found(reproduced):
    found = {(each["valve"], each["dp_MPa"], each["quantity"]): each for each in document_of(reproduced)["numbers"]}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in readme.splitlines() if re.match(r"\| .*valve, \d MPa", line)]
    for name, uncompensated, paper, product, ideal in rows:
        valve, pressure = name.split(", ")
        place = valve, float(pressure[0])
        without, with_law = (found[(*place, f"dead zone {kind}")] for kind in ("without", "with"))
        assert (uncompensated, paper) == (f"{without['published']} %", f"{with_law['published']} %")
        assert (product, ideal) == (f"{with_law['value']:.1f} %", f"{with_law['ideal_line']:.1f} %")
        largest = float(found[(*place, "largest flow without")]["published"])
        assert with_law["ideal_line"] == pytest.approx(100 * 0.6 / largest, abs=1e-4)
    assert len(rows) == 3
    zero = found["first valve", 5.0, "zero command without beta"]
    assert (zero["published"], zero["value"]) == ("1.6", 0.0)


def onset(run: LoopRun) -> float:
    """Command, per cent of full, at which flow begins: no meter between."""
    return 100 * dead_zone(run, FLOW_SHARE * float(run.q_mean_L_min.max()), rising=True)


def test_flow_begins_where_the_page_says(reproduced, tmp_path):
    """Behind the zero band, which the paper has not; without it and the transition at what two tests allow."""
    command = RampSequence(ramp=float(RAMP_S)).command()
    for each in reproduced[1]:
        place = each.valve.valve.replace(" ", "_")
        band = json.loads(each.files[f"{place}/compensator.json"])["zero_band_codes"] / 4095
        assert 100 * band == pytest.approx(0.46, abs=0.005)
        content = each.files[f"{place}/valve.json"].encode()
        as_in_the_paper = DesignOptions(transition=Fraction(0), above="hold")
        bare = design(read_artefact(content, ValveModel, "valve.json"), as_in_the_paper)
        firmware = generate(bare, "host")
        folder = tmp_path / place
        write_folder(folder, firmware.files, firmware.manifest)
        loop = ClosedLoop(each.runs.valve.plant, folder, bare)
        for dp_MPa, behind, without in ((1.0, 0.7, 4.0), (5.0, 0.3, 0.6)):
            assert onset(each.runs.ramps[PRODUCT, dp_MPa]) - 100 * band < behind
            assert onset(loop.run(command, dp_MPa, PRODUCT)) < without


def test_same_valve_same_bytes(reproduced):
    first = runs.run_chain(recover_valves()[1])
    assert first.files == reproduced[1][1].files and first.valve == reproduced[1][1].valve


def test_a_folder_of_somebody_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["reproduce", "-o", str(tmp_path)]) == 2
    assert main(["reproduce", "-o", ""]) == 2
    assert capsys.readouterr().out == "" and [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_figures_name_their_axes_with_units_and_are_the_same_bytes_again(reproduced):
    folder, chains, drawn = reproduced
    with plot_style():
        for number, figure in drawn.items():
            for axes in figure.axes:
                assert re.search(r"\((V|ms)\)$", axes.get_xlabel()), number
            assert re.search(r"\((L/min|mm|V)\)$", figure.axes[0].get_ylabel()), number
            legend = figure.legends[0].get_window_extent()
            assert legend.x0 >= 0 and legend.x1 <= figure.bbox.x1, f"Fig. {number}: the legend is cut off"
        for number, figure in islice(figures.figures([each.runs for each in chains]), REDRAWN):
            assert saved(figure, "svg") == (folder / f"figure_{number}.svg").read_bytes()


def test_published_numbers_stand_in_one_place():
    """Whatever is printed as published is what `published.py` holds, and nothing else does."""
    printed = {value for valve in VALVES for name in valve.__slots__ if (value := getattr(valve, name))}
    # What is printed as a change of 0.1 mm is used as what it makes; a tenth may be anything.
    printed = printed - {SIMULATION.stroke_falls_mm} | {SIMULATION.stroke1_mm}
    sources = set(Path(numbers.__file__).parent.glob("*.py"))
    sources = {source for source in sources if "figure" not in source.name}  # widths of lines
    assert len(sources) > 4
    for source in sources:
        text = source.read_text(encoding="utf-8")
        code = re.sub(r'"""[\s\S]*?"""|#.*', "", text)
        found = set(re.findall(r"(?<![\w.])\d+\.\d+(?![\w.])", code))
        assert found & {value for value in printed if "." in value} == set(), source
