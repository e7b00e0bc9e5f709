"""`design`: ValveModel + choices -> Compensator; and a compensator as the later stages are given it."""

import os
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dzdesign.core.artefact_files import check_file_may_be_written, write_file
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, flag_of, read_options
from dzdesign.design.design_choices import DEFAULTS, DesignChoices

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator
    from dzdesign.design.options import DesignOptions
    from dzdesign.identify.valve.model import ValveModel

#: Options that only a command of both signs has a use for.
OF_BOTH_SIGNS = ("negative_dp", "pressure_c")


@dataclass(frozen=True)
class DesignArguments(DesignChoices):
    """Arguments of `design`."""

    valve: Annotated["ValveModel | AnyPath", Option("VALVE.json")]
    """The valve.json made by `dzdesign identify`."""
    _: KW_ONLY
    output: Annotated[AnyPath | None, Option("FILE", command_default="compensator.json", short="-o")] = None
    """File to write."""
    target: Annotated[str, Option("NAME")] = "f28335"
    """Microcontroller whose converter and timer the law is designed for. `codegen --list-targets` lists them."""


def design_options(choices: DesignChoices, target: str, *, both_sides: bool = False) -> "DesignOptions":
    """Return the options of `design`; of a valve with both sides the command has both signs unless it is given.

    Raises
    ------
    InputError
        If an option can't be read, or concerns negative commands of a valve that has none.
    """
    from dzdesign.codegen.project import target_named
    from dzdesign.design.options import options_of

    board = read_options(choices, ["crystal", "channels"])
    inputs = target_named(target).on_board(board["crystal"], board["channels"] or ()).inputs()
    texts = {name: getattr(choices, name) or "" for name in DEFAULTS}
    if both_sides and not texts["command_signal"]:
        # The converter's range is the middle of it and two fifths to either side: beyond full command a fault is seen.
        full_V = float(inputs.converter.full_V)
        texts["command_signal"] = f"-10..10 V x {0.04 * full_V:.12g} + {0.5 * full_V:.12g} V"
    options = options_of(texts, inputs)
    if options.signals.command.negative_full_code is not None:
        return options
    useless = [flag_of(name) for name in OF_BOTH_SIGNS if getattr(choices, name) not in (None, DEFAULTS[name])]
    useless += [
        f"the second time of {flag_of(name)}"
        for name in ("ramp_up", "ramp_down")
        if "/" in (getattr(choices, name) or "")
    ]
    if useless:
        command = (options.texts or {}).get("command_signal", "")
        raise InputError(
            f"{useless[0]} is for a command of both signs, but {command!r} has one; leave it out, or give "
            "a --command-signal such as '-10..10 V x 0.12 + 1.5 V'"
        )
    return options


def design(arguments: DesignArguments) -> "Compensator":
    """Design a compensator for a valve and prove its certificate.

    Returns
    -------
    Compensator
        The law with exact coefficients, its certificate and its costs.

    Raises
    ------
    InputError
        If the file or an option can't be read, or the law can't be used for this valve.
    RequirementError
        If a proof fails.

    Examples
    --------
    >>> from dzdesign import api
    >>> compensator = api.design("valve.json", guard="closing")        # doctest: +SKIP
    >>> compensator.positive.certificate.guard                         # doctest: +SKIP
    'closing'
    """
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.design.compensator import SCHEMA
    from dzdesign.design.designing import design as design_valve
    from dzdesign.design.position_loop import with_largest_gains
    from dzdesign.identify.valve.model import ValveModel

    design_options(arguments, arguments.target, both_sides=True)  # a wrong option is refused before a wrong file
    if arguments.output is not None:
        check_file_may_be_written(Path(arguments.output), SCHEMA)
    valve = arguments.valve
    if not isinstance(valve, ValveModel):
        valve = read_artefact(read_bytes(Path(valve), "valve file"), ValveModel, os.fspath(valve))
    options = design_options(arguments, arguments.target, both_sides=len(valve.sides) > 1)
    compensator = with_largest_gains(design_valve(valve, options))
    if arguments.output is not None:
        write_file(Path(arguments.output), to_json_bytes(compensator), SCHEMA)
    return compensator


COMPENSATOR_NAME = "compensator.json"


def given_compensator(given: "Compensator | AnyPath") -> tuple["Compensator", str, str]:
    """Return a compensator, the SHA-256 of its file, and how that is called; of a folder the file in it."""
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.design.compensator import Compensator

    if isinstance(given, Compensator):
        return given, sha256_of(to_json_bytes(given)), "the compensator"
    path = Path(given)
    path = path / COMPENSATOR_NAME if os.path.isdir(path) else path  # False of a name that is too long
    content = read_bytes(path, "compensator file")
    return read_artefact(content, Compensator, os.fspath(path)), sha256_of(content), f"'{path}'"


def refuse_underived(compensator: "Compensator", source: str, *, of_file: bool) -> None:
    """Refuse a compensator whose numbers do not follow: what is made of it goes to a device without a `verify`."""
    from dzdesign.design.redesign import prove_derived, refuse_without_options

    if of_file:
        refuse_without_options(compensator, source.strip("'"))
    try:
        prove_derived(compensator)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
