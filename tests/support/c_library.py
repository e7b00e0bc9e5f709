"""C of our own, loaded into the tests: dzdesign itself loads none (toolchain/compiled_library.py)."""

import ctypes
import sys
from collections.abc import Mapping, Sequence

from dzdesign.core.errors import RequirementError
from dzdesign.verify.toolchain.host_compiler import built, host_compiler, words_of


def load_library(sources: Mapping[str, str], what: str, options: Sequence[str] = ()) -> ctypes.CDLL:
    """Compile C files, with the headers among them, together and load them."""
    on_windows = sys.platform == "win32"
    units = [name for name in sources if name.endswith(".c")]
    position = [] if on_windows else ["-fPIC"]
    command = [*words_of(host_compiler()), "-std=c99", "-O2", *options, *position, "-shared", *units, "-lm"]
    texts = {name: text.encode(errors="surrogateescape") for name, text in sources.items()}
    library = built(f"library{'.dll' if on_windows else '.so'}", command, texts, what)
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:  # of a wrong core that lacks a function
        raise RequirementError(f"{what} does not link: {error}") from error
