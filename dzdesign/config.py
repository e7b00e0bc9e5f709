"""Options in a TOML file: the names of the command line, one file for all commands."""

import tomllib
from collections.abc import Collection
from pathlib import Path

from dzdesign.core.artefacts import read_bytes
from dzdesign.core.errors import InputError, nearest


def options_from_file(path: str, known: Collection[str], repeatable: Collection[str]) -> dict[str, str | list[str]]:
    """Read options; a key may be written ``meter-floor`` or ``meter_floor``, values as on the command line.

    Parameters
    ----------
    path : str
        TOML file.
    known : collection of str
        Options of all commands, so that one file serves every command.
    repeatable : collection of str
        Those of them that may be a list.

    Raises
    ------
    InputError
        If the file is not TOML, a key is no option of any command, or a value does not fit.
    """
    content = read_bytes(Path(path), "config file")
    try:
        document = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{path}' is not TOML: {error}; expected lines such as u-max = \"10 V\"") from error
    options: dict[str, str | list[str]] = {}
    for key, value in document.items():
        name = key.replace("-", "_")
        if name not in known:
            hint = nearest(name, known).replace("_", "-")
            raise InputError(f"'{path}': there is no option '{key}'{hint}; see `dzdesign COMMAND --help`")
        if name in options:
            raise InputError(f"'{path}': option '{key}' is given twice, with - and with _; keep one")
        items = value if name in repeatable and isinstance(value, list) else [value]
        if not items or not all(isinstance(item, str | int | float) and not isinstance(item, bool) for item in items):
            raise InputError(
                f"'{path}': option '{key}' is {str(value)[:40]!r}, expected text such as \"1 MPa\" or a number"
            )
        options[name] = [str(item) for item in items] if name in repeatable else str(value)
    return options
