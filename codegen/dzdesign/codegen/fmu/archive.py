"""An FMU as a file: a zip with the same bytes each time."""

from collections.abc import Mapping
from io import BytesIO
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

#: The earliest that a zip knows.
DATE = (1980, 1, 1, 0, 0, 0)
#: Of a file, as Unix has it: anybody reads it; binaries run.
READABLE, RUNNABLE = 0o100644, 0o100755
UNIX = 3


def archive(files: Mapping[str, bytes]) -> bytes:
    """Return the zip of files, path to content: modelDescription.xml first, the others by name."""
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=9) as packed:
        for path in sorted(files, key=lambda path: (path != "modelDescription.xml", path)):
            entry = ZipInfo(path, DATE)
            entry.compress_type, entry.create_system = ZIP_DEFLATED, UNIX
            entry.external_attr = (RUNNABLE if path.startswith("binaries/") else READABLE) << 16
            packed.writestr(entry, files[path])
    return stream.getvalue()
