"""A compiler that $CC names may be no compiler: that is said, and gives no green light."""

import pytest

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.toolchain.host_compiler import built, environment, find_compilers
from dzdesign.verify.toolchain.machines import HOST
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
SOURCES = {"one.c": b"int one(void) { return 1; }\n"}


@pytest.fixture
def of_words(monkeypatch):
    """Have $CC name the machine's first compiler, with further words."""
    first = find_compilers()[0]

    def set_them(words):
        monkeypatch.setenv("CC", words.format(cc=first))

    return set_them


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("/nonexistent", "no such program"),
        ("no-such-program -x", "no such program"),
        ('{cc} "', "No closing quotation"),
    ],
)
def test_what_is_no_compiler_is_named_and_not_blamed_on_the_firmware(of_words, words, reason):
    of_words(words)
    with pytest.raises(InputError, match=rf"^\$CC is .*{reason}"):
        HOST.compile("one.c", SOURCES, HOST.core_flags, "the core")


def test_a_compiler_that_writes_nothing_is_named():
    with pytest.raises(RequirementError, match=r"was not compiled: .* wrote nothing; set \$CC"):
        built("one.o", ["true", "-c", "one.c"], SOURCES, "the core")


@pytest.mark.parametrize("variable", ["CPATH"])
def test_headers_that_the_environment_puts_before_the_compilers_have_no_say(tmp_path, monkeypatch, variable):
    (tmp_path / "stdint.h").write_text("#error another header\n")
    monkeypatch.setenv(variable, str(tmp_path))
    source = {"two.c": f"#include <stdint.h>\nuint16_t {variable}(void);\n".encode()}
    assert HOST.compile("two.c", source, HOST.core_flags, "C").is_file()
    assert variable not in environment() and "PATH" in environment()
