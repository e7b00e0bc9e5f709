"""Which format a binary file is in: every module of `formats` that declares `FORMATS` takes part."""

import importlib
import pkgutil
from functools import lru_cache
from pathlib import Path

from dzdesign.identify.reading.binary import formats
from dzdesign.identify.reading.binary.file_format import FileFormat

#: First bytes of a file among which its format's mark stands.
LONGEST_MARK = 32


@lru_cache(maxsize=1)
def file_formats() -> tuple[FileFormat, ...]:
    """Return all formats, the longest mark first: the mark of MATLAB 7.3 begins as that of MATLAB does."""
    names = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
    modules = (importlib.import_module(f"{formats.__name__}.{name}") for name in names)
    return tuple(sorted((item for module in modules for item in module.FORMATS), key=lambda item: -len(item.mark)))


def format_of(start: bytes, path: Path) -> FileFormat | None:
    """Return the format of a file, None if it is text or nothing that dzdesign knows.

    The file's first `LONGEST_MARK` bytes decide where the format has a mark, its suffix where it has none.
    """
    for item in file_formats():
        if start.startswith(item.mark) if item.mark else path.suffix.lower() == item.suffix:
            return item
    return None
