"""Drive functions and current controller in block form: step by step what the fixed form does, in every state."""

import ctypes
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of, current_block
from dzdesign.codegen.calibration.built_for import built_for
from dzdesign.codegen.calibration.files import block_core_files, texts
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.project import generate
from dzdesign.verify.current.current_checks import read_controller
from dzdesign.verify.current.state_check import check_states
from dzdesign.verify.exhaustive.drive_check import drive_follows, drive_samples
from tests.codegen.core.test_drive import Drive, compensator_named
from tests.support.block_cores import block_folder
from tests.support.c_library import load_library
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
SETS = (
    "everything, watched", "two solenoids, play", "two solenoids, no transition", "one solenoid alone",
    "one solenoid, turned, live zero, dither", "one solenoid, no transition, latch", "quick ramps, small error",
)  # fmt: skip


class Form:
    """A drive of one form at rest, and its block where it has one."""

    def __init__(self, sources, *block) -> None:
        self._library, self._block, self.state = load_library(sources, "the drive"), block, Drive()
        self._library.dz_drive_init(*self._block, ctypes.byref(self.state))

    def sample(self, codes) -> bytes:
        self._library.dz_drive_sample(*self._block, ctypes.byref(self.state), *map(ctypes.c_uint16, codes))
        return bytes(self.state)

    def tick(self) -> bytes:
        self._library.dz_drive_tick(*self._block, ctypes.byref(self.state))
        return bytes(self.state)


def forms(compensator, edit=lambda block: block) -> tuple[Form, Form]:
    files = generate(compensator, "f28335").files
    fixed = {path.removeprefix("core/"): text for path, text in files.items() if path.startswith("core/")}
    octets = pack(edit(block_of(compensator, "0" * 64)))
    block = ctypes.create_string_buffer(octets, len(octets))
    return Form(fixed), Form(texts(block_core_files(built_for(compensator))), block)


def first_difference(pair, samples) -> str:
    """Run both, two ticks a sample; the first step after which a bit of their states differs."""
    for number, codes in enumerate(samples):
        if len({form.sample(codes) for form in pair}) > 1:
            return f"sample {number} {codes}"
        if any(len({form.tick() for form in pair}) > 1 for _ in range(2)):
            return f"a tick after sample {number} {codes}"
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_the_drive_does_what_the_fixed_form_does(name):
    compensator = compensator_named(name)
    assert not first_difference(forms(compensator), drive_samples(compensator, seed=5, count=4000))


@pytest.mark.parametrize(
    "wrong",
    [
        {"leave_zero": 200}, {"zero_band": 30}, {"fault_samples": 2}, {"fault_latch": 0}, {"interlock": 65535},
        {"ramps": 0}, {"dither_counts": 601}, {"dither_ticks": 7}, {"compare_limit": 12000}, {"play_codes": 8},
    ],
)  # fmt: skip
def test_a_wrong_number_of_the_drive_is_seen(wrong):
    compensator = compensator_named("everything, watched")
    pair = forms(compensator, lambda block: replace(block, **wrong))
    assert first_difference(pair, drive_samples(compensator, seed=5, count=2000))


@pytest.mark.slow
def test_the_drive_follows_its_model_in_every_state(tmp_path):
    compensator = variant("play", "wide")
    assert drive_follows(block_folder(compensator, tmp_path / "fw"), compensator).holds


@pytest.mark.parametrize("loop", [PLAIN, replace(PLAIN, supply=SUPPLY)], ids=["supply unknown", "supply measured"])
def test_the_current_controller_is_the_exact_one_in_every_state(loop, tmp_path):
    compensator = variant("default", "wide")
    built = replace(built_for(compensator), shape=8 + 16 * bool(loop.supply), samples=loop.samples)
    block = replace(block_of(compensator, "0" * 64), shape=built.shape, current=current_block(loop))
    (tmp_path / "core").mkdir()
    for name, text in texts(block_core_files(built)).items():
        (tmp_path / "core" / name).write_text(text, encoding="utf-8")
    (tmp_path / "calibration.bin").write_bytes(pack(block))
    found = check_states(loop, read_controller(tmp_path), 60_000)
    assert found.wrong == 0 and found.states > 60_000, found.first
    gain = replace(block, current=replace(block.current, integral=block.current.integral + 1))
    (tmp_path / "calibration.bin").write_bytes(pack(gain))
    assert check_states(loop, read_controller(tmp_path), 2_000).wrong
