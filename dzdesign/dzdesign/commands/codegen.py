"""`dzdesign codegen COMPENSATOR.json`."""

import os
from dataclasses import KW_ONLY, dataclass, replace
from typing import Annotated

from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option
from dzdesign.stages.generate import GenerateArguments, generate
from dzdesign.terminal.page import print_json, say_results
from dzdesign.terminal.progress import say

EXAMPLES = (
    "dzdesign codegen compensator.json -o firmware",
    "dzdesign codegen compensator.json --target host",
    "dzdesign codegen compensator.json --target iec61131 --dialect twincat -o plc",
    "dzdesign codegen compensator.json --target matlab -o matlab",
    "dzdesign codegen compensator.json --target amplifier --device west -o amplifier",
    "dzdesign codegen --list-targets",
)


@dataclass(frozen=True)
class Arguments(GenerateArguments):
    """Arguments of the stage, and what prints the targets instead."""

    compensator: Annotated[AnyPath | None, Option("COMPENSATOR.json")] = None  # type: ignore[assignment]
    """The compensator.json made by `dzdesign design`."""
    _: KW_ONLY
    list_targets: Annotated[bool, Option()] = False
    """Print name and description of every target, microcontrollers before other outputs."""


def run(arguments: Arguments, json: bool) -> int:
    """Generate a firmware or another output and print its files, or print the targets."""
    from dzdesign.codegen.other_targets import folder_of
    from dzdesign.codegen.project import DEFAULT_TARGET, Firmware
    from dzdesign.design.costs import design_warnings
    from dzdesign.terminal.output_tables import print_output
    from dzdesign.terminal.tables import print_firmware

    if arguments.list_targets:
        return _list_targets(json)
    if arguments.compensator is None:
        raise InputError("codegen needs a COMPENSATOR.json; see `dzdesign codegen --help`")
    folder = os.fspath(arguments.output or folder_of(arguments.target or DEFAULT_TARGET))
    made = generate(replace(arguments, output=folder))
    for line in design_warnings(made.compensator):
        say(f"warning: {line}")
    if made.note:
        say(made.note)
    if json:
        print_json(made.manifest)
    elif isinstance(made, Firmware):
        print_firmware(made, folder=folder)
    else:
        print_output(made, folder=folder)
    return 0


def _list_targets(json: bool) -> int:
    from dzdesign.codegen.other_targets import OTHER_TARGETS, OtherTarget
    from dzdesign.codegen.project import targets
    from dzdesign.codegen.target import Target

    everything: tuple[Target | OtherTarget, ...] = (*targets(), *OTHER_TARGETS.values())
    if json:
        print_json({"targets": [{"name": target.name, "description": target.description} for target in everything]})
        return 0
    width = max(len(target.name) for target in everything)
    say_results(*(f"{target.name:{width}}  {target.description}" for target in everything))
    return 0
