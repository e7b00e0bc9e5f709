"""Compiled code in a child process: data comes and goes as it is, and no end of it is one of dzdesign."""

import gc
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain import compiled_library
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function
from dzdesign.verify.toolchain.machines import HOST, numbers_in
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
TOP = "#include <stdint.h>\n#include <stdio.h>\n#include <stdlib.h>\n"
SUMS = """
static int64_t kept;

int64_t of_numbers(int16_t a, uint16_t b, int32_t c, uint32_t d, int64_t e)
{
    return kept + a + b + c + d + e;
}
uint16_t wrapped(uint16_t a)
{
    puts("what it prints is no answer");
    fflush(stdout);
    return (uint16_t)(a + 1u);
}
void keep(int64_t number)
{
    kept = number;
}
int32_t buffers(const double *given, double *zeros, int32_t *both, uint32_t count)
{
    int32_t wrong = given == NULL;
    for (uint32_t k = 0u; k < count; k++) {
        wrong += zeros[k] != 0.0;
        zeros[k] = given == NULL ? -1.0 : 2.0 * given[k];
        both[k] += 1;
    }
    return wrong;
}
"""
FUNCTIONS = (
    Function("of_numbers", ("int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t"), "int64_t"),
    Function("wrapped", ("uint16_t",), "uint16_t"),
    Function("keep", ("int64_t",)),
    Function("buffers", ("in", "out", "both", "uint32_t"), "int32_t"),
)


def sums():
    return CompiledLibrary({"sums.c": TOP + SUMS}, FUNCTIONS, "the sums")


def test_numbers_and_buffers_come_and_go_as_they_are():
    library = sums()
    assert library.call("of_numbers", -(2**15), 2**16 - 1, -(2**31), 2**32 - 1, -(2**62)) == (
        -(2**15) + 2**16 - 1 - 2**31 + 2**32 - 1 - 2**62
    )
    assert library.call("wrapped", 2**16 - 1) == 0
    given = np.arange(3_000_000.0).reshape(-1, 4)  # more than a pipe holds
    zeros, both = np.full(given.size, 7.0), np.arange(given.size, dtype=np.int32)
    assert library.call("buffers", given, zeros, both, given.size) == 0
    assert (zeros == 2 * given.ravel()).all() and (both == np.arange(1, given.size + 1)).all()
    assert library.call("buffers", given[:1].tobytes(), zeros[:4], both[:4], 4) == 0
    assert library.call("buffers", None, zeros, both, 200) == 1 and (zeros[:200] == -1).all()


def test_memory_stays_between_calls_and_is_the_librarys_own():
    one, other = sums(), sums()
    one.call("keep", 5)
    assert one.call("of_numbers", 0, 0, 0, 0, 0) == 5 and other.call("of_numbers", 0, 0, 0, 0, 0) == 0


def test_no_argument_is_taken_for_another():
    library, column = sums(), np.zeros((4, 2))[:, 0]
    for given in ((column, np.zeros(4), np.zeros(4, dtype=np.int32), 4), (None, column, np.zeros(4, np.int32), 4),
                  (None, b"1234", np.zeros(4, np.int32), 4), (None, None, None, 4.0)):  # fmt: skip
        with pytest.raises(TypeError):
            library.call("buffers", *given)
    with pytest.raises(ValueError, match="zip"):
        library.call("wrapped")


#: What code does, and the sentence that comes of it; a library's is the same but for what a child of Python adds.
ENDS = {
    "a loop that does not end": ("for (;;) {\n    }", "did not end within 1 s"),
    "an abort": ("abort();", r"ended with (signal 6 \(SIGABRT\)|exit status \d+)"),
    "a pointer to nothing": ("*(volatile int *)0 = 1;", r"ended with (signal 11 \(SIGSEGV\)|exit status \d+)"),
    "an exit of its own": ('fputs("no more", stderr); exit(7);', "ended with exit status 7: no more"),
}


@pytest.mark.parametrize("case", ENDS)
def test_any_end_is_one_sentence(case, monkeypatch):
    body, words = ENDS[case]
    monkeypatch.setattr(compiled_library, "CALL_S", 1.0)
    text = f"{TOP}int32_t answer(void)\n{{\n    {body}\n    return 42;\n}}\n"
    library = CompiledLibrary({"it.c": text}, [Function("answer", (), "int32_t")], "the core")
    for _ in range(2):  # it is not started again
        with pytest.raises(RequirementError, match=f"^the core {words}"):
            library.call("answer")
    main = {"it.c": text.encode(), "main.c": b"int answer(void);\nint main(void) { return answer(); }\n"}
    objects = [HOST.compile(name, main, ("-std=c99", "-O1"), "it") for name in main]
    with pytest.raises(RequirementError, match=f"^the core on the host {words}"):
        replace(HOST, run_timeout_s=1.0).run(HOST.link(objects, "it"), [], "the core")


def test_a_function_that_is_not_there_is_named():
    with pytest.raises(RequirementError, match=r"the sums ended with exit status 1: .*missing"):
        CompiledLibrary({"sums.c": TOP + SUMS}, [Function("missing")], "the sums").call("missing")
    with pytest.raises(RequirementError, match="the sums does not compile"):
        CompiledLibrary({"sums.c": "int"}, [], "the sums")


@pytest.mark.parametrize("printed", ["9" * 5000, "12345678901", "-1", "1.5", "1e3", "\u0661", "1 1 x", "\x00"])
def test_what_is_no_number_of_32_bits_is_left_out(printed):
    assert numbers_in(f"1 2\n{printed}\n3\n") == [[1, 2], [3]]


def wait_until_ended(pid):
    for _ in range(200):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    raise AssertionError("it still runs")


@pytest.mark.skipif(sys.platform == "win32", reason="a signal")
def test_it_ends_with_the_library():
    library = sums()
    library.call("wrapped", 1)
    pid = library._process.pid
    del library
    gc.collect()
    wait_until_ended(pid)


@pytest.mark.skipif(sys.platform == "win32", reason="a signal")
def test_it_ends_with_dzdesign_in_a_call_that_hangs():
    text = (
        "from dzdesign.verify.toolchain.compiled_library import CompiledLibrary, Function\n"
        "text = '#include <unistd.h>\\n#include <stdint.h>\\nint32_t stay(void) { for (;;) { sleep(99u); } }\\n'\n"
        "library = CompiledLibrary({'stay.c': text + 'int32_t none(void) { return 0; }\\n'},\n"
        "    [Function('none', (), 'int32_t'), Function('stay', (), 'int32_t')], 'it')\n"
        "library.call('none')\nprint(library._process.pid, flush=True)\nlibrary.call('stay')\n"
    )
    process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    pid = int(process.stdout.readline())
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    wait_until_ended(pid)
