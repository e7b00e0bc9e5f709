"""The current controller in C equals the exact one, state by state, on three machines; wrong ones are seen."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import RequirementError
from dzdesign.verify.current.controller_states import (
    HELD,
    OF_B,
    OPEN,
    OVER,
    SHORT,
    B,
    HostStates,
    check_states,
    hashes_on,
)
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4
from tests.codegen.core.test_misra import CPPCHECK, FINDING, justified, symbol_of
from tests.support.current_loops import LOOPS, PLAIN, SUPPLY, current_texts
from tests.support.synthetic import needs_compiler

STATES = 300_000
on_every_loop = pytest.mark.parametrize("name", LOOPS)


@needs_compiler
@on_every_loop
def test_c_equals_the_exact_controller_state_by_state(name):
    found, _ = check_states(LOOPS[name], current_texts(LOOPS[name]), STATES)
    assert found.wrong == 0, found.first_wrong
    assert found.states > STATES


@needs_compiler
@on_every_loop
def test_the_states_reach_every_part_of_the_controller(name):
    """Each fault, an output at its end, a wound-up integral at either end, and most states without a fault."""
    loop = LOOPS[name]
    periods, _ = HostStates(loop, current_texts(loop)).periods(1, 100_000)
    after = periods["after"]
    for bit in (OPEN, SHORT, OVER):
        fresh = (after["faults"] & bit != 0) & (periods["before"]["faults"] & bit == 0)
        assert np.count_nonzero(fresh) > 50
    assert np.mean(after["faults"] == 0) > 0.3
    ends = [sign * (loop.integral_limit << loop.gain_shift) for sign in (-1, 1)]
    reached = [(after["integral"] == end) & (periods["before"]["integral"] != end) for end in ends]
    # With a larger limit the output is at its end before the integral is at its own.
    assert loop.integral_limit > 5000 or min(map(np.count_nonzero, reached)) > 20
    assert np.count_nonzero(after["compare"] == loop.compare_limit) > 500
    if loop.two:
        changed = after["on_b"] != periods["before"]["on_b"]
        assert np.count_nonzero(changed & (after["on_b"] == B)) > 500 < np.count_nonzero(changed & (after["on_b"] == 0))
        for bit in (bit << place for bit in (OPEN, SHORT, OVER, HELD) for place in (0, OF_B)):
            assert np.count_nonzero((after["faults"] & bit != 0) & (periods["before"]["faults"] & bit == 0)) > 20
    assert np.count_nonzero((after["compare"] > 0) & (after["compare"] < loop.compare_limit)) > 500


@needs_compiler
def test_no_two_blocks_have_the_same_states():
    """Seeds of neighbours once began alike: of ten million states only five were different ones."""
    host = HostStates(PLAIN, current_texts(PLAIN))
    inputs = {host.periods(seed, 50)[0]["total"].tobytes() for seed in range(2_000)}
    assert len(inputs) == 2_000


@needs_compiler
@pytest.mark.parametrize(
    ("machine", "states"),
    [
        pytest.param(machine, states, id=machine.name, marks=pytest.mark.skipif(bool(why), reason=why))
        for machine, states in ((CORTEX_M4, 100_000), (AVR, 2_000))
        for why in [machine.missing()]
    ],
)
@on_every_loop
def test_other_machines_give_the_same_hashes(name, machine, states):
    """An int of 16 bits among them; the host's states are those that were compared above."""
    core = current_texts(LOOPS[name])
    hashes = hashes_on(machine, LOOPS[name], core, states)
    if states < 10_000:
        periods, hashed = HostStates(LOOPS[name], core).periods(22, states)
        assert len(periods) == states and hashes[0] == hashed
    else:
        assert hashes == check_states(LOOPS[name], core, states)[1]


