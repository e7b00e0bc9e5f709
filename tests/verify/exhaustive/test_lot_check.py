"""A lot setting against every valve of its lot: in exact arithmetic by design, and the C's integers by verify."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.lot_setting import lot_setting, prove_lot
from dzdesign.design.lot_valves import Lacking, LotSide, common_interval, lacking_in, without_narrow
from dzdesign.design.options import options_of
from dzdesign.design.redesign import prove_derived
from dzdesign.identify.identification import identify
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs, check_lot, lot_checked
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import guarded_bounds, zero_command_margins
from dzdesign.verify.folder import read_compensator
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

KNEES = {"a": lambda dp: 5.6 - 0.05 * dp, "b": lambda dp: 5.2 + 0.03 * dp, "c": lambda dp: 5.4, "d": lambda dp: 5.5}
PRESSURES = {"d": (2.0,)}
#: Files that say nothing of what they are of in their first lines.
UNMARKED = ("compensator.json", ".gitattributes")


def four_valves(**texts):
    """Return designs of four valves: thresholds that fall, rise and stay, and one of a single test."""
    found = {}
    for seed, (name, knee) in enumerate(KNEES.items()):
        places = PRESSURES.get(name, (1.0, 2.5, 5.0))
        ramps = [synthetic_ramp(dp, Truth(knee_rising=knee(dp)), seed=seed, rate_Hz=10.0) for dp in places]
        found[name] = design(identify(ramps), options_of(texts, target_named("host").inputs()))
    assert [each.valve.positive.trend for each in found.values()] == ["decreasing", "increasing", "flat", None]
    return found


@pytest.fixture(scope="module")
def batch():
    return four_valves()


@pytest.fixture(scope="module")
def common(batch):
    return lot_setting(batch)


def with_bound(compensator, name, place, change):
    """Return a lot setting in whose lot one bound of one valve is another."""
    lot = []
    for valve in compensator.lot:
        if valve.name == name:
            bounds = list(valve.positive.u_lower_V)
            bounds[place] += change
            valve = replace(valve, positive=replace(valve.positive, u_lower_V=tuple(bounds)))
        lot.append(valve)
    return replace(compensator, lot=tuple(lot))


def slow_margin(compensator, each):
    """Return a valve's margin by its own curve, code by code."""
    signals, curve = compensator.signals, guarded_curve(each.valve.positive, "closing", "hold")
    low, high = signals.pair(1).difference_error(signals.code_max)
    kept = Fraction(1, 2 * signals.compare_max)
    margins, between = [], [end for piece in curve.certified.pieces for end in (piece.from_MPa, piece.to_MPa)]
    for code in range(signals.pair(1).largest_difference + 1):
        # The nodes of the bound stand for themselves where they lie between two codes.
        ends = [dp for dp in between if signals.pair(1).dp_MPa(code + low) <= dp <= signals.pair(1).dp_MPa(code + high)]
        places = [*(signals.pair(1).dp_MPa(code + error) for error in range(low, high + 1)), *ends]
        bounds = [bound for bound in map(curve.bound, places) if bound is not None]
        drive = (compensator.beta(code) * compensator.positive.u_min0_over_u_max + kept) * compensator.u_max_V
        margins += [min(bounds) - drive] if bounds else []
    return min(margins)


@pytest.mark.slow
def test_the_margin_of_each_valve_is_that_of_its_own_curve(batch, common):
    found = {each.name: each.margin_V for each in common.margins}
    assert set(found) == set(batch) and min(found.values()) >= 0
    assert found == {name: slow_margin(common.compensator, each) for name, each in batch.items()}
    assert common.worst.margin_V == min(found.values()) and float(common.worst.margin_V) < 1e-3


@pytest.mark.parametrize("name", KNEES)
def test_a_valve_whose_bound_is_lower_makes_it_fail_and_is_named(common, name, wording):
    """Every valve counts, also those that hold nothing down: with all of its bounds lower than the offset."""
    low = common.compensator
    for place in range(len(low.lot[[*KNEES].index(name)].positive.u_lower_V)):
        low = with_bound(low, name, place, -2.0)
    with wording.refusal(RequirementError):
        prove_lot(low)
    with wording.refusal(InputError):
        prove_derived(low)


# ---- the file ----


@pytest.fixture(scope="module")
def document(common):
    return json.loads(to_json_bytes(common.compensator))


def read(document):
    return read_artefact(to_json(document).encode(), Compensator, "compensator.json")


def test_the_file_holds_every_valve(document, common, batch):
    assert read(document).lot == common.compensator.lot
    assert [each["name"] for each in document["lot"]] == [*batch]
    assert [each["valve_sha256"] for each in document["lot"]] == [each.valve_json_sha256 for each in batch.values()]
    prove_derived(read(document))


