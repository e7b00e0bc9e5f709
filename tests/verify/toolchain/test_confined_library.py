"""C functions called as data in a process of their own: what they may not do, and that no end of it is dzdesign's."""

import gc
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain import confined_library, served_process
from dzdesign.verify.toolchain.confined_library import ConfinedLibrary, Function, calls_in_c
from tests.support.synthetic import needs_compiler
from tests.verify.toolchain.test_confinement import only_zombies, with_landlock

pytestmark = needs_compiler
TOP = """
#define _GNU_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
"""
SUMS = """
static int64_t kept;

int64_t of_numbers(int16_t a, uint16_t b, int32_t c, uint32_t d, int64_t e)
{
    return kept + a + b + c + d + e;
}
uint16_t wrapped(uint16_t a)
{
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


@pytest.fixture(params=[pytest.param(True, marks=pytest.mark.skipif(sys.platform == "win32", reason="no poll")), False])
def polls(request, monkeypatch):
    """Both ways to wait for a program: the one of POSIX, and that of Windows."""
    monkeypatch.setattr(served_process, "POLLS", request.param)
    return request.param


def sums():
    return ConfinedLibrary({"sums.c": TOP + SUMS}, FUNCTIONS, "the sums")


def test_numbers_and_buffers_come_and_go_as_they_are(polls):
    library = sums()
    assert library.call("of_numbers", -(2**15), 2**16 - 1, -(2**31), 2**32 - 1, -(2**62)) == (
        -(2**15) + 2**16 - 1 - 2**31 + 2**32 - 1 - 2**62
    )
    assert library.call("wrapped", 2**16 - 1) == 0
    given, zeros, both = (
        np.random.default_rng(1).normal(size=(50, 4)),
        np.full(200, 7.0),
        np.arange(200, dtype=np.int32),
    )
    assert library.call("buffers", given, zeros, both, 200) == 0
    assert (zeros == 2 * given.ravel()).all() and (both == np.arange(1, 201)).all()
    assert library.call("buffers", given.tobytes(), zeros, both, 200) == 0
    assert library.call("buffers", None, zeros, both, 200) == 1 and (zeros == -1).all()


def test_more_than_a_pipe_holds_goes_both_ways(polls):
    given = np.arange(3_000_000.0)
    zeros, both = np.empty_like(given), np.zeros(given.size, dtype=np.int32)
    assert sums().call("buffers", given, zeros, both, given.size) == 0
    assert (zeros == 2 * given).all() and both.all()


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
    with pytest.raises(KeyError):
        library.call("no_such_function")


def test_it_is_declared_as_it_is_called():
    assert "uint16_t wrapped(uint16_t);" in calls_in_c(FUNCTIONS)
    with pytest.raises(RequirementError, match=r"the sums does not compile: .*missing"):
        ConfinedLibrary({"sums.c": TOP + SUMS}, [Function("missing")], "the sums")


def hostile(body, top=""):
    """A library with one function, which does something that it must not."""
    text = f"{TOP}{top}\nint32_t answer(void)\n{{\n    {body}\n    return 42;\n}}\n"
    return ConfinedLibrary({"it.c": text}, [Function("answer", (), "int32_t")], "the core")


#: What a function does, and the sentence that comes of it.
ENDS = {
    "a loop that does not end": ("for (;;) {\n    }", r"^the core did not end within 2 s$"),
    "an abort": ("abort();", r"^the core ended with (signal 6|exit status \d+)$"),
    "a pointer to nothing": ("*(volatile int *)0 = 1;", r"^the core ended with (signal 11|exit status \d+)$"),
    "an exit of its own": ('fputs("no more", stderr); exit(7);', r"^the core ended with exit status 7: no more$"),
    "a good exit": ("exit(0);", r"^the core ended with exit status 0$"),
}
ON_POSIX = {
    "a hundred gigabytes": (
        "for (int i = 0; i < 100; i++) { volatile char *one = malloc(1000000000ul); one[0] = 1; }",
        r"^the core ended with signal 11$",
    ),
    "a file without an end": (
        "static char text[1 << 20]; for (int i = 0; i < 1 << 20; i++) { text[i] = '1'; }\n"
        "    for (;;) { (void)!write(2, text, sizeof text); }",
        r"^the core ended with signal 25: it reached the limit of what it may write: 1{200}$",
    ),
    "a pipe that is closed": ("for (int i = 0; i < 99; i++) { close(i); }\n    for (;;) { sleep(9u); }",
                              r"^the core (answers no longer, and has not ended|did not end within 2 s)$"),
    "a pipe that another process holds": (
        "if (fork() == 0) { setsid(); sleep(20u); }\n    exit(7);", r"^the core did not end within 2 s$"
    ),
    "another answer": (
        'for (int i = 3; i < 99; i++) { (void)!write(i, "123456789012345678901234567890", 30u); }',
        r"^the core answered with other data than a call returns: \d+ octets of call \d+, expected 0 of call 1$",
    ),
    "an answer that is too short": (
        'for (int i = 3; i < 99; i++) { (void)!write(i, "123", 3u); }\n    for (;;) { sleep(9u); }',
        r"^the core did not end within 2 s$",
    ),
}  # fmt: skip


def ends_with(case, monkeypatch):
    body, words = case
    monkeypatch.setattr(confined_library, "CALL_S", 2.0)
    library, begin = hostile(body), time.monotonic()
    for _ in range(2):  # it is not started again
        with pytest.raises(RequirementError, match=words):
            library.call("answer")
    assert time.monotonic() - begin < 15


@pytest.mark.parametrize("case", ENDS)
def test_any_end_is_one_sentence(case, monkeypatch, polls):
    ends_with(ENDS[case], monkeypatch)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits the time alone")
@pytest.mark.parametrize("case", ON_POSIX)
def test_limits_and_other_answers_are_one_too(case, monkeypatch):
    ends_with(ON_POSIX[case], monkeypatch)


def test_what_it_prints_is_no_answer(polls):
    """A constructor comes before the server does."""
    first = '__attribute__((constructor)) static void first(void)\n{\n    printf("first\\n");\n    fflush(stdout);\n}'
    body = 'puts("1234567890123456789012345678901234567890"); fflush(stdout); (void)!write(1, "12345", 5u);'
    library = hostile(body, first if sys.platform != "win32" else "")
    assert [library.call("answer") for _ in range(3)] == [42, 42, 42]


@pytest.mark.skipif(sys.platform == "win32", reason="the pipes there are waited for with a timer")
def test_an_answer_that_nobody_asked_for_is_none():
    library = hostile(
        'for (int i = 3; i < 99; i++) { if (fork() == 0) { sleep(1u); (void)!write(i, "1", 1u); _exit(0); } }'
    )
    assert library.call("answer") == 42
    time.sleep(2.0)
    with pytest.raises(RequirementError, match="the core answered unasked"):
        library.call("answer")


@with_landlock
def test_it_makes_no_file_before_the_first_call_or_in_one(tmp_path):
    opens = 'fopen("{}", "w");'.format((tmp_path / "mark").as_posix())
    first = f"__attribute__((constructor)) static void first(void)\n{{\n    {opens}\n}}"
    assert hostile(opens, first).call("answer") == 42
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such environment")
def test_its_environment_is_empty(monkeypatch):
    monkeypatch.setenv("DZDESIGN_SECRET", "1")
    body = 'if (getenv("DZDESIGN_SECRET") != NULL || getchar() != EOF || access("pyproject.toml", F_OK) == 0) return 1;'
    assert hostile(body).call("answer") == 42


PID = Function("getpid", (), "int32_t")


@pytest.mark.skipif(sys.platform == "win32", reason="a signal")
def test_it_ends_with_the_library():
    library = ConfinedLibrary({"pid.c": "typedef int nothing;\n"}, [PID], "the number")
    group = library.call("getpid")
    folder = library._process._folder
    assert runs(group) and folder.exists()
    del library
    gc.collect()
    wait_until_ended(group)
    assert not folder.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="a signal")
@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM, None])
def test_it_ends_with_dzdesign(by):
    text = (
        "import sys, time\nfrom dzdesign.verify.toolchain.confined_library import ConfinedLibrary, Function\n"
        "text = '#include <unistd.h>\\n#include <stdint.h>\\nint32_t stay(void) { for (;;) { sleep(99u); } }\\n'\n"
        "functions = [Function('getpid', (), 'int32_t'), Function('stay', (), 'int32_t')]\n"
        "library = ConfinedLibrary({'stay.c': text}, functions, 'it')\n"
        "print(library.call('getpid'), flush=True)\n"
    )
    text += "library.call('stay')\n" if by else ""
    process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    group = int(process.stdout.readline())
    if by:
        process.send_signal(by)
    process.wait()
    process.stdout.close()
    wait_until_ended(group)


def runs(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return not only_zombies(group)


def wait_until_ended(group):
    for _ in range(200):
        if not runs(group):
            return
        time.sleep(0.05)
    raise AssertionError("it still runs")
