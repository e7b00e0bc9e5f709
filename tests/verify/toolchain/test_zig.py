"""Without any C compiler on the path, the wheel `ziglang` serves: verify runs to its end, and holds."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from dzdesign.verify.toolchain import host_compiler
from dzdesign.verify.toolchain.host_compiler import LIKE_OTHERS, environment, find_compilers, find_zig, words_of
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


@needs_zig
def test_what_is_undefined_builds_no_trap(no_compiler, tmp_path):
    """Zig's own default traps where nothing is optimized: gcc and clang do not, and neither must the check."""
    (tmp_path / "shift.c").write_text("int f(int a); int f(int a) { return a << 40 << a; }\n")

    def assembly(*words):
        subprocess.run([*words, "-w", "-S", "shift.c", "-o", "f.s"], cwd=tmp_path, check=True, env=environment())
        return (tmp_path / "f.s").read_text()

    assert "ubsan" in assembly(find_zig(), "cc")  # its default, or this test shows nothing
    ours = assembly(*words_of(find_zig()))
    assert "f:" in ours and "ubsan" not in ours


@pytest.mark.slow
@needs_zig
def test_verify_holds_without_a_compiler_on_the_path(firmware_folder, tmp_path):
    nothing = tmp_path / "nothing"
    nothing.mkdir()
    environment = {**os.environ, "PATH": str(nothing)}
    environment.pop("CC", None)
    code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, "verify", str(firmware_folder), "-o", str(tmp_path / "evidence"), "--json"],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    # Every command at each difference of two sound pressures, 688 to 4014.
    (inputs,) = document["inputs"]
    assert document["holds"] and inputs["wrong"] == 0 and inputs["inputs"] == 4096 * (2 * (4014 - 688) + 1)
    strict = next(check for check in document["checks"] if check["name"] == "compiles without warnings")
    assert strict["text"].endswith("-Werror: zig")
