"""Drive functions and current controller: with a block they follow their models, and a wrong number is seen."""

import ctypes
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.block import block_of, current_block
from dzdesign.codegen.calibration.built_for import built_for
from dzdesign.codegen.calibration.files import block_core_files, texts
from dzdesign.codegen.calibration.packing import pack
from dzdesign.verify.current.controller_states import check_states
from dzdesign.verify.current.current_checks import read_controller
from dzdesign.verify.exhaustive.drive_check import drive_follows, drive_samples
from tests.codegen.core.test_drive import Drive, compensator_named
from tests.support.block_cores import block_folder
from tests.support.c_library import load_library
from tests.support.core_variants import variant
from tests.support.current_loops import PLAIN, SUPPLY
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


class DriveOfBlock:
    """A drive at rest."""

    def __init__(self, library, block) -> None:
        octets = pack(block)
        self._library, self._block, self.state = library, ctypes.create_string_buffer(octets, len(octets)), Drive()
        self._library.dz_drive_init(self._block, ctypes.byref(self.state))

    def step(self, codes) -> list[bytes]:
        """A sample and two ticks; the states after each."""
        states = []
        self._library.dz_drive_sample(self._block, ctypes.byref(self.state), *map(ctypes.c_uint16, codes))
        for _ in range(2):
            states.append(bytes(self.state))
            self._library.dz_drive_tick(self._block, ctypes.byref(self.state))
        return [*states, bytes(self.state)]


@pytest.mark.parametrize(
    "wrong",
    [
        {"leave_zero": 200}, {"zero_band": 30}, {"fault_samples": 2}, {"fault_latch": 0}, {"interlock": 65535},
        {"ramps": 0}, {"dither_counts": 601}, {"dither_ticks": 7}, {"compare_limit": 12000}, {"play_codes": 8},
    ],
)  # fmt: skip
def test_a_wrong_number_of_the_drive_is_seen(wrong):
    compensator = compensator_named("everything, watched")
    library = load_library(texts(block_core_files(built_for(compensator))), "the drive")
    block = block_of(compensator, "0" * 64)
    right, other = DriveOfBlock(library, block), DriveOfBlock(library, replace(block, **wrong))
    samples = drive_samples(compensator, seed=5, count=2000)
    assert any(right.step(codes) != other.step(codes) for codes in samples)


@pytest.mark.slow
def test_the_drive_follows_its_model_in_every_state(tmp_path):
    compensator = variant("play")
    assert drive_follows(block_folder(compensator, tmp_path / "fw"), compensator).holds


@pytest.mark.parametrize("loop", [PLAIN, replace(PLAIN, supply=SUPPLY)], ids=["supply unknown", "supply measured"])
def test_the_current_controller_is_the_exact_one_in_every_state(loop, tmp_path):
    compensator = variant("default")
    built = replace(built_for(compensator), shape=8 + 16 * bool(loop.supply), samples=loop.samples)
    block = replace(block_of(compensator, "0" * 64), shape=built.shape, current=current_block(loop))
    (tmp_path / "core").mkdir()
    for name, text in texts(block_core_files(built)).items():
        (tmp_path / "core" / name).write_text(text, encoding="utf-8")
    (tmp_path / "calibration.bin").write_bytes(pack(block))
    found, _ = check_states(loop, read_controller(tmp_path), 60_000)
    assert found.wrong == 0 and found.states > 60_000, found.first_wrong
    gain = replace(block, current=replace(block.current, integral=block.current.integral + 1))
    (tmp_path / "calibration.bin").write_bytes(pack(gain))
    assert check_states(loop, read_controller(tmp_path), 2_000)[0].wrong
