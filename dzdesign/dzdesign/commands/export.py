"""`dzdesign export`: the parameters of an amplifier with a fixed dead-zone compensation, and what they leave."""

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dzdesign.core.errors import one_line
from dzdesign.stages.export import ExportArguments, export
from dzdesign.terminal.page import print_json

if TYPE_CHECKING:
    from dzdesign.stages.export import AmplifierExport

EXAMPLES = (
    "dzdesign export compensator.json --to west        # print the parameters and the dead zone that remains",
    "dzdesign export compensator.json --to west -o pam199.txt",
    "dzdesign export compensator.json --to cia408 -o valve.dcf --threshold '1 %'",
    'dzdesign export compensator.json --to beckhoff -o table.st --table-dp "2 MPa"',
)


@dataclass(frozen=True)
class Arguments(ExportArguments):
    """Arguments of the stage."""


def run(arguments: Arguments, json: bool) -> int:
    """Write the parameters of a device, and print what they leave beside the law that reads the pressures."""
    from dzdesign.terminal.export_tables import print_export

    made = export(arguments)
    file = None if arguments.output is None else os.fspath(arguments.output)
    if json:
        print_json(_document(made, file))
        return 0
    print_export(made)
    print(one_line(f"Written: {file}" if file else "Nothing is written: give -o FILE"))
    return 0


def _document(made: "AmplifierExport", file: str | None) -> dict[str, Any]:
    """Return what was set and what it leaves; shares are of full command and full drive."""
    from dzdesign.design.signals import SIDE_NAMES

    setting = made.setting
    sides = {
        SIDE_NAMES[sign]: {
            "safe_share": float(offset.share),
            "lowest_at_MPa": float(offset.lowest_at_MPa),
            "dp_MPa": [float(end) for end in offset.dp_MPa],
            "points": [[float(value) for value in node] for node in setting.characteristics[sign].nodes],
        }
        for sign, offset in setting.offsets.items()
    }
    return {
        "file": file,
        "device": setting.device.name,
        "title": setting.device.title,
        "sources": list(setting.device.sources),
        "parameters": dict(setting.parameters),
        "unit": setting.device.unit,
        "dp_MPa": None if setting.dp_MPa is None else float(setting.dp_MPa),
        "sides": sides,
        "dead_zones": [
            {"side": row.side, "dp_MPa": row.dp_MPa, "fixed": dict(row.fixed), "law": dict(row.law),
             "fixed_end_L_min": row.fixed_end_L_min, "law_end_L_min": row.law_end_L_min}
            for row in made.dead_zones
        ],
        "notes": list(made.notes),
        "checks": [{"id": each.id, "name": each.name, "holds": each.holds, "text": each.text} for each in made.checks],
        "compensator_sha256": made.compensator_sha256,
    }  # fmt: skip
