"""The page that argues why every accepted block is safe names each of the check's rules, numbers and limits."""

import ast
import inspect
import re

from dzdesign.codegen.calibration import acceptance
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import CalibrationBlock, CurrentBlock, SensorBlock, SideBlock
from tests.codegen.calibration.test_check import with_current
from tests.support.core_texts import texts
from tests.support.core_variants import variant
from tests.support.paths import ROOT

PAGE = (ROOT / "docs/concepts/accepted-blocks.md").read_text("utf-8")
NAMED = set(re.findall(r"`(\w+)`", PAGE))
#: In the sentences before the tables; of a loop over names.
OF_SENTENCES = {"magic", "layout", "length", "unused words are 0"}


def built():
    return with_current(variant("default"))[0]


def test_the_page_has_every_rule_and_no_other():
    found = set()
    for node in ast.walk(ast.parse(inspect.getsource(acceptance))):
        if isinstance(node, ast.Yield) and isinstance(node.value, ast.Tuple):
            name = node.value.elts[0]
            found |= {name.value} if isinstance(name, ast.Constant) else set()
    rows = [line.split(" | ")[0][2:] for line in PAGE.splitlines() if line.startswith("| ")]
    stated = {name for row in rows for name in row.split(", ")} - {"rule"}
    codes = {"codes of command", "codes of A", "codes of B", "codes of C"}
    assert stated == found - OF_SENTENCES | codes


def test_the_page_names_every_number_of_the_block_that_the_check_reads():
    check = texts(block_core_files(built()))["dz_calibration.c"]
    read = {name for name in re.findall(r"->(\w+)", check) if name not in ("sides", "current")}
    assert len(read) > 60 and read <= NAMED, read - NAMED


def test_every_name_on_the_page_is_of_the_code():
    core = "\n".join(texts(block_core_files(built())).values())
    words = set(re.findall(r"\w+", core))
    assert not (missing := NAMED - words - {"design", "int"}), missing
    kinds = (CalibrationBlock, SensorBlock, SideBlock, CurrentBlock)
    fields = {name for kind in kinds for name in kind.__dataclass_fields__}
    not_read = fields - NAMED - {"sides", "current", "sensors"}
    for_display = {"full", "span_Pa", "u_max_uV", "compensator_sha256", "serial", "record"}
    assert not_read == for_display | {"open_compare"}  # of which any number will do


def test_every_limit_of_the_check_is_on_the_page():
    check = texts(block_core_files(built()))["dz_calibration.c"]
    limits = set(re.findall(r"#define (\w+)", check))
    assert len(limits) > 12 and limits <= NAMED, limits - NAMED
