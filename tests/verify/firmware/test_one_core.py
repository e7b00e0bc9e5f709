"""The core's C is one for all compilers: a fault that only another one would read is found by reading."""

import json

import pytest

from dzdesign.verify.firmware.one_core import NAME, seen_by_all
from dzdesign.verify.requirements import ALWAYS
from tests.support.paths import TESTS

ROOT = TESTS
FOLDERS = sorted(path.parent for path in ROOT.glob("goldens*/*/core"))


def core_of(folder):
    return {"core": sorted(f"core/{path.name}" for path in (folder / "core").iterdir())}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_every_generated_core_is(folder):
    check = seen_by_all(folder, core_of(folder))
    assert check.holds, check.text
    assert check.name in ALWAYS and check.name == NAME


@pytest.mark.parametrize(
    "line",
    [
        "#ifdef __TMS320C28XX__\n#endif",
        "#if 1\n#endif",
        "  #  if DZ_COMPARE_MAX\n#endif",
        "# /* a comment */ if 1\n#endif",
        "??=if 1\n??=endif",
        "%:if 1\n%:endif",
        "#\\\nif 1\n#endif",
        "#pragma inline",
        '_Pragma("inline")',
        "#include <limits.h>",
        '#include "dz_other.h"',
        "#define dz_comp another",
        "#define OTHER(x) x",
        "#undef DZ_COMPARE_MAX",
        "typedef char t[sizeof(int)];",
        "enum { N = UINTPTR_MAX > 65535u };",
        "enum { N = INT_FAST16_MAX > 32767 };",
        "enum { N = SIZE_MAX > 65535u };",
        "static uint_fast16_t n;",
        "enum { N = __LINE__ };",
        "/* a comment */ #if 1\n#endif",
        "// \\\n#if 1\n#endif",
        'extern const char s[]; /* " */ static const char q = \'"\'; /* " */\n#if 1\n#endif',
    ],
)
def test_what_another_compiler_would_read_differently_is_found(firmware_folder, line):
    manifest = json.loads((firmware_folder / "manifest.json").read_text())
    for name in ("core/dz_comp.c", "core/dz_drive.h"):
        path = firmware_folder / name
        text = path.read_text()
        place = text.rindex("#endif") if name.endswith(".h") else len(text)
        path.write_text(f"{text[:place]}{line}\n{text[place:]}")
        check = seen_by_all(firmware_folder, manifest)
        path.write_text(text)
        assert check.holds is False and check.text.startswith(f"{name}: line "), check.text
    assert seen_by_all(firmware_folder, manifest).holds


def test_a_comment_may_say_anything(firmware_folder):
    manifest = json.loads((firmware_folder / "manifest.json").read_text())
    path = firmware_folder / "core/dz_comp.c"
    path.write_text(path.read_text() + '/* #if "sizeof" __x86_64__\n#endif */\n')
    assert seen_by_all(firmware_folder, manifest).holds
