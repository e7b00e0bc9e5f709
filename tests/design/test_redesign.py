"""compensator.json against a hand: every number that follows from valve and options is compared; the target is kept."""

import json
from dataclasses import replace

import pytest

from dzdesign import api
from dzdesign.codegen.project import generate, target_named
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError
from dzdesign.design import redesign
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_setting import lot_setting
from dzdesign.design.redesign import prove_derived
from dzdesign.identify.identification import identify
from tests.support.designs import CURRENT, designed
from tests.support.synthetic import Truth, synthetic_ramp

#: What no number of the law depends on; and the valve, of which every number is under its seal.
WORDS = ("schema", "tool", "options", "valve")


@pytest.fixture(scope="module")
def document(example_compensator):
    return json.loads(to_json_bytes(example_compensator))


def read(document):
    return read_artefact(to_json(document).encode(), Compensator, "compensator.json")


def places(value, path=()):
    """Yield the path of every number and truth in a document, of a list its first and last."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from places(item, (*path, key))
    elif isinstance(value, list) and value:
        for index in sorted({0, len(value) - 1}):
            yield from places(value[index], (*path, index))
    elif isinstance(value, int | float | bool):
        yield path


def edited(document, path, change):
    """Return a copy with one value changed."""
    copy = json.loads(json.dumps(document))
    holder = copy
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = change(holder.get(path[-1]) if isinstance(holder, dict) else holder[path[-1]])
    return copy


def larger(value):
    return not value if isinstance(value, bool) else value + 1


def refusal(document) -> str:
    with pytest.raises(InputError) as caught:
        prove_derived(read(document))
    return str(caught.value)


def test_what_design_wrote_follows(document):
    prove_derived(read(document))


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("sides", "positive", "drive_range_over_u_max"), [3, 5], "drive_range_over_u_max' is 0.600000, but"),
        (("signals", "command", "full_code"), 3000, "'signals.command.full_code' is 3000, but 4095 follows"),
        (("signals", "pressure_a", "span_MPa"), [25, 1], "'signals.pressure_a.span_MPa' is 25"),
        (("valve", "meter", "floor_L_min"), 0.1, "the rest of the file gives"),
        (("options", "output_max"), "90 %", "'drive_functions.compare_limit' is 60000, but 54000 follows"),
        (("options", "polarity"), "upside down", "--polarity is 'upside down'"),
        (("options", "colour"), "red", "'options.colour' is 'red', but nothing follows"),
        (("target", "converter", "full_V"), [33, 10], "follows from its valve and its options"),
    ],
)
def test_an_edit_by_hand_is_refused_with_its_place(document, path, value, said):
    assert said in refusal(edited(document, path, lambda _: value))


def test_every_number_of_the_file_counts(document, example_compensator, monkeypatch):
    """What is designed again depends on valve, options and target alone: where none is edited it is known already."""
    unseen = []
    for path in places({key: value for key, value in document.items() if key not in WORDS}):
        with monkeypatch.context() as patch:
            if path[0] != "target":
                patch.setattr(redesign, "design", lambda *_: example_compensator)
            try:
                prove_derived(read(edited(document, path, larger)))
                unseen.append(path)
            except InputError:
                pass
    # A converter's gain error counts where the command has two signs only: about zero volts the code is in mid-span.
    # When the current is sampled counts where it is controlled: see below.
    assert unseen == [("target", "converter", "gain_codes"), ("target", "current_sampling", "before")]


def test_with_a_controlled_current_the_moments_of_its_sampling_count(example_valve):
    document = json.loads(to_json_bytes(designed(example_valve, **CURRENT)))
    prove_derived(read(document))
    said = refusal(edited(document, ("target", "current_sampling", "before"), larger))
    assert "'current_drive." in said and "follows from its valve and its options" in said
    refusal(edited(document, ("current_drive", "sampling", "before"), larger))


def test_costs_are_compared(document):
    place, text = next((place, text) for place, text in enumerate(document["costs"]) if "offset 5." in text)
    assert f"'costs[{place}]' is" in refusal(edited(document, ("costs", place), lambda _: text.replace("5.", "4.")))


def test_a_file_without_its_options_is_generated_by_nobody_and_checked_by_nobody(document, tmp_path, capsys):
    """All of them deleted, any number outside of the certificate could be another."""
    bare = {**document, "target": None, "options": None}
    compensator = read(bare)
    assert compensator.target is None
    prove_derived(compensator)  # its certificates alone
    path = tmp_path / "compensator.json"
    path.write_text(to_json(bare), encoding="utf-8", newline="")
    assert main(["codegen", str(path), "-o", str(tmp_path / "firmware")]) == 2
    assert "does not say for which target and with which options" in capsys.readouterr().err
    assert not (tmp_path / "firmware").exists()
    with pytest.raises(InputError, match="does not say for which target"):
        api.generate(path)


@pytest.mark.parametrize("key", ["target", "options", "lot", "lot_sha256", "valve"])
def test_half_of_what_was_asked_for_is_refused(document, key):
    """Else the law would not be derived again, and any edit outside of the certificate would pass."""
    with pytest.raises(InputError, match=f"lacks the key '{key}'"):
        read({each: document[each] for each in document if each != key})
    if key in ("target", "options"):
        with pytest.raises(InputError, match="'target' and 'options' belong together"):
            read({**document, key: None})


# ---- the target ----


def test_the_target_of_the_design_is_the_default_and_another_that_counts_alike_goes_on_with_a_word(
    example_valve, tmp_path, capsys
):
    path = tmp_path / "compensator.json"
    path.write_bytes(to_json_bytes(designed(example_valve, "cortex-m4")))
    assert main(["codegen", str(path), "-o", str(tmp_path / "firmware"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["target"] == "cortex-m4"
    assert main(["codegen", str(path), "-o", str(tmp_path / "other"), "--target", "f28335"]) == 0
    said = capsys.readouterr().err
    assert "designed for target cortex-m4; f28335 has the same converter and timer" in said


def test_another_target_is_refused_where_a_code_is_another_voltage(example_valve, tmp_path, capsys, wording):
    """The F280049C's converter has 3.3 V, the F28335's 3 V: with equal counts nothing else would tell."""
    compensator = designed(example_valve, "cortex-m4", pressure_a="4..20 mA on 140 ohm")
    inputs = target_named("f280049c").inputs()
    alike = replace(compensator, target=inputs)
    with wording.refusal(InputError, "design: another converter"):
        generate(alike, "f28335")
    path = tmp_path / "compensator.json"
    path.write_bytes(to_json_bytes(compensator))
    assert main(["codegen", str(path), "-o", str(tmp_path / "firmware"), "--target", "f280049c"]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "firmware").exists()


def test_a_target_without_a_converter_is_wired_for_the_one_of_the_design(example_valve):
    firmware = generate(designed(example_valve, "f280049c"), "cortex-m4")
    assert "takes its codes as they are: 4096 codes over 3.3 V" in firmware.note
    assert "10 V" in firmware.files["cortex_m4/README.md"]


def test_an_unknown_target_in_the_file_is_named(document, wording):
    with wording.refusal(InputError, "design: an unknown target"):
        generate(read(edited(document, ("target", "name"), lambda _: "f28336")))


def test_the_target_is_compared_with_the_one_of_that_name(document):
    """The design follows from target.* as it stands there: another converter under the target's name is believed."""
    renamed = read(edited(document, ("target", "name"), lambda _: "f280049c"))
    for asked in (None, "f28335", "cortex-m4"):
        with pytest.raises(InputError, match=r"says that target f280049c has .*, but it has .*; design it again"):
            generate(renamed, asked)


# ---- one setting for many ----


@pytest.fixture(scope="module")
def common():
    def valve(knee):
        ramps = [synthetic_ramp(dp, Truth(knee_rising=knee - 0.05 * dp), rate_Hz=10.0) for dp in (1.0, 3.0, 5.0)]
        return designed(identify(ramps))

    return lot_setting({"low": valve(5.2), "high": valve(5.4)}).compensator


def test_a_lot_setting_is_bounded_by_its_valve(common):
    document = json.loads(to_json_bytes(common))
    assert len(document["lot"]) == 2
    prove_derived(read(document))
    for change in ([9, 10], [1, 100]):
        faulty = edited(document, ("sides", "positive", "drive_range_over_u_max"), lambda _, change=change: change)
        assert "'sides.positive.drive_range_over_u_max' is" in refusal(faulty)
    other = edited(document, ("signals", "command", "full_code"), lambda _: 3000)
    assert "'signals.command.full_code' is" in refusal(other)
    own = {**document, "lot": [], "lot_sha256": None}
    assert "'sides.positive.drive_range_over_u_max' is" in refusal(own)
