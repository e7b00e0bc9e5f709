"""The model of the F28335, and a compiler for it."""

import shutil

import pytest

from tests.support.paths import DEVICES

HERE = DEVICES / "f28335"
COMPILER = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc, gcc or clang) on the path")
