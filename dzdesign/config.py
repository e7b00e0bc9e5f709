"""Options in a TOML file: the names of the command line, one file for all commands."""

import tomllib
from collections.abc import Collection
from pathlib import Path

from dzdesign.core.artefacts import read_bytes
from dzdesign.core.errors import InputError, nearest


def options_from_file(path: str, known: Collection[str]) -> dict[str, str | list[str]]:
    """Read options; a key may be written ``meter-floor`` or ``meter_floor``, values as on the command line.

    Raises
    ------
    InputError
        If the file is not TOML, or a key is no option of any command.
    """
    content = read_bytes(Path(path), "config file")
    try:
        document = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"'{path}' is not TOML: {error}") from error
    options: dict[str, str | list[str]] = {}
    for key, value in document.items():
        name = key.replace("-", "_")
        if name not in known:
            raise InputError(f"'{path}': there is no option '{key}'{nearest(name, known)}")
        if isinstance(value, list) and all(isinstance(item, str | int | float) for item in value):
            options[name] = [str(item) for item in value]
        elif isinstance(value, str | int | float) and not isinstance(value, bool):
            options[name] = str(value)
        else:
            raise InputError(f"'{path}': option '{key}' is {value!r}, expected text such as \"1 MPa\"")
    return options