SEEDED = {
    "output not below the integral on release": (" - numbers->release;", ";"),
    "output too low on release": (" - numbers->release;", " - numbers->release - 1u;"),
    "rounding of the output": ("+ half_of(gain_shift))", ")"),
    "rounding of the current": ("* numbers->current_gain) + half_of(current_shift)", "* numbers->current_gain)"),
    "no anti-windup": ("(error & ~past_end) * numbers->integral", "error * numbers->integral"),
    "anti-windup at one end": (" | (asked & error))", ")"),
    "another limit": ("smaller(counts, limit) & on", "smaller(counts, limit + 1u) & on"),
    "integral without end": ("larger(smaller(integral, largest), 0u - largest) & on", "integral & on"),
    "integral kept at zero": ("0u - largest) & on", "0u - largest)"),
    "output on at a fault": (" & (faults - 1u))", ")"),
    "output on at no set point": ("(0u - (uint32_t)set_point) & (faults", "(faults"),
    "rate of one sign": (
        "larger(smaller((uint32_t)set_point, loop->ramped + rate), loop->ramped - rate)",
        "smaller((uint32_t)set_point, loop->ramped + rate)",
    ),
    "fault forgotten": ("faults = loop->faults |", "faults ="),
    "over-current a period late": (
        "reached(over_ticks - numbers->over_ticks)",
        "reached(loop->over_ticks - numbers->over_ticks)",
    ),
    "open load at any output": (" & ~(loop->compare - numbers->open_compare)", ""),
    "a period too many": ("(loop->open_ticks + 1u)", "(loop->open_ticks + 2u)"),
    "short one code late": ("(uint32_t)sum - numbers->short_sum", "(uint32_t)sum - 1u - numbers->short_sum"),
    "offset not rounded": ("(loop->offset_total + half_of(shift))", "(loop->offset_total)"),
    "offset's half by one": ("(loop->offset_total + half_of(shift))", "(loop->offset_total + half_of(shift) + 1u)"),
    "lowest offset by one": ("offset - numbers->offset_low;", "offset - numbers->offset_low - 1u;"),
    "highest offset by one": ("offset_high - numbers->offset_low;", "offset_high - numbers->offset_low + 1u;"),
    "another initial offset": ("block->current.offset_nominal", "block->current.offset_nominal + 1u"),
    "initial state not set": ("    loop->offset_total = 0u;\n", ""),
    "a short forgotten by the calibration": (
        "&= ~(uint32_t)DZ_CURRENT_NO_OFFSET",
        "&= ~(uint32_t)(DZ_CURRENT_NO_OFFSET | DZ_CURRENT_SHORT)",
    ),
    "offset never wrong": ("? DZ_CURRENT_SENSOR : 0u", "? 0u : 0u"),
    "feed-forward of the current": ("(aim * numbers->feed", "(current * numbers->feed"),
    "set point without its rate": ("loop->ramped + rate)", "loop->ramped + rate + 1u)"),
    "supply between nodes": ("supply[node + 1u] * past", "supply[node] * past"),
    "supply above its range": ("low), numbers->supply_high - low)", "low), numbers->supply_high - low - 9u)"),
}


SEEDED_OF_TWO = {
    "the set point of the other solenoid": ("of_solenoid(asked_b, set_point_a", "of_solenoid(~asked_b, set_point_a"),
    "followed before the change": (" set_point_b) & ~changes;", " set_point_b);"),
    "solenoid forgotten at zero": ("| (loop->on_b & ~negative(0u - (uint32_t)set_point_a))", ""),
    "outputs exchanged": ("loop->compare & ~loop->on_b;", "loop->compare & loop->on_b;"),
    "both outputs": ("loop->compare & loop->on_b;", "loop->compare;"),
    "the other shunt's offset": ("offset = of_solenoid(loop->on_b,", "offset = of_solenoid(~loop->on_b,"),
    "decay not waited for": ("decayed = ~flows &", "decayed ="),
    "decay seen while the output was on": (" & negative(loop->compare - 1u);", ";"),
    "decay to one code more": ("~negative(above - numbers->open_sum)", "~negative(above - 1u - numbers->open_sum)"),
    "a period longer to decay": ("reached(held_ticks - numbers->", "reached(loop->held_ticks - numbers->"),
    "a current that stays is no fault": ("* DZ_CURRENT_HELD)", "* 0u)"),
    "faults name the other": ("found << (loop->on_b & OF_B)", "found << (~loop->on_b & OF_B)"),
    "sensor's fault without its solenoid": (" << OF_B;", ";"),
    "offset of B with the sums of A": ("            loop->offset_total = 0u;\n", ""),
    "calibrated as B": ("            loop->on_b = 0u;\n", ""),
}  # fmt: skip


