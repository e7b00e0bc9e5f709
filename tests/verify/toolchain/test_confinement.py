"""Compiled code in a process of its own: what it may not do, and that no end of it is one of dzdesign."""

import ctypes
import os
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.toolchain import confinement
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.confinement import numbers_in, run_confined
from dzdesign.verify.toolchain.machines import HOST
from tests.support.synthetic import needs_compiler

pytestmark = [needs_compiler, pytest.mark.skipif(sys.platform == "win32", reason="Windows limits the time alone")]


def landlock():
    """The version of Landlock that this machine's kernel has; 0: none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(ctypes.CDLL(None).syscall(444, None, 0, 1), 0)


with_landlock = pytest.mark.skipif(landlock() < 3, reason="rights are taken by Linux's Landlock")
SHORT = replace(HOST, run_timeout_s=3.0)


def program(body, top=""):
    """Link a program around the body of main()."""
    text = (
        "#define _GNU_SOURCE\n#include <errno.h>\n#include <signal.h>\n#include <stdio.h>\n#include <stdlib.h>\n"
        f"#include <string.h>\n#include <unistd.h>\n{top}\n"
        f"int main(int count, char **given)\n{{\n    (void)count;\n    (void)given;\n    {body}\n    return 0;\n}}\n"
    )
    return HOST.link([HOST.compile("it.c", {"it.c": text.encode()}, ("-std=gnu99", "-O1"), "it")], "it")


#: What a program does, and how the sentence ends.
ENDS = {
    "a loop that does not end": ("for (;;) {\n    }", "did not end within 3 s"),
    "a pointer to nothing": ("*(volatile int *)0 = 1;", r"ended with signal 11"),
    "a hundred gigabytes": (
        "for (int i = 0; i < 100; i++) { volatile char *one = malloc(1000000000ul); one[0] = 1; }",
        "ended with signal 11",
    ),
    "a text without an end": (
        'for (;;) { puts("1234567890"); }',
        "signal 25: it reached the limit of what it may write",
    ),
    "an exit of its own": ('fputs("no more", stderr); exit(3);', "ended with exit status 3: no more"),
}


@pytest.mark.parametrize("case", ENDS)
def test_any_end_is_one_sentence(case):
    body, words = ENDS[case]
    begin = time.monotonic()
    with pytest.raises(RequirementError, match=words):
        SHORT.run(program(body), [], "the core")
    assert time.monotonic() - begin < 30


def test_the_limit_of_cpu_time_is_one_too(monkeypatch):
    monkeypatch.setattr(confinement.os, "cpu_count", lambda: 1)
    launcher = confinement.limits(1.0, 0, None)
    assert launcher[1] == "1"
    monkeypatch.setattr(confinement, "limits", lambda *_: launcher)
    ended = run_confined([str(program("for (;;) {\n    }"))], "the core", 60.0)
    assert ended.reason.endswith("it reached the limit of CPU time")


def test_what_it_leaves_running_is_ended_and_keeps_nobody_waiting():
    running = program('if (fork() == 0) { sleep(600u); } printf("%ld\\n", (long)getpgrp());')
    begin = time.monotonic()
    ((group,),) = SHORT.run(running, [], "the core")
    assert time.monotonic() - begin < 30
    for _ in range(100):
        if not any_in(group):
            break
        time.sleep(0.05)
    assert not any_in(group)


def any_in(group):
    """Whether a process of a group still runs."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return not only_zombies(group)


def only_zombies(group):
    """Whether those left in a group have ended, and nobody has asked how."""
    states = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group:
            states.append(fields[0])
    return set(states) <= {"Z"}


OPENED = 'FILE *file = fopen("{path}", "w"); printf("%d\\n", file != NULL);'


