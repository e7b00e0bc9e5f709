"""A C2000 board as `design` is told of it: the crystal decides the clock, the channels stand in the board's file."""

import re
import subprocess
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign import api
from dzdesign.codegen.c2000 import ROLES
from dzdesign.codegen.project import generate, inputs_of, target_for, target_named
from dzdesign.core.errors import InputError
from dzdesign.design.design_choices import DesignChoices
from dzdesign.regeneration import regenerated
from dzdesign.stages.design import design_options
from dzdesign.verify.toolchain.host_compiler import host_compiler
from tests.support.core_variants import variant
from tests.support.designs import BOTH_SIGNS
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.synthetic import needs_compiler


def board_values(text: str) -> dict[str, int]:
    """Return the values of a dz_board.h by their names."""
    return {name: int(number) for name, number in re.findall(r"#define DZ_BOARD_(\w+) (\d+)\n", text)}


@pytest.mark.parametrize(
    ("crystal", "counts", "factor"), [("20 MHz", 40_000, 10), ("25 MHz", 50_000, 10), ("50 MHz", 60_000, 6)]
)
def test_the_crystal_decides_the_clock_and_all_that_follows(example_valve, crystal, counts, factor):
    compensator = api.design(example_valve, crystal=crystal)
    assert compensator.signals.compare_max == counts
    firmware = generate(compensator)
    values = board_values(firmware.files["f28335/dz_board.h"])
    assert (values["OSC_HZ"], values["PLL_DIV"]) == (compensator.target.crystal_Hz, factor)
    assert values["OSC_HZ"] * factor / 2 == counts * 2500, "compare counts of a PWM period"
    figures = target_for(compensator.target).context
    assert Fraction(figures["cmpb"]) / (counts * 2500) == Fraction(20, 10**6), "20 us to the interrupt"
    assert abs(float(figures["baud_error"])) < 1


def test_the_channels_stand_in_the_files_of_the_board_and_of_the_wiring(example_valve):
    made = {}
    for target in ("f28335", "f280049c"):
        compensator = api.design(example_valve, target=target, channels="a5, A4 A0")
        assert compensator.target.channels == ("A5", "A4", "A0")
        files = generate(compensator).files
        made[target] = board_values(files[f"{target}/dz_board.h"])
        assert [made[target][name] for name in ("COMMAND", "PRESSURE_A", "PRESSURE_B")] == [5, 4, 0]
        assert re.search(r"\| command [^|]*\| ADCINA5 \|", files[f"{target}/README.md"])
    assert made["f28335"]["PWM"] == made["f280049c"]["PWM"] == 1


def test_the_second_half_of_the_f28335_follows_the_first():
    target = target_named("f28335").on_board(None, ("B7", "A7", "B0"))
    numbers = [target.context[f"{role}_number"] for role in ("command", "pressure_a", "pressure_b")]
    assert numbers == ["15", "7", "8"]
    others = {target.context[f"{role}_number"] for role in ("current", "supply")}
    assert len(others) == 2 and not others & set(numbers), "the rest is free"


def test_a_folder_of_a_declared_board_is_designed_and_generated_again(example_valve, tmp_path):
    compensator = api.design(example_valve, crystal="20 MHz", channels="A3 A4 B0")
    api.generate(compensator, output=tmp_path / "fw")
    again = regenerated(tmp_path / "fw")
    assert not again.fault and not again.unknown
    assert again.files["f28335/dz_board.h"] == (tmp_path / "fw/f28335/dz_board.h").read_bytes()


@pytest.mark.parametrize(
    ("channels", "given", "expected"), [("A0 A1 A2 A3", {}, 3), ("A0 A1 A2", {"negative_dp": "A-C"}, 4)]
)
def test_channels_that_are_not_as_many_as_the_inputs_are_refused(channels, given, expected):
    valve = golden_valve(FULL)
    sides = {name: replace(side, recorded_drop=None) for name, side in valve.sides.items()}
    with pytest.raises(InputError, match=f"expected {expected} of these inputs"):
        api.design(replace(valve, sides=sides), channels=channels, command_signal=BOTH_SIGNS, **given)


def test_the_third_pressure_has_the_channel_behind_those_of_the_others():
    compensator = variant("three pressures")
    assert inputs_of(compensator) == ("command", "pressure_a", "pressure_b", "pressure_c")
    for channels, expected in (("A5 A4 A0 A3", "3"), (None, "6")):
        declared = tuple(channels.split()) if channels else ()
        target = target_named("f28335").on_board(None, declared, inputs_of(compensator))
        assert target.context["pressure_c_number"] == expected
        numbers = [target.context[f"{role}_number"] for role in ROLES]
        assert len(set(numbers)) == len(numbers)


REFUSED = [
    ("f28335", {"crystal": "10 MHz"}, "can't be clocked"),
    ("f28335", {"crystal": "33.333 MHz"}, "can't be clocked"),
    ("f28335", {"crystal": "20"}, "without a unit"),
    ("f28335", {"channels": "A0 A1"}, "expected the channels"),
    ("f28335", {"channels": "A0 A1 A1"}, "expected the channels"),
    ("f28335", {"channels": "A0 A1 A9"}, "has no channel 'A9'"),
    ("f280049c", {"crystal": "20 MHz"}, "device.h"),
    ("f280049c", {"channels": "A0 A1 B2"}, "has no channel 'B2'"),
    ("host", {"channels": "A0 A1 A2"}, "target host has none"),
]


@pytest.mark.parametrize(("target", "given", "words"), REFUSED)
def test_a_board_that_can_not_be_is_refused(target, given, words):
    with pytest.raises(InputError, match=re.escape(words)):
        design_options(DesignChoices(**given), target)


IMPOSSIBLE = [
    ("f28335", "PLL_DIV=9", "OSC_HZ"),
    ("f28335", "COMMAND=1", "same channel"),
    ("f28335", "PRESSURE_B=16", "0 to 15"),
    ("f28335", "PWM_GPIO=4", "PWM_GPIO"),
    ("f28335", "ACQ_PS=16", "ACQ_PS"),
    ("f28335", "TZ=2", "TRIP_GPIO"),
    ("f28335", "WDPS=8", "WDPS"),
    ("f28335", "SCI_TX_GPIO=30", "SCI_TX_GPIO"),
    ("f280049c", "PWM=9", "PWM must be 1 to 8"),
    ("f280049c", "WINDOW=4", "WINDOW"),
    ("f280049c", "PRESSURE_A=2", "same channel"),
    ("f280049c", "TRIP_GPIO=24", "boot pins"),
    ("f280049c", "TRIP_GPIO=0", "pin of the PWM"),
]


@needs_compiler
@pytest.mark.parametrize(("target", "value", "words"), IMPOSSIBLE)
def test_an_impossible_value_stops_the_build(example_valve, tmp_path, target, value, words):
    """Before any header of TI's is needed; one that is given to the compiler goes before the file's."""
    folder = tmp_path / "fw"
    api.generate(api.design(example_valve, target=target), output=folder)
    source = folder / target / ("dz_telemetry.c" if "SCI" in value else "dz_hardware.h")
    (tmp_path / "DSP28x_Project.h").write_text("")
    command = [host_compiler(), "-E", f"-DDZ_BOARD_{value}", f"-I{tmp_path}", f"-I{folder / 'core'}", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode and re.search(rf'#error "dz_board.h: .*{re.escape(words)}', done.stderr), done.stderr
