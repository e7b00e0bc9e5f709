"""`dzdesign reproduce`: the paper's numbers, that they are predicted and not copied, and that wrong ones are seen."""

import json
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from dzdesign.codegen.project import generate
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import sha256_of, write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import RequirementError
from dzdesign.derivation import law as laws
from dzdesign.derivation import symbols as s
from dzdesign.derivation.account.published import FIRST, RAMP_S, VALVES
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.identify.plots.frame import plot_style, saved
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.reproduction import Reproduction
from dzdesign.reproduce import chain, explanations, paper_figures, paper_numbers, recovered_valves, reproduction
from dzdesign.reproduce.recovered_valves import at_rest, recover_valves
from dzdesign.reproduce.valve_runs import DIRECT, PRODUCT, Drive, run_valve
from dzdesign.verify.closed_loop.dead_zone import FLOW_SHARE, dead_zone
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopRun, RampSequence
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]
FIGURES = {f"figure_{number:02}.svg" for number in (2, 3, 6, 7, 8, 16, 17, 18, 19, 23)}
PAPER = laws.law("paper")


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """The command as a user runs it: its folder, and the chains that it ran."""
    folder, chains, run_chain = tmp_path_factory.mktemp("reproduce") / "out", [], chain.run_chain

    def recorded(valve, say):
        chains.append(run_chain(valve, say=say))
        return chains[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproduction, "run_chain", recorded)
        assert main(["reproduce", "-o", str(folder)]) == 0
    return folder, chains


def again(reproduced, monkeypatch, folder, *arguments):
    """Run the command on the runs that are there, without its figures."""
    chains = {each.valve.valve: each for each in reproduced[1]}
    monkeypatch.setattr(reproduction, "run_chain", lambda valve, say: chains[valve.published.name])
    monkeypatch.setattr(reproduction, "figure_files", lambda runs: {})
    return main(["reproduce", "-o", str(folder / "again"), *arguments])


def test_every_valve_and_figure_is_there_with_its_origin(reproduced):
    folder, _ = reproduced
    document = json.loads((folder / "reproduction.json").read_text())
    assert document["holds"] is True
    assert {path.name for path in folder.glob("*.svg")} == FIGURES
    for valve, recovered in zip(document["valves"], recover_valves(), strict=True):
        place = folder / valve["valve"].replace(" ", "_")
        for name, key in (("valve.json", "valve_json"), ("compensator.json", "compensator_json")):
            assert sha256_of((place / name).read_bytes()) == valve["sha256"][key]
        assert read_plant(place / "plant.toml") == recovered.plant
        marked = {name for name, entry in valve["parameters"].items() if entry["recovered"]}
        assert marked == set(recovered.rounding)


def test_rounding_of_a_print_is_half_its_last_digit():
    assert [recovered_valves.half_digit(text) for text in ("15", "53.5", "0.95")] == pytest.approx([0.5, 0.05, 0.005])


def test_what_was_fitted_and_what_is_predicted_is_told_apart(reproduced):
    document = json.loads((reproduced[0] / "reproduction.json").read_text())
    fitted = sum(len(valve["fitted_to"]) for valve in document["valves"])
    assert sum(number["in_fit"] for number in document["numbers"]) == fitted == 14
    for number in document["numbers"]:
        assert number["why"] or number["holds"], f"{number['quantity']}: neither agrees nor says why not"
        assert (number["tolerance"] != "") == (number["holds"] is not None)


def test_the_document_fits_its_schema(reproduced):
    from tests.support.schema_checks import problems

    content = (reproduced[0] / "reproduction.json").read_bytes()
    assert to_json_bytes(read_artefact(content, Reproduction, "reproduction.json")) == content
    document = json.loads(content)
    assert problems("reproduction", document) == []
    del document["numbers"][0]["outcomes"][0]["by"]
    assert problems("reproduction", document) != []


def test_the_page_shows_what_is_printed(reproduced, monkeypatch, tmp_path, capsys):
    assert again(reproduced, monkeypatch, tmp_path) == 0
    printed = [line.strip() for line in capsys.readouterr().out.splitlines()]
    page = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")
    rows = [line.strip() for line in page.splitlines() if re.search(r" (yes|predicted)  +", line)]
    assert len(rows) > 10
    assert [row for row in rows if row not in printed] == []
    assert "39 numbers, of which 31 must agree: all do." in printed


