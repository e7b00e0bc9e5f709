"""Every target's files against the goldens, which are compiled and, where there is a simulator, run.

After a change that is meant: `make goldens`, and read the diff before you commit it.
"""

import ctypes
import re
import shutil
import subprocess
import sys

import pytest

from dzdesign.codegen.host.target import EXPORTS
from dzdesign.codegen.project import TARGET_NAMES
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.toolchain.host_compiler import STRICT
from tests.support.drive_model import walked_line
from tests.support.golden_firmware import (
    FULL,
    FULL_TARGETS,
    GOLDENS,
    INPUT,
    differences,
    golden_compensator,
    golden_files,
    update,
)
from tests.support.grid_hash import GRID, SAMPLE, exact_line
from tests.support.paths import DEVICES

WARNINGS = " ".join(("-O2", *STRICT[1:]))


def needs(*tools: str, package: str = ""):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    return pytest.mark.skipif(bool(missing), reason=f"no {', '.join(missing)} on the path; apt install {package}")


needs_avr = needs("avr-gcc", "simavr", "make", package="gcc-avr avr-libc simavr make")
needs_arm = needs(
    "arm-none-eabi-gcc",
    "qemu-system-arm",
    "make",
    package="gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm make",
)
COMPILERS = [
    pytest.param("gcc", marks=needs("gcc", package="gcc")),
    pytest.param("clang", marks=needs("clang", package="clang")),
]
CROSS_COMPILERS = [
    *COMPILERS,
    pytest.param("avr-gcc -mmcu=atmega1280 -Os", marks=needs("avr-gcc", package="gcc-avr avr-libc")),
    pytest.param(
        "arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb",
        marks=needs("arm-none-eabi-gcc", package="gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    ),
]


@pytest.fixture(scope="session", autouse=True)
def goldens(request):
    if request.config.getoption("--update-goldens"):
        update()
    return GOLDENS


@pytest.fixture
def copy(tmp_path):
    """A target's goldens in a folder to build in."""

    def copied(target: str):
        return shutil.copytree(GOLDENS / target, tmp_path / target)

    return copied


def run(*command: str, cwd, timeout: float = 300) -> str:
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, timeout=timeout, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def lines_of_selftest(text: str) -> list[str]:
    """The lines of the self-test; simavr adds colour codes and a dot."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return [line.rstrip(".") for line in plain.splitlines() if re.match("dz_(comp|drive) ", line)]


#: Every golden folder: the root of its set, and its target.
EVERY = [*((GOLDENS, target) for target in TARGET_NAMES), *((FULL, target) for target in FULL_TARGETS)]


@pytest.mark.parametrize(("root", "target"), EVERY)
def test_the_same_input_gives_the_same_bytes(root, target):
    said = differences(root / target, golden_files(target, root))
    assert not said, f"{said}\nIf that is meant: pytest tests/codegen/test_goldens.py --update-goldens"


def test_there_is_no_golden_of_a_target_that_is_gone():
    for root, names in ((GOLDENS, TARGET_NAMES), (FULL, FULL_TARGETS)):
        assert sorted(path.name for path in root.iterdir() if path.is_dir() and path.name != "schemas") == sorted(names)


def test_a_difference_is_shown_by_file_and_line(copy):
    folder, files = copy("host"), golden_files("host")
    header = folder / "core" / "dz_calibration.h"
    header.write_text(header.read_text().replace("DZ_COMPARE_MAX 60000u", "DZ_COMPARE_MAX 60001u"))
    (folder / "host" / "README.md").unlink()
    (folder / "host" / "notes.txt").touch()
    said = differences(folder, files)
    assert "--- golden host/core/dz_calibration.h" in said and "+#define DZ_COMPARE_MAX 60000u" in said
    assert "host/host/README.md: no golden" in said and "host/host/notes.txt: a golden that is not generated" in said


@pytest.mark.parametrize("compiler", CROSS_COMPILERS)
@pytest.mark.parametrize(("root", "target"), EVERY)
def test_core_and_self_test_compile_strictly(root, target, compiler, tmp_path):
    folder = root / target
    sources = [*folder.glob("core/*.c"), *folder.glob("*/dz_selftest.c")]
    self_test = {"dz_selftest.c"} if target in ("cortex-m4", "host") else set()
    assert {source.name for source in sources} == {"dz_comp.c", "dz_drive.c"} | self_test
    for source in sources:
        include = [f"-I{folder / 'core'}", f"-I{source.parent}"]
        run(*compiler.split(), *STRICT, *include, "-c", str(source), "-o", "one.o", cwd=tmp_path)


@pytest.mark.parametrize("compiler", [*COMPILERS, CROSS_COMPILERS[2]])
@pytest.mark.parametrize(("root", "target"), [(GOLDENS, "f28335"), (FULL, "f28335"), (GOLDENS, "f280049c")])
def test_firmware_of_the_c2000_compiles_strictly_with_the_real_core(root, target, compiler, tmp_path):
    """Against the stand-ins for TI's headers; avr-gcc because its int has 16 bits, as TI's."""
    folder = root / target
    include = [f"-I{path}" for path in (folder / "core", folder / target, DEVICES / target)]
    sources = sorted((folder / target).glob("*.c"))
    assert len(sources) >= 2
    for source in sources:
        run(*compiler.split(), *STRICT, *include, "-c", str(source), "-o", "one.o", cwd=tmp_path)


def test_host_library_shows_four_names_and_answers_as_the_law(copy):
    make = shutil.which("make") or pytest.skip("no make on the path; apt install make")
    folder = copy("host") / "host"
    run(make, f"CFLAGS={WARNINGS}", "all", cwd=folder)
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    library = ctypes.CDLL(str(next(folder.glob(f"*.{suffix}"))))
    for function in (library.dz_comp, library.dz_compare_max, library.dz_adc_code_max):
        function.restype = ctypes.c_uint16
    compensator = golden_compensator("host")
    assert library.dz_compare_max() == compensator.signals.compare_max
    assert library.dz_adc_code_max() == compensator.signals.code_max
    inputs = [(0, 764, 764), (1, 4000, 764), (2047, 1500, 1000), (4095, 900, 850), (3000, 764, 4000)]
    expected = [compensator.compare(u, p_a - p_b) for u, p_a, p_b in inputs]
    assert [library.dz_comp(*codes) for codes in inputs] == expected
    arrays = [(ctypes.c_uint16 * len(inputs))(*column) for column in zip(*inputs, strict=True)]
    answers = (ctypes.c_uint16 * len(inputs))()
    library.dz_comp_many(*arrays, answers, ctypes.c_size_t(len(inputs)))
    assert list(answers) == expected
    if sys.platform == "linux" and (nm := shutil.which("nm")):
        shown = run(nm, "-D", "--defined-only", str(next(folder.glob("*.so"))), cwd=folder)
        assert sorted(line.split()[-1] for line in shown.splitlines()) == sorted(EXPORTS)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_host_prints_the_hash_of_the_exact_law(copy, compiler):
    make = shutil.which("make") or pytest.skip("no make on the path; apt install make")
    printed = run(make, f"CC={compiler}", f"CFLAGS={WARNINGS}", "check", cwd=copy("host") / "host")
    lines = lines_of_selftest(printed)
    assert lines[0] == exact_line(golden_compensator("host"), SAMPLE)
    assert len(lines) == 3 and lines[1].startswith(f"dz_comp {GRID[0]} ")
    assert lines[2] == walked_line(golden_compensator("host"))


@needs("cmake", package="cmake")
@pytest.mark.slow
def test_host_builds_with_cmake_in_a_folder_with_a_blank(tmp_path):
    folder = shutil.copytree(GOLDENS / "host", tmp_path / "a folder") / "host"
    run("cmake", "-S", ".", "-B", "build", cwd=folder)
    run("cmake", "--build", "build", cwd=folder)
    printed = run("ctest", "--test-dir", "build", "-V", cwd=folder)
    assert exact_line(golden_compensator("host"), SAMPLE) in printed


@needs_arm
def test_cortex_m4_in_qemu_prints_the_hashes_of_the_host(copy):
    host = lines_of_selftest(run("make", "check", cwd=copy("host") / "host"))
    folder = copy("cortex-m4") / "cortex_m4"
    run("make", f"CFLAGS={WARNINGS}", "all", cwd=folder)
    printed = run("make", f"CFLAGS={WARNINGS}", "check", cwd=folder)
    assert lines_of_selftest(printed) == host
    assert "dz_tick: 35 interrupts, compare values of dz_drive_tick()" in printed


@needs_arm
@pytest.mark.slow
def test_everything_switched_on_in_qemu_prints_the_hash_of_the_model(tmp_path):
    folder = shutil.copytree(FULL / "cortex-m4", tmp_path / "fw") / "cortex_m4"
    run("make", f"CFLAGS={WARNINGS}", "all", cwd=folder)
    printed = run("make", f"CFLAGS={WARNINGS}", "check", cwd=folder)
    assert walked_line(golden_compensator("cortex-m4", FULL)) in lines_of_selftest(printed)
    assert "dz_tick: 31 interrupts, compare values of dz_drive_tick()" in printed


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.slow
def test_everything_switched_on_is_exact_on_all_inputs(sign, tmp_path):
    shutil.copytree(FULL / "f28335", tmp_path / "fw")
    shutil.copy(FULL / INPUT, tmp_path / "fw" / INPUT)
    result = check_all_inputs(tmp_path / "fw", sign)
    assert result.holds and result.wrong == 0 and result.over_compensated == 0


@needs_arm
def test_a_tick_that_writes_nothing_fails_in_qemu(copy):
    folder = copy("cortex-m4") / "cortex_m4"
    source = folder / "dz_tick.c"
    text = source.read_text()
    assert "    dz_board_write_compare(drive.compare_a, drive.compare_b);\n" in text
    source.write_text(text.replace("    dz_board_write_compare(drive.compare_a, drive.compare_b);\n", ""))
    with pytest.raises(AssertionError, match="wrong compare value"):
        run("make", "check", cwd=folder)
