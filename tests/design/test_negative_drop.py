"""Which pressure input is ahead at negative commands: as recorded, as declared, or as no wiring gives it."""

from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.design.pressure_inputs import wiring_in_words
from dzdesign.identify.valve.model import ValveModel
from dzdesign.identify.valve.recorded_drop import DropColumns, RecordedDrop
from tests.support.golden_firmware import FULL

BOTH_SIGNS = "-10..10 V x 0.15 + 1.5 V"
AHEAD_LABELS = {"dP": "dP (bar)", "pP": "Druck P", "pA": "Druck A | links", "pB": "Druck B", "pT": "Druck T"}


def drop(*quantities, sign=1):
    columns = DropColumns(quantities=quantities, labels=tuple(AHEAD_LABELS[each] for each in quantities))
    return RecordedDrop(columns=(columns,), sign=sign)


AB, DP = ("pA", "pB"), ("dP",)


@pytest.fixture(scope="module")
def valve():
    return read_artefact((FULL / "valve.json").read_bytes(), ValveModel, "valve.json")


def designed(valve, positive, negative, choice="", **texts):
    drops = {"positive": positive, "negative": negative}
    sides = {name: replace(side, recorded_drop=drops[name]) for name, side in valve.sides.items()}
    given = {"command_signal": BOTH_SIGNS, "negative_dp": choice} | texts
    return design(replace(valve, sides=sides), options_of(given, target_named("f28335").inputs()))


@pytest.mark.parametrize(
    ("positive", "negative", "choice", "swapped"),
    [
        (drop(*AB), drop(*AB), "", False),
        (drop(*AB), drop(*AB, sign=-1), "", True),
        (drop(*AB), drop(*AB, sign=-1), "swapped", True),
        (drop(*DP), drop(*DP, sign=-1), "", True),
        # A dP above zero on both sides may be a magnitude, and a declared one has no sign at all.
        (drop(*DP), drop(*DP), "", False),
        (drop(*DP), drop(*DP), "swapped", True),
        (None, None, "", False),
        (None, None, "swapped", True),
        (drop("pP", "pA"), drop("pP", "pB"), "wired", False),
        (drop(*AB), drop(*AB, sign=-1), "wired", False),
    ],
)
def test_the_direction_is_the_recorded_one_unless_it_is_declared(valve, positive, negative, choice, swapped):
    assert designed(valve, positive, negative, choice).signals.swapped is swapped


@pytest.mark.parametrize(
    ("negative", "choice"), [(drop(*AB, sign=-1), "same"), (drop(*AB), "swapped")], ids=["same", "swapped"]
)
def test_a_declared_direction_that_the_recordings_contradict_is_refused(valve, negative, choice, wording):
    with wording.refusal(InputError):
        designed(valve, drop(*AB), negative, choice)


@pytest.mark.parametrize("choice", ["", "same", "swapped"])
@pytest.mark.parametrize(
    ("positive", "negative"),
    [
        (drop("pP", "pA"), drop("pP", "pB")),
        (drop("pB", "pT"), drop("pA", "pT")),
        (drop("pP", "pA"), drop("pA", "pT")),
        (drop("pB", "pT"), drop("pP", "pB")),
    ],
)
def test_drops_that_no_two_inputs_give_are_refused(valve, positive, negative, choice, wording):
    with pytest.raises(InputError) as refused:
        designed(valve, positive, negative, choice)
    if positive.columns[0].quantities[0] == negative.columns[0].quantities[0] == "pP":
        wording("negative drop: three sensors", str(refused.value))
    assert "--negative-dp wired" in str(refused.value)


def test_one_side_alone_needs_no_direction(valve):
    made = designed(valve, drop("pP", "pA"), drop("pP", "pB"), command_signal="0..10 V x 0.3")
    (line,) = wiring_in_words(made)
    assert line == "pressure inputs: A = Druck P, B = Druck A | links, as recorded at positive commands"


@pytest.mark.parametrize("target", ["f28335", "cortex-m4"])
def test_the_wiring_table_names_the_recorded_columns(valve, target):
    made = designed(valve, drop(*AB), drop(*AB, sign=-1))
    (readme,) = (text for name, text in generate(made, target).files.items() if name.endswith("/README.md"))
    assert "| pressure A = Druck A \\| links, 0 MPa" in readme and "| pressure B = Druck B, 0 MPa" in readme
    assert "Negative commands: the pressure drop is B minus A, as recorded (Druck B - Druck A \\| links)." in readme


@pytest.mark.parametrize(
    ("positive", "negative", "choice"),
    [
        (drop(*AB), drop(*AB, sign=-1), ""),
        (drop(*DP), drop(*DP), ""),
        (drop("pP", "pA"), drop("pP", "pB"), "wired"),
    ],
    ids=["recorded", "assumed", "wired"],
)
def test_what_the_direction_rests_on_is_said(valve, positive, negative, choice, wording, request):
    made = designed(valve, positive, negative, choice)
    wording(f"negative drop: {request.node.callspec.id}", "\n".join(wiring_in_words(made)))
