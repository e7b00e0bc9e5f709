"""Blocks that count cycles, beside the model of the drive in C, and wrong ones. On few inputs."""

import numpy as np
import pytest

from dzdesign.codegen.integers.plc import structured_text
from dzdesign.verify.exhaustive.drive_check import drive_samples
from dzdesign.verify.exhaustive.exact_drive import DriveModel
from dzdesign.verify.outputs import every_cycle
from dzdesign.verify.outputs.every_cycle import check_cycles
from dzdesign.verify.outputs.every_pair import EveryPair
from dzdesign.verify.outputs.exact_block import cycles_of
from dzdesign.verify.outputs.text_values import TextValues
from tests.support.core_variants import VARIANTS, variant
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator

ROOTS = {"one": GOLDENS, "two": FULL}
#: A design whose drive in C has nothing that a block has not.
LAW_ALONE = {"three pressures": {"signals": VARIANTS["three pressures"]["signals"]}, "live zero": {},
             "bipolar": {"fault_samples": 3}, "no transition": {"interlock": False}}  # fmt: skip


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Let sequences be short, and counts to 80 be many."""
    monkeypatch.setattr(every_cycle, "FEWEST_CYCLES", 40)
    monkeypatch.setattr(every_cycle, "DEBOUNCE_TIMES", 3)
    monkeypatch.setattr(every_cycle, "MOST_VALUES", 70)


def made_and_tried(name, interface, cycle_time):
    made = golden_compensator(root=ROOTS[name]) if name in ROOTS else variant(name)
    cycles = cycles_of(made, cycle_time)
    every = EveryPair(made, interface, made.signals.signs, remembers=True, cycles=cycles)
    return structured_text(made, "0" * 64, interface, cycle_time), every


@pytest.mark.parametrize(
    ("name", "interface", "cycle_time"),
    [
        ("one", "plc", "10 ms"), ("one", "codes", "0.06 ms"), ("one", "plc", "0.05 ms"), ("two", "plc", "1 ms"),
        ("two", "codes", "10 ms"), ("three pressures", "plc", "1 ms"), ("three pressures", "codes", "2 ms"),
    ],
)  # fmt: skip
def test_a_block_counts_as_it_is_described(name, interface, cycle_time):
    text, every = made_and_tried(name, interface, cycle_time)
    check = check_cycles(TextValues(text, "FB.st").run, every)
    assert check.holds, check.text


@pytest.mark.parametrize("name", LAW_ALONE)
def test_called_at_each_sample_it_is_the_drive_in_c_number_for_number(name, monkeypatch):
    monkeypatch.setitem(VARIANTS, f"{name}, law alone", VARIANTS[name] | LAW_ALONE[name])
    if name == "three pressures":
        monkeypatch.setitem(VARIANTS, f"{name}, law alone", LAW_ALONE[name])
    made = variant(f"{name}, law alone")
    text, every = made_and_tried(f"{name}, law alone", "codes", "0.8 ms")
    assert every.cycles == made.drive_functions.fault_samples and made.signals.sample_Hz == 1250
    block, drive = TextValues(text, "FB.st"), DriveModel(made)
    state = {each: np.array(value) for each, value in every.first().items()}
    enable = {"enable": np.array(True)} if every.interlock else {}
    for codes in drive_samples(made, seed=5, count=600):
        drive.sample(*codes)
        drive.tick()
        command, *pressures = (np.array(code) for code in codes)
        found = block.run(every.given(command, dict(zip("ABC", pressures, strict=False)), state | enable))
        state = {each: found[each] for each in state}
        outputs = int(found["output_a"]), int(found["output_b"]) if every.both else 0, int(found["status"])
        assert outputs == drive.outputs, codes


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("one", "FAULT_CYCLES : DINT := 4", "FAULT_CYCLES : DINT := 5"),
        ("one", "SEL(good, 0, MIN(", "SEL(good, valid_commands, MIN("),
        ("one", "SEL(NOT failed, 0, MIN(", "SEL(NOT failed, valid_pressures, MIN("),
        ("one", "limited <= INTERLOCK", "limited < INTERLOCK"),
        ("one", "AND enable ", "AND NOT enable "),
        ("one", "FAULT_CYCLES <= valid_commands;", "FAULT_CYCLES < valid_commands;"),
        ("one", "SEL(held, ", "SEL(failed, "),
        ("one", "BOOL_TO_DINT(held)", "BOOL_TO_DINT(failed)"),
        ("three pressures", "below AND NOT negative", "below"),
        ("three pressures", "valid_positive, valid_negative) <", "valid_positive, valid_positive) <"),
        ("three pressures", "-limited <= INTERLOCK", "limited <= INTERLOCK"),
    ],
)
def test_a_seeded_fault_is_seen(name, old, new):
    text, every = made_and_tried(name, "codes", "1 ms")
    assert old in text
    check = check_cycles(TextValues(text.replace(old, new, 1), "FB.st").run, every)
    assert check.id == "debounce" and check.holds is False