def test_a_bound_that_somebody_raised_is_refused(document, wording):
    lot = json.loads(json.dumps(document["lot"]))
    lot[2]["positive"]["u_lower_V"][0] += 0.1
    with wording.refusal(InputError):
        read({**document, "lot": lot})


@pytest.mark.parametrize(
    "change",
    [
        lambda lot: lot[:1],
        lambda lot: [lot[0], *lot[:3]],
        lambda lot: [replace(lot[0], positive=replace(lot[0].positive, dp_MPa=lot[0].positive.dp_MPa[::-1])), *lot[1:]],
    ],
)
def test_a_lot_that_can_be_none_is_refused(common, change, wording):
    with wording.refusal(InputError):
        replace(common.compensator, lot=tuple(change(list(common.compensator.lot))))


def test_the_valve_in_the_file_is_one_of_the_lot(common, wording):
    other = [replace(valve, valve_sha256="0" * 64) for valve in common.compensator.lot]
    with wording.refusal(InputError):
        prove_derived(replace(common.compensator, lot=tuple(other)))


def test_what_goes_to_a_device_without_verify_is_refused_in_one_line(common, tmp_path, capsys):
    """`codegen` leaves it to `verify`, which says it as "reproduced"."""
    path = tmp_path / "lot_compensator.json"
    path.write_bytes(to_json_bytes(with_bound(common.compensator, "c", 1, -1.0)))
    assert main(["calibration", str(path), "-o", str(tmp_path / "block.hex")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "over-compensates 1 of 4 valves of its lot: c;" in said
    assert not (tmp_path / "block.hex").exists()


# ---- the C ----


def firmware_of(compensator, folder):
    made = generate(compensator, "host")
    write_folder(folder, made.files, made.manifest)
    return folder, read_compensator(folder)


@needs_compiler
def test_verify_compares_the_core_with_every_valve(common, tmp_path, wording):
    folder, compensator = firmware_of(common.compensator, tmp_path / "firmware")
    found = check_all_inputs(folder)
    (check,) = lot_checked((found,), compensator)
    assert check.holds and found.holds and found.lot.valves == 4 and found.lot.over_compensated == ()
    wording.of_test(check.text)
    # Two arguments agree but for the rounding of one count; and the design takes the error of the pressures as whole
    # codes, up to one more, over which the bound changes.
    assert found.lot.worst == common.worst.name
    worst, dp_MPa = compensator.lot[[*KNEES].index(common.worst.name)].positive, compensator.signals.pair(1).dp_MPa
    slopes = np.diff(worst.u_lower_V) / np.diff(worst.dp_MPa)
    of_a_code_V = float(np.abs(slopes).max()) * float(dp_MPa(1) - dp_MPa(0))
    more_V = found.lot.smallest_margin_V - float(common.worst.margin_V)
    assert -10 / 60000 <= more_V <= 10 / 60000 + of_a_code_V
    lower, compensator = firmware_of(with_bound(common.compensator, "d", 0, -0.5), tmp_path / "lower")
    found = check_all_inputs(lower)
    (check,) = lot_checked((found,), compensator)
    assert check.holds is False and not found.holds and found.lot.over_compensated == ("d",)
    wording.of_test(check.text)


def test_of_the_valve_in_the_file_it_finds_what_the_input_check_finds(document):
    """On a drive that is the law's own, and on one that is a count too high everywhere."""
    compensator = read(document)
    carrier = next(each for each in compensator.lot if each.valve_sha256 == compensator.valve_json_sha256)
    exact = ExactLaw(compensator)
    found = differences(exact)
    at_zero = np.array([exact.compare_value(exact.zero, exact.corners(exact.betas(int(dp)))) for dp in found.values])
    own = guarded_bounds(compensator, 1)
    for higher in (0, 1, 500):
        margin, of_lot = zero_command_margins(exact, found, at_zero + higher, [own, carrier.positive])
        assert margin == of_lot
        check = check_lot(exact, found, at_zero + higher)
        assert check.smallest_margin_V <= float(margin.margin_V)
        assert (carrier.name in check.over_compensated) == bool(margin.exceeded) == (margin.margin_V < 0)


def test_of_a_valves_own_setting_there_is_nothing_to_compare(batch):
    own = batch["a"]
    exact = ExactLaw(own)
    assert check_lot(exact, differences(exact), np.zeros(1)) is None and lot_checked((), own) == []


# ---- which pressure drops ----


def valve_tested(common, name, *places):
    bounds = LotSide(trend="flat", confidence=0.99, tested_MPa=places, dp_MPa=places, u_lower_V=(5.0,) * len(places))
    return replace(common.compensator.lot[0], name=name, positive=bounds)


def test_a_valve_that_lacks_a_pressure_of_the_lot_is_found(common):
    full = [valve_tested(common, name, 1.0 + shift, 2.5, 5.0) for name, shift in (("v", 0.0), ("w", 0.03), ("x", 0.01))]
    short = valve_tested(common, "short", 1.0, 2.5)
    assert lacking_in(full) == ()  # no bench sets a pressure to a per cent
    lacking = (Lacking(name="short", sign=1, dp_MPa=(5.0,)),)
    assert lacking_in([*full, short]) == lacking
    assert without_narrow([*full, short], lacking) == ({"short"}, (1.03, 5.0))
    assert common_interval([*full, short]) == (1.03, 2.5) and common_interval(full) == (1.03, 5.0)
    wider = valve_tested(common, "wider", 1.0, 2.5, 5.0, 7.0)  # one more is nobody's lack
    assert lacking_in([*full, wider]) == ()
    assert common_interval([valve_tested(common, "p", 1.0), valve_tested(common, "q", 2.0)]) is None


def test_a_pressure_between_two_tests_makes_no_range_narrower(common):
    """Whatever the ends of its tests are: no bench sets a pressure drop to a per cent."""
    full = [valve_tested(common, name, 1.0, 2.0, 4.0) for name in "vwxy"]
    coarse = valve_tested(common, "V8", 1.01, 3.99)
    (lacking,) = lacking_in([*full, coarse])
    assert (lacking.name, lacking.dp_MPa) == ("V8", (2.0,))
    assert without_narrow([*full, coarse], (lacking,)) == (frozenset(), None)


def test_a_range_that_would_be_none_without_them_and_one_that_another_side_ends(common):
    ends = [valve_tested(common, "a", 1.0, 2.0), valve_tested(common, "b", 2.0, 4.0)]
    lacking = lacking_in(ends)
    assert {each.name for each in lacking} == {"a", "b"} and without_narrow(ends, lacking) == ({"a", "b"}, None)
    short, long = (valve_tested(common, "", *places).positive for places in ((1.0, 2.0), (1.0, 2.0, 4.0)))
    both = [replace(common.compensator.lot[0], name=name, positive=long, negative=short) for name in "vw"]
    both.append(replace(both[0], name="x", positive=short))
    assert without_narrow(both, lacking_in(both)) == (frozenset(), None)


# ---- what a reader is told ----


@pytest.mark.slow
@needs_compiler
def test_firmware_and_report_say_first_that_they_are_of_a_lot(common, batch, tmp_path):
    folder = tmp_path / "firmware"
    made = generate(common.compensator, "f28335")
    write_generated(made, folder)
    document = json.loads((folder / "compensator.json").read_bytes())
    said = f"LOT SETTING of 4 valves, lot SHA-256 {document['lot_sha256']}."
    for name, text in made.files.items():
        assert name in (*made.manifest.board, *UNMARKED) or said in "\n".join(text.splitlines()[:4]), name
    header, readme = made.files["core/dz_valve.h"], made.files["f28335/README.md"]
    assert f"/* Valve {common.carrier} identified from: " in header
    words = " ".join(header.replace(" * ", " ").split())
    assert f"of one of the 4 valves of this lot setting, valve {common.carrier}; of the others" in words
    assert "**This is a lot setting of 4 valves**" in readme and document["lot_sha256"] in readme
    own = generate(batch["a"], "host")
    assert not any("lot setting" in text.lower() for text in own.files.values())
    evidence = tmp_path / "evidence"
    main(["verify", str(folder), "-o", str(evidence), "--quiet"])  # its verdict is no matter here
    report = (evidence / "report.html").read_text(encoding="utf-8")
    lot = json.loads((evidence / "verification.json").read_bytes())["inputs"][0]["lot"]
    head = report[: report.index('<section id="lot">')]
    assert "<h1>Lot setting of 4 valves: dead-zone compensator for f28335" in head
    assert f"Worst valve of the lot: {lot['worst']}" in head and f"{1e3 * lot['smallest_margin_V']:.3f} mV" in head
    carrier = head.index(f"Of one of these valves, {common.carrier}, the carrier")
    assert head.index("Worst valve of the lot") < carrier < head.index("Dead zone on opening")
    for heading in ("Test conditions", "Thresholds", "Closed loop"):
        assert f"<h2>{heading} <small>of {common.carrier}, the carrier</small></h2>" in report
    assert document["lot_sha256"] in report[report.index('<section id="lot">') :]
