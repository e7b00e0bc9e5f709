"""Without any C compiler on the path, the wheel `ziglang` serves: verify runs to its end, and holds."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.compilation import compiles_strictly
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.folder import read_compensator, read_firmware_manifest
from dzdesign.verify.toolchain import host_compiler
from dzdesign.verify.toolchain.host_compiler import LIKE_OTHERS, find_compilers, words_of
from dzdesign.verify.toolchain.machines import HOST

needs_zig = pytest.mark.skipif(
    not importlib.util.find_spec("ziglang"), reason="no Zig (pip install ziglang) in this environment"
)
SOURCE = {"f.c": b"int f(int a);\nint f(int a) { return (a << 3) / 7; }\n"}


@pytest.fixture
def no_compiler(tmp_path, monkeypatch):
    """A path that holds nothing."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)


@needs_zig
def test_zig_is_the_last_resort(no_compiler, monkeypatch):
    compilers = find_compilers()
    assert [Path(each).stem for each in compilers] == ["zig"] and words_of(compilers[0])[1] == "cc"
    monkeypatch.undo()
    if any(Path(each).stem != "zig" for each in find_compilers()):
        assert not any(Path(each).stem == "zig" for each in find_compilers())


def test_cc_may_be_several_words(tmp_path, monkeypatch):
    for name in ("ccache", "gcc", "zig"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "ccache gcc -m64")
    assert find_compilers() == ("ccache gcc -m64", str(tmp_path / "gcc"))
    assert words_of("ccache gcc -m64") == ("ccache", "gcc", "-m64")
    assert words_of("ccache zig cc") == ("ccache", "zig", "cc", *LIKE_OTHERS)
    monkeypatch.delenv("CC")
    assert find_compilers() == (str(tmp_path / "gcc"),)


@needs_zig
def test_the_same_source_is_the_same_object_anywhere(no_compiler, tmp_path, monkeypatch):
    """Debug information would name the folder, and a cache in the working folder would leave one there."""
    found = []
    for name in ("one", "another"):
        (tmp_path / name).mkdir()
        monkeypatch.setattr(host_compiler, "build_folder", lambda name=name: tmp_path / name)
        monkeypatch.chdir(tmp_path)
        found.append(HOST.compile("f.c", SOURCE, HOST.core_flags, "f").read_bytes())
    assert found[0] == found[1]
    assert str(tmp_path).encode() not in found[0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["another", "one"]


@pytest.mark.slow
@needs_zig
def test_every_input_and_the_closed_loop_run_without_a_compiler_on_the_path(no_compiler, firmware_folder):
    compensator = read_compensator(firmware_folder)
    inputs = check_all_inputs(firmware_folder)
    # Every command at each difference of two sound pressures, 688 to 4014.
    assert inputs.holds and inputs.wrong == 0 and inputs.inputs == 4096 * (2 * (4014 - 688) + 1)
    strict = compiles_strictly(firmware_folder, read_firmware_manifest(firmware_folder))
    assert strict.holds and strict.text.endswith("-Werror: zig")
    run = scenes_of(firmware_folder, compensator, None)[0].loop.run(np.linspace(0, 1, 5000), 1.0)
    assert run.q_L_min.max() > 1
