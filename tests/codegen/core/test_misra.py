"""MISRA C:2012 by cppcheck's addon over the generated core; what it finds must be said in the file's banner.

The core is held to it, in every form that its options give it; the targets' hardware files are not.
"""

import re
import shutil
import subprocess

import pytest

from tests.support.core_variants import NAMES, core_files

#: avr8 is the platform that cppcheck knows with an `int` of 16 bits, as TI's.
CPPCHECK = ("cppcheck", "--platform=avr8", "--std=c99", "--addon=misra", "--enable=style", "-q")
FINDING = "--template={file}:{line}:{id}"

pytestmark = pytest.mark.skipif(
    shutil.which("cppcheck") is None, reason="no cppcheck on the path; apt install cppcheck"
)


def findings(folder) -> list[tuple[str, str, str]]:
    """File, rule and the line of text of each finding in a folder's C that the file's banner does not justify."""
    sources = sorted(str(path) for path in folder.glob("*.c"))
    done = subprocess.run([*CPPCHECK, FINDING, *sources], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0 and sources, done.stderr
    found = []
    for line in done.stderr.splitlines():
        place = re.fullmatch(r"(.+):(\d+):([\w.-]+)", line)
        if place is None:
            continue  # a note that belongs to the finding above it
        path, number, name = place.groups()
        text = (folder / path).read_text().splitlines() if path != "nofile" else [line]
        shown = text[max(int(number) - 1, 0)]
        if (name.removeprefix("misra-c2012-"), symbol_of(shown)) not in justified("\n".join(text)):
            found.append((path.rpartition("/")[2], name, shown))
    return found


def symbol_of(line: str) -> str | None:
    found = re.match(r"#define (\w+)|static const struct \w+ (\w+) =", line)
    return found and (found[1] or found[2])


def justified(text: str) -> set[tuple[str, str]]:
    """Rule and symbol of every deviation that a banner states."""
    opening = " ".join(text.partition("#i")[0].replace("\n * ", " ").split())
    stated = re.findall(r"deviation from rule ([\d.]+) \(\w+\) in ([\w, ]+): \w", opening)
    return {(rule, symbol) for rule, symbols in stated for symbol in symbols.split(", ")}


def written(folder, name: str):
    for path, text in core_files(name):
        (folder / path).write_text(text)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_form_of_the_core_is_clean(name, tmp_path):
    assert findings(written(tmp_path, name)) == []


SEEDED = {
    "5.9": ("dz_drive.c", "is_negative", "below_zero"),
    "7.2": ("dz_comp.c", "#define LARGEST_SHIFT 31u", "#define LARGEST_SHIFT 0xFFFF"),
    "10.8": ("dz_comp.c", "(int64_t)number(left) * number(right)", "(int64_t)(left * right)"),
    "15.6": ("dz_drive.c", "    drive->faulty_pressures = 0u;\n}", "    if (drive->law == 0u) drive->side = 0;\n}"),
    "2.5": ("dz_comp.c", "#define LARGEST_SHIFT", "#define NOBODY 1u\n#define LARGEST_SHIFT"),
}


@pytest.mark.slow
@pytest.mark.parametrize("rule", SEEDED)
def test_a_seeded_violation_is_found(rule, tmp_path):
    file, right, wrong = SEEDED[rule]
    source = written(tmp_path, "bipolar") / file
    text = source.read_text()
    assert right in text
    source.write_text(text.replace(right, wrong))
    assert f"misra-c2012-{rule}" in [name for _, name, _ in findings(tmp_path)]


def test_a_deviation_without_its_justification_is_found(tmp_path):
    header = written(tmp_path, "default") / "dz_calibration.h"
    text = header.read_text()
    assert "deviation from rule 2.5 (advisory) in DZ_COMPARE_MAX, " in text
    header.write_text(text.replace("in DZ_COMPARE_MAX, ", "in "))
    assert [(file, name) for file, name, _ in findings(tmp_path)] == [("dz_calibration.h", "misra-c2012-2.5")]
