"""Every generated header in a program of C++: its functions keep their names, and the core links and runs."""

import re
import shutil
import subprocess

import pytest

from dzdesign.codegen.project import TARGET_NAMES, generate
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.paths import TESTS

pytestmark = pytest.mark.skipif(not shutil.which("g++"), reason="no g++ on the path; apt install g++")
DECLARED = re.compile(r"^(?!static)[\w ]+?[ *](dz_\w+)\([^;{]*\);", re.MULTILINE)
FORMS = [*((name, "fixed") for name in TARGET_NAMES), ("f28335", "block"), ("host", "block")]


def written(target, form, folder):
    """Write a firmware, with everything switched on where there is such a golden; return its headers."""
    root = GOLDENS if target == "f280049c" else FULL
    made = generate(golden_compensator(target, root), target, calibration=form)
    for name, text in made.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    # The valve's numbers are for the C of the core alone: it is no header for callers.
    return {name: text for name, text in made.files.items() if name.endswith(".h") and "dz_valve" not in name}


def run(*command, cwd):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(("target", "form"), FORMS)
def test_every_function_of_every_header_keeps_its_name(target, form, tmp_path):
    headers = written(target, form, tmp_path)
    device = TESTS / "support" / target
    folders = [f"-I{tmp_path / name}" for name in sorted({name.partition("/")[0] for name in headers})]
    names = {name for text in headers.values() for name in DECLARED.findall(re.sub(r"/\*.*?\*/", "", text, flags=re.S))}
    assert {"dz_comp", "dz_status", "dz_drive_tick"} <= names and len(names) > 8
    lines = [f'#include "{name.rpartition("/")[2]}"' for name in sorted(headers)]
    lines += ["typedef void (*any)();", "extern any const all[];", "any const all[] = {"]
    lines += [f"    reinterpret_cast<any>(&{name})," for name in sorted(names)] + ["};"]
    (tmp_path / "all.cpp").write_text("\n".join(lines) + "\n")
    include = [*folders, *([f"-I{device}"] if device.is_dir() else [])]
    strict = ("-std=c++11", "-Wall", "-Wextra", "-Werror", "-Dinterrupt=", "-D__interrupt=")
    run("g++", *strict, *include, "-c", "all.cpp", cwd=tmp_path)
    assert {line.split()[-1] for line in run("nm", "-u", "all.o", cwd=tmp_path).splitlines()} == names


@pytest.mark.parametrize("form", ["fixed", "block"])
def test_the_core_links_with_a_program_of_cpp(form, tmp_path):
    written("host", form, tmp_path)
    block = "&dz_block, " if form == "block" else ""
    include = '#include "dz_block.h"\n' if block else ""
    (tmp_path / "main.cpp").write_text(
        f'{include}#include "dz_drive.h"\n#include <cstdio>\nint main()\n{{\n    dz_drive drive;\n'
        f"    dz_drive_init({block}&drive);\n    dz_drive_sample({block}&drive, 3000, 2400, 1500);\n"
        f"    dz_drive_tick({block}&drive);\n"
        f'    std::printf("%u\\n", unsigned(dz_comp({block}3000, 2400, 1500)));\n}}\n'
    )
    sources = [str(path) for path in sorted((tmp_path / "core").glob("*.c"))]
    sources += [str(tmp_path / "host" / "dz_block.c")] if block else []
    folders = [f"-I{tmp_path / name}" for name in ("core", "host")]
    run("gcc", "-std=c99", *folders, "-c", *sources, cwd=tmp_path)
    run("g++", *folders, "main.cpp", *(str(path) for path in sorted(tmp_path.glob("*.o"))), "-o", "main", cwd=tmp_path)
    compensator = golden_compensator("host", FULL)
    expected = compensator.compare(3000, compensator.signals.pair(1).difference(2400, 1500), 1)
    assert int(run("./main", cwd=tmp_path)) == expected
