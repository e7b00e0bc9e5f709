"""Checks of a folder for an amplifier: its file and its table are read back and compared with the valve."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import groupby
from math import inf
from pathlib import Path

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import percent
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import remaining_dead_zone
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.verify.amplifier.checks import DEAD_ZONES, READ_BACK, ROUNDED, Stated
from dzdesign.verify.amplifier.checks import checks as checks_of_file
from dzdesign.verify.output_evidence import OutputChecks
from dzdesign.verify.requirements import Check, Requirement

Say = Callable[[str], None]
#: It keeps git from rewriting line ends, and stands in every folder.
LINE_ENDS = ".gitattributes"
TABLE, HEADER = "dead_zones.csv", "side,dp_MPa,branch,dead_zone_fixed,dead_zone_law"
#: A line of it; no command opens the valve where a share is infinite.
LINE = re.compile(r"([a-z]+),(\d{1,9}\.\d{6}),([a-z]+),(\d{1,9}\.\d{6}|inf),(\d{1,9}\.\d{6}|inf)", re.ASCII)
LAW_DEAD_ZONES = Requirement(
    id="amplifier-law-dead-zones", title="the dead zones stated beside them are those of the design"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A line of the table: a branch of one test, and the share of command to its knee by both compensations."""

    side: str
    dp_MPa: float
    branch: str
    law: float
    fixed: float = inf

    def __str__(self) -> str:
        return f"{self.law:.6f} on {self.branch} at {self.dp_MPa:.6f} MPa of the {self.side} side"

    def states(self, other: "Row") -> bool:
        """Return whether side, test, branch and the law's share are those of another line, but for rounding."""
        same = self.law == other.law or abs(self.law - other.law) <= ROUNDED
        named = (self.side, self.branch) == (other.side, other.branch)
        return named and same and abs(self.dp_MPa - other.dp_MPa) <= ROUNDED


def checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check a folder for an amplifier."""
    say("reading the file and the table back")
    try:
        device = manifest.settings.get("device", "")
        content = _file_for(folder, manifest, device)
        zero = _threshold(manifest)
    except InputError as error:
        return OutputChecks(checks=(READ_BACK.check(holds=False, text=str(error)),))
    try:
        rows = read_table(read_bytes(folder / TABLE, "table of dead zones"))
    except InputError as error:
        of_file = checks_of_file(device, content, compensator, {}, zero)
        found = [check for check in of_file if check.id != DEAD_ZONES.id]
        return OutputChecks(checks=(*found, DEAD_ZONES.check(holds=False, text=str(error))))
    of_file = checks_of_file(device, content, compensator, _stated(rows, compensator), zero)
    return OutputChecks(checks=(*of_file, _law_dead_zones(rows, compensator)))


def _file_for(folder: Path, manifest: OutputManifest, device: str) -> bytes:
    """Return the one file beside the table, the compensator and git's; it is named after its device."""
    names = sorted(manifest.files.keys() - {Compensator.FILE_NAME, TABLE, LINE_ENDS})
    if len(names) != 1 or names[0].partition(".")[0] != device:
        raise InputError(f"the manifest names {len(names)} files for {quoted(device)}, expected one of its name")
    return read_bytes(folder / names[0], f"file for {device}")


def _threshold(manifest: OutputManifest) -> Fraction | None:
    text = manifest.settings.get("threshold", "")
    return Fraction(repr(percent("0.5 %")(text, "threshold in the manifest"))) if text else None


def read_table(content: bytes) -> list[Row]:
    """Return the lines of a table of dead zones; what is none is an `InputError` with the line."""
    header, *lines = content.decode("ascii", "replace").splitlines() or [""]
    if header != HEADER:
        raise InputError(f"{TABLE} begins with {quoted(header)}, expected {HEADER}")
    rows = []
    for number, line in enumerate(lines, start=2):
        found = LINE.fullmatch(line)
        if found is None:
            raise InputError(f"{TABLE}, line {number}, is {quoted(line)}, expected {HEADER}, with six decimals")
        side, dp_MPa, branch, fixed, law = found.groups()
        rows.append(Row(side=side, dp_MPa=float(dp_MPa), branch=branch, fixed=float(fixed), law=float(law)))
    return rows


def _stated(rows: Sequence[Row], compensator: Compensator) -> Mapping[int, Sequence[Stated]]:
    """Return what the table states of the file, by the sign of command; 0 for a side that the design has not."""
    signs = {SIDE_NAMES[sign]: sign for sign in compensator.signals.signs}
    stated: dict[int, list[Stated]] = {}
    for (side, dp_MPa), of_test in groupby(rows, key=lambda row: (row.side, row.dp_MPa)):
        stated.setdefault(signs.get(side, 0), []).append((dp_MPa, {row.branch: row.fixed for row in of_test}))
    return stated


def _law_dead_zones(rows: Sequence[Row], compensator: Compensator) -> Check:
    """Compare every line with the design: its side, test and branch, and the share that the law leaves there."""
    expected = [
        Row(side=SIDE_NAMES[sign], dp_MPa=test.dp_MPa or 0.0, branch=branch, law=share)
        for sign in compensator.signals.signs
        for test in compensator.valve.sides[SIDE_NAMES[sign]].tests
        for branch, share in remaining_dead_zone(compensator, test, sign).items()
    ]
    if len(rows) != len(expected):
        text = f"{len(rows)} lines, expected {len(expected)}: one for each branch of each test"
        return LAW_DEAD_ZONES.check(holds=False, text=text)
    for number, (row, wanted) in enumerate(zip(rows, expected, strict=True), start=2):
        if not row.states(wanted):
            text = f"{TABLE}, line {number}: it states {row}, expected {wanted}"
            return LAW_DEAD_ZONES.check(holds=False, text=text)
    return LAW_DEAD_ZONES.check(holds=True, text=f"{len(rows)} lines, one for each branch of each test")