def onset(run: LoopRun) -> float:
    """Command, per cent of full, at which flow begins: no meter between."""
    return 100 * dead_zone(run, FLOW_SHARE * float(run.q_mean_L_min.max()), rising=True)


def test_flow_begins_where_the_page_says(reproduced, tmp_path):
    """Behind the zero band, which the paper has not; as in the paper without it, and held above the tests."""
    command = RampSequence(ramp=float(RAMP_S)).command()
    for each in reproduced[1]:
        place = each.valve.valve.replace(" ", "_")
        band = json.loads(each.files[f"{place}/compensator.json"])["zero_band_codes"] / 4095
        assert 100 * band == pytest.approx(0.46, abs=0.005)
        content = each.files[f"{place}/valve.json"].encode()
        as_in_the_paper = DesignOptions(transition=Fraction(0), above="hold")
        bare = design(read_artefact(content, ValveModel, "valve.json"), as_in_the_paper, content)
        firmware = generate(bare, "host")
        folder = tmp_path / place
        write_folder(folder, firmware.files, firmware.manifest)
        loop = ClosedLoop(each.runs.valve.plant, folder, bare)
        for dp_MPa in (1.0, 5.0):
            assert onset(each.runs.ramps[Drive(PRODUCT), dp_MPa]) - 100 * band < 0.3
            assert onset(loop.run(command, dp_MPa, "compensated")) < 0.6


def test_same_valve_same_bytes(reproduced):
    first = chain.run_chain(recover_valves()[1])
    assert first.files == reproduced[1][1].files and first.valve == reproduced[1][1].valve


def test_a_number_that_must_agree_and_does_not_is_exit_status_one(reproduced, monkeypatch, tmp_path, capsys):
    """Seeded: 'about 0.95' read as 0.950 exactly."""
    monkeypatch.setattr(paper_numbers, "READING", {**explanations.READING, "about": 0.0})
    assert again(reproduced, monkeypatch, tmp_path) == 1
    out = capsys.readouterr().out
    assert "31 must agree: 2 DO NOT" in out and out.count("DOES NOT HOLD") == 2
    assert again(reproduced, monkeypatch, tmp_path, "--json") == 1
    assert json.loads(capsys.readouterr().out)["holds"] is False


