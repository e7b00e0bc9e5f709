"""Twelve bugs in templates, with which the folder is what is generated: each is caught by a check that shares no code.

`reproduced` is silent then, for it compares with the same wrong text; so it is switched off here.
"""

import pytest

from dzdesign.codegen import project
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs, input_checks
from dzdesign.verify.exhaustive.block_check import own_block_accepted
from dzdesign.verify.exhaustive.drive_check import drive_follows
from dzdesign.verify.folder import read_compensator, read_firmware_manifest
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
LAW, DRIVE = "dz_comp.c.jinja", "dz_drive.c.jinja"
#: B minus A, which is ahead at negative commands, in codes of it.
DIFFERENCE = "((p_b_adc * 4096u - (uint32_t)p_a_adc * block->sides[1].weight - block->sides[1].balance) >> 12)"
#: Template, what stands there, what somebody wrote instead, and the check that sees it.
BUGS = {
    "wrong shift": (LAW, ">> (side->reciprocal_shift", ">> 1 >> (side->reciprocal_shift", "exact-law"),
    "swapped channels": (LAW, "pressure_difference(side, {{ side.ahead.code }}, {{ side.behind.code }})",
                         "pressure_difference(side, {{ side.behind.code }}, {{ side.ahead.code }})", "exact-law"),
    "off by one in the table": (LAW, "node[1].law * past", "node[2].law * past", "exact-law"),
    "sign of the negative side": (
        LAW, "from_band = {{ side.from_band }}", "from_band = {{ sides[0].from_band }}", "exact-law",
    ),
    "missing saturation": (LAW, "at_most(sum, side->quotient_limit)", "sum", "exact-law"),
    "one pair, in what the interrupt calls": (DRIVE, "past = past_band(block, at_rest, away);",
                      f"past = past_band(block, at_rest, away) + (u_adc == 1234u && {DIFFERENCE} == 567u);",
                      "exact-law"),
    "one pair, in the tick": (DRIVE, "uint32_t compare = drive->law;",
                              "uint32_t compare = drive->law + (drive->law == 40028u && drive->status == 0u);",
                              "exact-law"),
    "stale sample": (DRIVE, "uint32_t compare = drive->law;", "uint32_t compare = drive->compare_a;", "drive"),
    "debounce": (DRIVE, "- block->fault_samples) >> 31)) & ~fault", "- block->fault_samples) >> 31))", "drive"),
    "interlock": (DRIVE, "invalid | early |", "invalid |", "drive"),
    "dither": (DRIVE, "compare += block->dither_counts", "compare -= block->dither_counts", "drive"),
    "block of another valve": ("", "", "", "block-accepted"),
}  # fmt: skip


@pytest.fixture(scope="module")
def everything():
    """A design with both sides and everything switched on, in block form; and one of another valve."""
    return variant("bipolar, all options"), variant("bipolar")


def generated(compensator, other, monkeypatch, folder, bug=""):
    """Generate the firmware, its templates with a bug."""
    name, old, new, _ = BUGS.get(bug, ("", "", "", ""))
    render, found = project._render, []

    def rendered(package, template, banner, values):
        if template != name:
            return render(package, template, banner, values)
        environment = project._environment(package)
        text = environment.loader.get_source(environment, template)[0]
        found.append(old in text)
        return environment.from_string(text.replace(old, new)).render(banner=banner, project="dzdesign", **values)

    monkeypatch.setattr(project, "_render", rendered)
    if bug and not name:
        digest = sha256_of(to_json_bytes(other))
        monkeypatch.setattr(project, "block_of", lambda *_: block_of(other, digest))
    write_generated(generate(compensator, "host", "block"), folder)
    assert all(found) and bool(found) == bool(name)
    return folder


def of_law(folder):
    compensator = read_compensator(folder)
    signs, units = compensator.signals.signs, compensator.valve.recorded_units
    inputs = [check_all_inputs(folder, sign, compensator) for sign in signs]
    return [check for each in inputs for check in input_checks(each, units, both_signs=True)]


#: Those of `verify`, without the one that compares texts.
CHECKS = {
    "exact-law": of_law,
    "drive": lambda folder: [drive_follows(folder, read_compensator(folder))],
    "block-accepted": lambda folder: own_block_accepted(folder, read_firmware_manifest(folder)),
}


@pytest.mark.slow
@pytest.mark.parametrize("bug", BUGS)
def test_a_bug_in_a_template_is_caught_without_comparing_texts(everything, tmp_path, monkeypatch, bug):
    folder, seen_by = generated(*everything, monkeypatch, tmp_path / "fw", bug), BUGS[bug][3]
    assert seen_by in {check.id for check in CHECKS[seen_by](folder) if not check.holds}


@pytest.mark.slow
def test_the_templates_as_they_are_pass(everything, tmp_path, monkeypatch):
    folder = generated(*everything, monkeypatch, tmp_path / "fw")
    assert all(check.holds for checks in CHECKS.values() for check in checks(folder))
