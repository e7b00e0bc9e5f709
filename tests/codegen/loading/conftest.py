"""One compiled drive for all tests of the loading."""

import pytest

from tests.support.loading.bench import build_drive
from tests.support.loading.exchanges import Bench
from tests.support.loading.files import COMPILER, bench_of, drive_files


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    if not COMPILER:
        pytest.skip("no C compiler (cc, gcc or clang) on the path")
    return build_drive(COMPILER, drive_files(), tmp_path_factory.mktemp("drive"))


@pytest.fixture
def bench(library) -> Bench:
    return bench_of(library)