def test_a_folder_of_somebody_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["reproduce", "-o", str(tmp_path)]) == 2
    assert main(["reproduce", "-o", ""]) == 2
    assert capsys.readouterr().out == "" and [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_figures_name_their_axes_with_units_and_are_the_same_bytes_again(reproduced):
    folder, chains = reproduced
    with plot_style():
        for number, figure in paper_figures._figures([each.runs for each in chains]):
            for axes in figure.axes:
                assert re.search(r"\((V|ms)\)$", axes.get_xlabel()), number
            assert re.search(r"\((L/min|mm)\)$", figure.axes[0].get_ylabel()), number
            legend = figure.legends[0].get_window_extent()
            assert legend.x0 >= 0 and legend.x1 <= figure.bbox.x1, f"Fig. {number}: the legend is cut off"
            assert saved(figure, "svg") == (folder / f"figure_{number:02}.svg").read_bytes()


# --- the fit -------------------------------------------------------------------------------------------------


def test_the_plant_at_rest_is_the_compiled_plant(reproduced):
    """The fit's closed form against the compiled motion with its PWM: another way to the same flow."""
    for each in reproduced[1]:
        for dp_MPa in (1.0, 5.0):
            rest, run = at_rest(each.runs.valve.plant, dp_MPa), each.runs.ramps[Drive(DIRECT), dp_MPa]
            at = [4000, 7000, 9500]  # 100 records a second
            expected = [max(float(rest.flow_per_volt) * (10 * run.command[k] - float(rest.opens_V)), 0) for k in at]
            assert run.q_mean_L_min[at] == pytest.approx(expected, abs=0.01)


def test_figures_that_no_valve_can_have_are_refused():
    impossible = replace(FIRST, flow1="60")  # more than the orifice passes at five times the pressure drop
    simulated = recover_valves()[0]
    free = tuple(name for name in recovered_valves.RECOVERED if name not in recovered_valves.FROM_DISPLACEMENT)
    with pytest.raises(RequirementError, match="first valve can't be recovered"):
        recovered_valves._recover(impossible, simulated.plant, free, 0.6)


def test_the_rounding_of_the_print_moves_a_parameter_as_far_as_is_said():
    simulated, first, _ = recover_valves()
    free = tuple(first.rounding)
    moved = recovered_valves._recover(replace(FIRST, dead_zone1_percent="51.74"), simulated.plant, free, 0.6)
    change = moved.plant.pressure_force_N_MPa - first.plant.pressure_force_N_MPa
    assert 0 < abs(change) <= first.rounding["pressure_force_N_MPa"]


# --- a deliberate error in derivation's law ------------------------------------------------------------------

WRONG = {
    "beta inverted": PAPER.output.subs(s.beta, 1 / s.beta),
    "beta turned about 1": PAPER.output.subs(s.beta, 2 - s.beta),
    "sign of k x_max": PAPER.output.subs(s.k, -s.k),
    "offset without beta": PAPER.output.subs(s.beta, 1),
    "offset subtracted": PAPER.output - 2 * s.beta * s.u_min0,
    "beta on all of Eq. (14)": s.beta * PAPER.output.subs(s.beta, 1),
    "gain of the bare valve": s.u_i + s.beta * s.u_min0,
}


def seed(monkeypatch, output) -> None:
    """Put a wrong law in the place of the paper's, past the checks that a law makes of itself."""
    with monkeypatch.context() as unchecked:
        unchecked.setattr(laws.Law, "_complaints", lambda law: ())
        wrong = replace(PAPER, output=output)
    monkeypatch.setattr("dzdesign.derivation.laws.paper.LAW", wrong)


@pytest.mark.parametrize("error", ["none", *WRONG])
def test_the_papers_numbers_catch_a_wrong_law(monkeypatch, error):
    if error != "none":
        seed(monkeypatch, WRONG[error])
    numbers = paper_numbers.paper_numbers([run_valve(valve, ClosedLoop(valve.plant)) for valve in recover_valves()])
    missed = [number.quantity for number in numbers if number.holds is False]
    assert bool(missed) == (error != "none"), missed


def test_the_closed_loop_catches_a_wrong_law_in_the_c(reproduced, monkeypatch, tmp_path):
    """The C follows the wrong law faithfully at every input; only the plant behind it shows that flow is missing."""
    from dzdesign.codegen.project import generate
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.design.designing import design
    from dzdesign.identify.valve.model import ValveModel

    second = recover_valves()[2]
    valve = read_artefact((reproduced[0] / "second_valve" / "valve.json").read_bytes(), ValveModel, "valve.json")
    seed(monkeypatch, WRONG["beta on all of Eq. (14)"])
    compensator = design(valve)
    firmware = generate(compensator, "host")
    write_folder(tmp_path / "firmware", firmware.files, firmware.manifest)
    assert check_all_inputs(tmp_path / "firmware").holds
    runs = run_valve(second, ClosedLoop(second.plant, tmp_path / "firmware", compensator), compensator)
    missed = {
        (number.quantity, number.dp_MPa, outcome.by)
        for number in paper_numbers.numbers_of_valve(runs)
        for outcome in number.outcomes
        if outcome.holds is False
    }
    assert ("largest flow with", 5.0, "product") in missed


def test_published_numbers_stand_in_one_place():
    """Whatever is printed as published is what `published.py` holds, and nothing else does."""
    printed = {value for valve in VALVES for name in valve.__slots__ if (value := getattr(valve, name))}
    sources = set(Path(paper_numbers.__file__).parent.glob("*.py"))
    sources -= {Path(paper_figures.__file__)}  # widths of lines
    assert len(sources) > 4
    for source in sources:
        text = source.read_text(encoding="utf-8")
        code = re.sub(r'"""[\s\S]*?"""|#.*', "", text)
        numbers = set(re.findall(r"(?<![\w.])\d+\.\d+(?![\w.])", code))
        assert numbers & {value for value in printed if "." in value} == set(), source