@needs_compiler
@pytest.mark.parametrize(
    ("name", "fault"), [("supply", fault) for fault in SEEDED] + [("two shunts", fault) for fault in SEEDED_OF_TWO]
)
def test_a_wrong_controller_is_seen(name, fault):
    loop = LOOPS[name]
    core = current_texts(loop)
    right, wrong = (SEEDED | SEEDED_OF_TWO)[fault]
    assert core["dz_current.c"].count(right) == 1
    core["dz_current.c"] = core["dz_current.c"].replace(right, wrong)
    assert check_states(loop, core, 100_000)[0].wrong > 0


@needs_compiler
def test_a_controller_that_crashes_is_a_failure_and_not_the_end():
    core = current_texts(PLAIN)
    crash = "    if (set_point > 65530u) {\n        *(volatile uint32_t *)0 = 1u;\n    }\n"
    begin = "    /* The set point, limited to the rate."
    assert core["dz_current.c"].count(begin) == 1
    core["dz_current.c"] = core["dz_current.c"].replace(begin, crash + begin)
    with pytest.raises(RequirementError, match="ended with"):
        check_states(PLAIN, core, 100_000)


@pytest.mark.skipif(bool(AVR.missing()), reason=AVR.missing())
def test_a_difference_of_16_bits_is_seen_where_int_has_16():
    """A PC takes the difference of two codes in 32 bits, whatever their type."""
    loop = LOOPS["plain"]
    core = current_texts(loop)
    right, narrow = "(uint32_t)sum - numbers->short_sum", "sum - numbers->short_sum"
    assert right in core["dz_current.c"]
    wrong = core | {"dz_current.c": core["dz_current.c"].replace(right, narrow)}
    assert check_states(loop, wrong, 10_000)[0].wrong == 0
    _, hashed = HostStates(loop, core).periods(22, 2_000)
    assert hashes_on(AVR, loop, wrong, 2_000)[0] != hashed


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck on the path; apt install cppcheck")
@on_every_loop
def test_misra_finds_nothing_that_is_not_stated(name, tmp_path):
    for file, text in current_texts(LOOPS[name]).items():
        (tmp_path / file).write_text(text)
    done = subprocess.run(
        [*CPPCHECK, FINDING, str(tmp_path / "dz_current.c")], capture_output=True, text=True, check=False, timeout=300
    )
    places = [line.rsplit(":", 2) for line in done.stderr.splitlines() if "misra" in line]
    shown = [(name, path, (tmp_path / path).read_text().splitlines()[int(at) - 1]) for path, at, name in places]
    shown = [each for each in shown if each[1].endswith(("dz_current.c", "dz_current.h"))]
    stated = justified((tmp_path / "dz_current.h").read_text())
    assert [each for each in shown if (each[0].removeprefix("misra-c2012-"), symbol_of(each[2])) not in stated] == []


@pytest.mark.parametrize(
    "changed",
    [
        {"samples": 3}, {"current_gain": 30000}, {"over_sum": 100}, {"offset_tolerance": 65500},
        {"integral_limit": 65535, "gain_shift": 14}, {"open_ticks": 0}, {"release": 60001},
    ],
)  # fmt: skip
def test_integers_that_could_overflow_are_refused(changed):
    with pytest.raises(RuleError):
        replace(PLAIN, **changed)


def test_a_correction_of_too_few_nodes_is_refused():
    with pytest.raises(RuleError):
        replace(SUPPLY, nodes=SUPPLY.nodes[:-1])
