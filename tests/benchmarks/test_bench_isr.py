"""The ISR benchmark's own machinery: counts of code of known length, its exact rows, and that it sees wrong cores."""

from fractions import Fraction

import on_avr
import on_cortex_m4
import on_x86
import pytest
from building import Counts
from contender import Contender, our_forms
from goals import goals
from interrupt import count_interrupt, with_current
from measuring import Measured
from rival_cores import rivals
from tried_inputs import SIGNALS, exact_rows_header, expected_compares, has_whole_range, tried_inputs

from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions

MACHINES = {
    "x86-64": (on_x86, on_x86.X86),
    "Cortex-M4": (on_cortex_m4, on_cortex_m4.CORTEX_M4),
    "AVR": (on_avr, on_avr.AVR),
}


def needs(toolchain):
    return pytest.mark.skipif(bool(toolchain.missing()), reason=f"{toolchain.compiler}: {toolchain.missing()}")


on_every_machine = pytest.mark.parametrize(
    "machine", [pytest.param(module, marks=needs(chain), id=name) for name, (module, chain) in MACHINES.items()]
)


def designed(valve, **choices):
    """With sensors over the whole range of the converter, as the rivals know no others."""
    return design(valve, DesignOptions(signals=SIGNALS, accept=("broken-sensor",), **choices))


@pytest.fixture(scope="module")
def compensator(example_valve):
    return designed(example_valve)


@pytest.fixture(scope="module")
def inputs(compensator):
    return tried_inputs(compensator)


@pytest.fixture(scope="module")
def expected(compensator, inputs):
    return expected_compares(compensator, inputs)


def test_sensors_with_a_live_zero_are_seen(example_compensator, compensator):
    assert has_whole_range(compensator.signals) and not has_whole_range(example_compensator.signals)


@on_every_machine
@pytest.mark.parametrize("length", [0, 41])
def test_code_of_known_length_is_counted_right(machine, length, tmp_path):
    found = machine.count(machine.known(length), [(0, 0, 0), (5, 6, 7)], tmp_path)
    assert found.counts == (length + machine.RETURN,) * 2


#: A loop of four cycles, its last turn three, the two loads of its counter and the return.
AVR_LOOP = """\
.global dz_comp
.type dz_comp, STT_FUNC
dz_comp: ldi r24, 0x00
ldi r25, 0xC0
1: sbiw r24, 1
brne 1b
ret
"""


@needs(on_avr.AVR)
def test_cycles_beyond_the_16_bits_of_the_timer_are_counted(tmp_path):
    core = Contender(name="loop", made="", sources={"loop.S": AVR_LOOP})
    assert on_avr.count(core, [(0, 0, 0)], tmp_path).counts == (2 + 4 * 0xC000 - 1 + on_avr.RETURN,)


@on_every_machine
def test_what_depends_on_the_input_is_seen(machine, tmp_path):
    text = (
        "#include <stdint.h>\nuint16_t dz_comp(uint16_t u, uint16_t a, uint16_t b)"
        "{ for (volatile uint16_t i = 0; i < u; i++) {} return (uint16_t)(a + b); }\n"
    )
    core = Contender(name="loop", made="", sources={"dz_comp.c": text})
    found = machine.count(core, [(0, 1, 2), (10, 3, 4)], tmp_path)
    assert found.most > found.least + 20 and found.compares == (3, 7)


@on_every_machine
def test_our_core_gives_the_exact_law_on_every_counted_input(machine, compensator, inputs, expected, tmp_path):
    for index, form in enumerate(our_forms(compensator)):
        found = machine.count(form, inputs, tmp_path / str(index))
        assert found.compares == tuple(expected), form.name
        assert found.least > 0


