"""Code of a folder that is asked to run, and does what it must not where dzdesign calls it: one sentence, no trace."""

import sys

import pytest

from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from dzdesign.verify import verification
from dzdesign.verify.toolchain import confined_library
from tests.support.attacked_firmware import edit
from tests.support.synthetic import needs_compiler
from tests.verify.toolchain.test_confinement import landlock

pytestmark = [needs_compiler, pytest.mark.skipif(sys.platform == "win32", reason="Windows limits the time alone")]
START = "void dz_drive_init(struct dz_drive *drive)\n{\n"
TOP = '#include <stdio.h>\n#include <stdlib.h>\n#include <unistd.h>\n#include "dz_drive.h"'
LOOP = "the closed loop"
#: What the drive's start does, and the end of the sentence.
ATTACKS = {
    "a loop that does not end": ("for (;;) {\n    }", "did not end within 3 s"),
    "an abort": ("abort();", "ended with signal 6"),
    "a good exit": ("exit(0);", "ended with exit status 0"),
    "a hundred gigabytes": (
        "for (int i = 0; i < 99; i++) {\n        volatile char *one = malloc(1000000000ul);\n"
        "        one[0] = 1;\n    }",
        "ended with signal 11",
    ),
    "another answer": (
        'for (int i = 0; i < 99; i++) {\n        write(i, "123456789012345678901234567890", 30u);\n    }',
        "answered with other data than a call returns",
    ),
}


@pytest.fixture
def drive_alone(monkeypatch):
    """Let `verify` take every check of the core as held, and go on to the closed loop."""
    monkeypatch.setattr(verification, "_try_core", lambda *_: verification._Core(checks=(), inputs=(None,)))
    monkeypatch.setattr(confined_library, "CALL_S", 3.0)


#: The others take as long.
QUICK = "an abort"


@pytest.mark.parametrize(
    "attack", [each if each == QUICK else pytest.param(each, marks=pytest.mark.slow) for each in ATTACKS]
)
def test_one_sentence_and_no_trace(attack, example_compensator, tmp_path, drive_alone, capfd):
    folder, mark = tmp_path / "firmware", tmp_path / "it_ran"
    write_firmware(generate(example_compensator, "f28335"), folder)
    body, end = ATTACKS[attack]
    opens = f'fopen("{mark.as_posix()}", "w");'
    edit(folder, "core/dz_drive.c", '#include "dz_drive.h"', TOP)
    edit(folder, "core/dz_drive.c", START, f'{START}    puts("garbage");\n    {opens}\n    {body}\n')
    first = f'__attribute__((constructor)) static void first(void)\n{{\n    puts("garbage");\n    {opens}\n}}\n\n'
    edit(folder, "core/dz_drive.c", START, first + START)
    assert main(["verify", str(folder), "-o", str(tmp_path / "evidence"), "--run-changed"]) == 1
    out, err = capfd.readouterr()
    sentence = " ".join(err[err.index("dzdesign: does not hold") :].split())
    assert sentence.startswith(f"dzdesign: does not hold: {LOOP} {end}") and "Traceback" not in err
    assert "garbage" not in out + err and not (tmp_path / "evidence").exists()
    assert not mark.exists() or not landlock()
