"""Every target's files against the goldens, which are compiled and, where there is a simulator, run.

After a change that is meant: `make goldens`, and read the diff before you commit it.
"""

import ctypes
import re
import shutil
import subprocess
import sys

import pytest

from dzdesign.codegen.target import folder_of
from dzdesign.verify.hardware.model import HERE as MODELS
from dzdesign.verify.toolchain.host_compiler import STRICT
from tests.support.drive_model import walked_line
from tests.support.golden_firmware import (
    FULL,
    GOLDENS,
    KEPT,
    differences,
    generated,
    golden_compensator,
    golden_files,
    update,
    write,
)
from tests.support.grid_hash import GRID, SAMPLE, exact_line

WARNINGS = " ".join(("-O2", *STRICT[1:]))


def needs(*tools: str, package: str = ""):
    missing = [tool for tool in tools if shutil.which(tool) is None]
    return pytest.mark.skipif(bool(missing), reason=f"no {', '.join(missing)} on the path; apt install {package}")


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
    """A target's files in a folder to build in."""

    def copied(target: str, root=GOLDENS):
        return write(tmp_path / target, generated(target, root))

    return copied


@pytest.fixture(scope="session")
def host_lines(tmp_path_factory):
    """What the self-test of the host prints."""
    return host_selftest(write(tmp_path_factory.mktemp("host"), generated("host")) / "host", "cc")


def run(*command: str, cwd, timeout: float = 300) -> str:
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, timeout=timeout, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def host_selftest(folder, compiler: str) -> list[str]:
    """What the self-test of the host prints."""
    sources = [*sorted(folder.parent.glob("core/*.c")), "dz_selftest.c", "selftest.c"]
    include = ["-I../core", "-I."]
    run(compiler, *WARNINGS.split(), *include, *map(str, sources), "-o", f"selftest_{compiler}", cwd=folder)
    return lines_of_selftest(run(f"./selftest_{compiler}", cwd=folder))


def lines_of_selftest(text: str) -> list[str]:
    """The lines of the self-test; simavr adds colour codes and a dot."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return [line.rstrip(".") for line in plain.splitlines() if re.match("dz_(comp|drive) ", line)]


@pytest.mark.parametrize(("root", "target"), KEPT)
def test_the_same_input_gives_the_same_bytes(root, target):
    found = differences(root / target, golden_files(target, root))
    assert not found, f"{found}\nIf that is meant: pytest tests/codegen/test_goldens.py --update-goldens"


def test_a_file_that_targets_share_stands_once_and_none_is_of_a_target_that_is_gone():
    for root in (GOLDENS, FULL):
        folders = {path.name for path in root.iterdir() if path.is_dir() and path.name != "schemas"}
        assert folders == {target for each, target in KEPT if each == root}
    core = {path: text for path, text in generated("cortex-m4", FULL).items() if path.startswith("core/")}
    assert len(core) == 6 and core.items() <= generated("f28335", FULL).items()


@pytest.mark.parametrize("compiler", CROSS_COMPILERS)
@pytest.mark.parametrize(("root", "target"), [(GOLDENS, "host"), (FULL, "cortex-m4")])
def test_core_and_self_test_compile_strictly(root, target, compiler, copy):
    folder = copy(target, root)
    sources = [*folder.glob("core/*.c"), *folder.glob("*/dz_selftest.c")]
    assert {source.name for source in sources} == {"dz_comp.c", "dz_drive.c", "dz_selftest.c"}
    include = [f"-I{folder / name}" for name in ("core", folder_of(target))]
    run(*compiler.split(), *STRICT, *include, "-c", *map(str, sources), cwd=folder)


@pytest.mark.parametrize("compiler", [*COMPILERS, CROSS_COMPILERS[2]])
@pytest.mark.parametrize(("root", "target"), [(FULL, "f28335"), (GOLDENS, "f280049c")])
def test_firmware_of_the_c2000_compiles_strictly_with_the_real_core(root, target, compiler, copy):
    """Against the stand-ins for TI's headers; avr-gcc because its int has 16 bits, as TI's."""
    folder = copy(target, root)
    include = [f"-I{path}" for path in (folder / "core", folder / target, MODELS / target)]
    sources = sorted((folder / target).glob("*.c"))
    assert len(sources) >= 2
    run(*compiler.split(), *STRICT, *include, "-c", *map(str, sources), cwd=folder)


@pytest.mark.skipif(sys.platform != "linux", reason="the README's command is that of Linux")
def test_host_library_shows_the_functions_of_its_headers_and_answers_as_the_law(copy):
    folder = copy("host") / "host"
    (command,) = re.findall(r"^    (cc .+)$", (folder / "README.md").read_text(), re.MULTILINE)
    run("sh", "-c", command, cwd=folder)
    library = ctypes.CDLL(str(folder / "libdz_comp.so"))
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
    assert library.dz_comp_many and library.dz_drive_tick and library.dz_status


@pytest.mark.parametrize("compiler", COMPILERS)
def test_host_prints_the_hash_of_the_exact_law(copy, compiler, host_lines):
    assert host_lines[0] == exact_line(golden_compensator("host"), SAMPLE)
    assert len(host_lines) == 3 and host_lines[1].startswith(f"dz_comp {GRID[0]} ")
    assert host_lines[2] == walked_line(golden_compensator("host"))
    assert host_selftest(copy("host") / "host", compiler) == host_lines


@needs("cmake", package="cmake")
@pytest.mark.slow
def test_host_builds_with_cmake_in_a_folder_with_a_blank(tmp_path):
    folder = write(tmp_path / "a folder", generated("host")) / "host"
    run("cmake", "-S", ".", "-B", "build", cwd=folder)
    run("cmake", "--build", "build", cwd=folder)
    printed = run("ctest", "--test-dir", "build", "-V", cwd=folder)
    assert exact_line(golden_compensator("host"), SAMPLE) in printed


@needs_arm
def test_cortex_m4_in_qemu_prints_the_hashes_of_the_host(copy, host_lines):
    folder = copy("cortex-m4") / "cortex_m4"
    run("make", f"CFLAGS={WARNINGS}", "all", cwd=folder)
    printed = run("make", f"CFLAGS={WARNINGS}", "check", cwd=folder)
    assert lines_of_selftest(printed) == host_lines
    assert "dz_isr: 35 interrupts, compare values of dz_drive_tick(); tripped without samples" in printed


@needs_arm
@pytest.mark.slow
def test_everything_switched_on_in_qemu_prints_the_hash_of_the_model(copy):
    folder = copy("cortex-m4", FULL) / "cortex_m4"
    run("make", f"CFLAGS={WARNINGS}", "all", cwd=folder)
    printed = run("make", f"CFLAGS={WARNINGS}", "check", cwd=folder)
    assert walked_line(golden_compensator("cortex-m4", FULL)) in lines_of_selftest(printed)
    assert "dz_isr: 31 interrupts, compare values of dz_drive_tick(); tripped without samples" in printed


@needs_arm
def test_a_tick_that_writes_nothing_fails_in_qemu(copy):
    folder = copy("cortex-m4") / "cortex_m4"
    source = folder / "dz_isr.c"
    text = source.read_text()
    assert "    dz_write_compare_a(drive.compare_a);\n" in text
    source.write_text(text.replace("    dz_write_compare_a(drive.compare_a);\n", ""))
    with pytest.raises(AssertionError, match="wrong compare value"):
        run("make", "check", cwd=folder)