@on_every_machine
def test_our_core_takes_the_same_for_every_input(machine, compensator, inputs, tmp_path):
    """On the AVR, whose library of 64 bits has branches, within a hundredth."""
    (form,) = our_forms(compensator)
    found = machine.count(form, inputs, tmp_path / "core")
    assert found.most - found.least <= (found.most // 100 if machine is on_avr else 0)


def test_the_expected_values_are_those_of_the_compensator(compensator, inputs, expected):
    """Two ways to the same numbers: addition with carry, and one exact product."""
    c = compensator
    for (u, p_a, p_b), value in zip(inputs, expected, strict=True):
        if u > c.signals.code_max:
            assert value == 0
        else:
            possible = max(p_a, p_b) <= c.signals.code_max
            assert value == c.compare(u, p_a - p_b if possible else -c.signals.code_max)


@pytest.mark.slow
@needs(on_x86.X86)
def test_rivals_do_the_same_job(example_valve, inputs, tmp_path):
    """Within a count, impossible codes included; only the unchecked table leaves those out."""
    law_alone = designed(example_valve, transition=Fraction(0))  # as the paper has it
    expected = expected_compares(law_alone, inputs)
    for index, rival in enumerate(rivals(law_alone)):
        found = on_x86.count(rival, inputs, tmp_path / str(index))
        wrong = sum(abs(a - b) > 1 for a, b in zip(found.compares, expected, strict=True))
        assert (wrong > 0) == rival.name.endswith("unchecked"), rival.name


@pytest.mark.slow
@pytest.mark.parametrize(
    "machine",
    [
        pytest.param(on_x86, marks=needs(on_x86.X86), id="x86-64"),
        pytest.param(on_cortex_m4, marks=needs(on_cortex_m4.CORTEX_M4), id="Cortex-M4"),
    ],
)
def test_a_core_that_is_wrong_once_is_seen(machine, compensator, tmp_path):
    """Seeded: three counts more at one command and one pair of pressures, out of all inputs."""
    (form, *_) = our_forms(compensator)
    rows = exact_rows_header(compensator)
    core = form.sources["dz_comp.c"].replace("uint16_t dz_comp(", "uint16_t right_comp(")
    fault = (
        "uint16_t dz_comp(uint16_t u, uint16_t a, uint16_t b)\n"
        "{ return (uint16_t)(right_comp(u, a, b) + 3 * (u == 1234 && a == 700 && b == 0)); }\n"
    )
    prototype = "#include <stdint.h>\nuint16_t right_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc);\n"
    sources = {**form.sources, "dz_comp.c": prototype + core + fault}
    wrong = Contender(name="wrong", made="seeded", sources=sources)
    assert machine.check_all(wrong, rows, tmp_path) == (33550336, 1, 3)


def measured(name, counts, *, ours=False, wrong=0):
    each = Counts(counts=counts, compares=(0,) * len(counts))
    return Measured(
        contender=Contender(name=name, made="", sources={}, ours=ours), x86=each, cortex_m4=each, avr=each,
        code_bytes=(1, 1, 1), inputs=9, wrong_host=wrong, largest_error=wrong, wrong_cortex_m4=0, wrong_tried=(0, 0, 0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("counts", "wrong", "missed"),
    [((40, 40), 0, 0), ((40, 40), 1, 1), ((39, 40), 0, 2), ((42, 42), 0, 1), ((51, 51), 0, 2), ((961, 961), 0, 3)],
)
def test_the_goals_are_judged(counts, wrong, missed):
    others = [
        measured("float32 slope table", (40,)),
        measured("float32 slope table, unchecked", (30,)),
        measured("casadi pw_lin", (10, 4100)),
    ]
    verdicts = [row.verdict for row in goals([measured("ours", counts, ours=True, wrong=wrong), *others])]
    assert verdicts.count("MISSES") == missed and len(verdicts) == 6


def test_each_machine_judges_the_form_that_is_fastest_there():
    """A second form that is slow on the Cortex-M4 costs nothing there; wrong or uneven it may not be."""
    others = [
        measured("float32 slope table", (40,)),
        measured("float32 slope table, unchecked", (30,)),
        measured("casadi pw_lin", (10, 4100)),
    ]
    fast = measured("fast", (40, 40), ours=True)
    for slow, missed in (((900, 900), 0), ((900, 901), 1)):
        rows = goals([fast, measured("slow", slow, ours=True), *others])
        assert [row.verdict for row in rows].count("MISSES") == missed


@needs(on_cortex_m4.CORTEX_M4)
def test_the_whole_interrupt_is_counted_from_its_first_instruction(example_compensator, tmp_path):
    """With a new sample it takes the law's instructions more; either takes the same for every input."""
    controlled = with_current(example_compensator)
    some = [each for each in tried_inputs(example_compensator) if max(each) <= 4095][::40]
    held = count_interrupt(controlled, some, tmp_path / "held", fresh=False)
    fresh = count_interrupt(controlled, some, tmp_path / "fresh", fresh=True)
    assert held.least == held.most <= 160
    assert held.most + 60 < fresh.least == fresh.most <= 300