@with_landlock
@pytest.mark.parametrize("constructed", [False, True])
def test_it_makes_and_changes_no_file(tmp_path, constructed):
    kept = tmp_path / "kept"
    kept.write_text("kept")
    for path in (tmp_path / "new", kept):
        body = OPENED.replace("{path}", path.as_posix())
        top = f"__attribute__((constructor)) static void dz_first(void)\n{{\n    {body}\n}}\n" if constructed else ""
        assert SHORT.run(program("" if constructed else body, top), [], "the core") == [[0]]
    removed = program(f'printf("%d\\n", unlink("{kept.as_posix()}") != 0 && mkdtemp(given[0]) == NULL);')
    assert SHORT.run(removed, [], "the core") == [[1]]
    assert kept.read_text() == "kept" and [each.name for each in tmp_path.iterdir()] == ["kept"]


@with_landlock
def test_it_writes_in_the_folder_of_results_alone(tmp_path):
    results = tmp_path / "results"
    results.mkdir()
    here, there = (OPENED.replace("{path}", path) for path in ("here", f"{tmp_path.as_posix()}/there"))
    ended = run_confined([str(program(f"{{ {here} }} {{ {there} }}"))], "the core", 9.0, results=results)
    assert ended.reason == "" and numbers_in(ended.printed) == [[1], [0]]
    assert (results / "here").exists() and not (tmp_path / "there").exists()


@pytest.mark.skipif(landlock() < 6, reason="a right of newer kernels")
def test_it_sends_no_signal_and_opens_no_connection():
    assert SHORT.run(program('printf("%d\\n", kill(getppid(), 0) != 0 && errno == EPERM);'), [], "the core") == [[1]]
    top = "#include <netinet/in.h>\n#include <sys/socket.h>"
    body = (
        "struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(9)};\n    "
        "to.sin_addr.s_addr = htonl(0x7F000001);\n"
        "    int end = socket(AF_INET, SOCK_STREAM, 0);\n"
        '    printf("%d\\n", connect(end, (struct sockaddr *)&to, sizeof to) != 0 && errno == EACCES);'
    )
    assert SHORT.run(program(body, top), [], "the core") == [[1]]


def test_its_environment_folder_and_input_are_empty(monkeypatch):
    monkeypatch.setenv("DZDESIGN_SECRET", "1")
    body = 'char at[999]; printf("%d %d\\n", getenv("DZDESIGN_SECRET") == NULL, getchar() == EOF);'
    body += '\n    printf("%d\\n", getcwd(at, sizeof at) != NULL && access("pyproject.toml", F_OK) != 0);'
    assert SHORT.run(program(body), [], "the core") == [[1, 1], [1]]


@pytest.mark.parametrize(
    "printed", ["9" * 5000, "12345678901", "-1", "1.5", "1e3", "\u0661", "1 " * 9 + "x", "0x10", "\x00"]
)
def test_what_is_no_number_of_32_bits_is_left_out(printed):
    assert numbers_in(f"1 2\n{printed}\n3\n") == [[1, 2], [3]]


def test_programs_side_by_side_have_each_their_own():
    threads, found = [], {}
    for each in range(8):
        run = program(f'puts("{each}");')
        threads.append(threading.Thread(target=lambda e=each, r=run: found.update({e: SHORT.run(r, [], "it")})))
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {each: [[each]] for each in range(8)}


@with_landlock
def test_a_core_runs_so(firmware_folder, example_compensator, tmp_path):
    """A constructor in the core comes before anything of the check, and has no rights either."""
    core, mark = CompiledCore(firmware_folder), tmp_path / "it_ran"
    added = "\n#include <stdio.h>\n__attribute__((constructor)) static void dz_mark(void)\n{\n"
    added += f'    fopen("{mark.as_posix()}", "w");\n}}\n'
    edited = core.edited(core.name, core.sources[core.name] + added.encode())
    prepared = PreparedInputs(ExactLaw(example_compensator, 1)).everything()
    found, right = edited.check(prepared), core.check(prepared)
    assert not mark.exists() and found.wrong == 0 and found.outputs_hash == right.outputs_hash
