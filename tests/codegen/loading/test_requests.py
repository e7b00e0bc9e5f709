"""A drive's answers to single requests, rule by rule, and that faults seeded in its C are found."""

import shutil

import pytest

from tests.support.loading.files import COMPILER
from tests.support.loading.request_checks import CHECKS
from tests.support.loading.seeded_faults import FAULTS, is_found


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_rule(bench, check):
    check(bench.drive)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILER, reason="no C compiler (cc, gcc or clang) on the path")
@pytest.mark.parametrize("fault", FAULTS[::12], ids=lambda fault: fault.file)
def test_a_seeded_fault_is_found(fault, tmp_path):
    """Every twelfth; `benchmarks/loading` tries all."""
    assert is_found(fault, tmp_path, exchanges=3)


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="no avr-gcc on the path")
def test_it_compiles_without_a_warning_where_int_has_16_bits(tmp_path):
    import subprocess

    from tests.support.loading.bench import OPTIONS
    from tests.support.loading.files import drive_files

    for name, text in drive_files().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    sources = [str(tmp_path / name) for name in drive_files() if name.endswith(".c")]
    options = ["-mmcu=atmega1280", "-Wshadow", "-fsyntax-only", f"-I{tmp_path}"]
    done = subprocess.run(["avr-gcc", *OPTIONS, *options, *sources], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
