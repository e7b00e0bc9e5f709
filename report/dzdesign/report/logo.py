"""A logo on the report: a raster image, embedded, so that the page stays one file without network or script."""

from base64 import b64encode
from pathlib import Path

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError

#: First bytes of a format -> its media type. SVG is none of them: it can hold scripts and addresses.
SIGNATURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg", b"GIF87a": "image/gif",
              b"GIF89a": "image/gif"}  # fmt: skip
#: Bytes of a logo: a page is sent by mail.
LARGEST = 512 * 1024


def logo_uri(path: Path) -> str:
    """Return a logo as a data: address.

    Raises
    ------
    InputError
        If it can't be read, is too large, or is no PNG, JPEG or GIF.
    """
    content = read_bytes(path, "logo")
    if len(content) > LARGEST:
        raise InputError(f"--logo '{path}' has {len(content)} bytes, expected at most {LARGEST}; scale it down")
    kind = next((kind for start, kind in SIGNATURES.items() if content.startswith(start)), None)
    if kind is None:
        raise InputError(
            f"--logo '{path}' is no PNG, JPEG or GIF, expected one of these; SVG can hold scripts: save it as PNG"
        )
    return f"data:{kind};base64,{b64encode(content).decode()}"
