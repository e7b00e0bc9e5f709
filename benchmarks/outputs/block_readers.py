"""Function blocks read by tools that others wrote: blark, a parser of Beckhoff's language, and matiec's compiler iec2c.

Blark takes every ambiguity in turn, minutes a block, so this is no test. A block with an error in it must be refused.
`pip install blark`; it is under the GPL, and nothing of the product imports it. Without iec2c, the compiler of OpenPLC
and Beremiz, on the path that part is left out.
"""

import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

from scoreboard import Row, print_rows

from dzdesign.codegen.other_targets import generate_output
from tests.support.golden_firmware import golden_compensator

ROOT = Path(__file__).parents[2]
NAME, ROOTS = "FB_DeadZone", ("goldens", "goldens_full")


def texts(root: str, dialect: str, interface: str) -> dict[str, str]:
    """Return the text of each file of an output that a PLC's tool reads."""
    compensator = golden_compensator(root=ROOT / "tests" / root)
    settings = {"dialect": dialect, "interface": interface, "cycle_time": "1 ms"}
    files = generate_output(compensator, "iec61131", settings).files
    found = {f"{NAME}.st": files[f"{NAME}.st"].decode()}
    parts = {each.tag.rpartition("}")[2]: each for each in ElementTree.fromstring(files[f"{NAME}.xml"]).iter()}
    plain, body = ("".join(parts[name].itertext()).strip("\n") for name in ("InterfaceAsPlainText", "body"))
    found[f"{NAME}.xml"] = f"{plain}\n{body}\nEND_FUNCTION_BLOCK\n"
    if dialect == "twincat":
        pou = ElementTree.fromstring(files[f"{NAME}.TcPOU"])[0]
        declaration, code = pou.findtext("Declaration") or "", pou.findtext("Implementation/ST") or ""
        found[f"{NAME}.TcPOU"] = f"{declaration}{code}END_FUNCTION_BLOCK\n"
    return found


def errors(text: str) -> int:
    """Return 1 if blark can't read a text, else 0."""
    from blark.parse import parse_source_code

    return int(parse_source_code(text).exception is not None)


def uncompiled(text: str, compiler: str) -> int:
    """Return 1 if matiec can't compile a text to C, else 0; its library stands beside the program or in ../lib."""
    program = Path(compiler).resolve()
    library = next(
        each for each in (program.parent / "lib", program.parent.parent / "lib", program.parent) if each.is_dir()
    )
    with TemporaryDirectory() as place:
        source = Path(place) / f"{NAME}.st"
        source.write_text(text)
        command = [compiler, "-I", str(library), "-T", place, str(source)]
        return int(subprocess.run(command, capture_output=True, check=False).returncode != 0)


def print_block_readers(quick: bool = False, seed: int = 0) -> list[Row]:
    """Read the blocks of both golden compensators, print and return the rows; quick: those of one compensator."""
    del seed  # nothing is drawn
    every = [
        text
        for root in (ROOTS[:1] if quick else ROOTS)
        for dialect in ("codesys", "twincat")
        for interface in ("plc", "codes")
        for text in texts(root, dialect, interface).values()
    ]
    different = list(dict.fromkeys(every))
    broken, count = different[0].replace("NOT valid)", "NOT valid", 1), f"texts of {len(different)} that"
    rows = [Row(what="blark is not installed: pip install blark", value=1, limit=0)]
    if find_spec("blark") is not None:
        rows = [
            Row(what=f"{count} blark can't read", value=sum(map(errors, different)), limit=0),
            Row(what="blocks with an error in them that blark reads", value=1 - errors(broken), limit=0),
        ]
    if compiler := shutil.which("iec2c"):
        rows += [
            Row(
                what=f"{count} iec2c can't compile",
                value=sum(uncompiled(text, compiler) for text in different),
                limit=0,
            ),
            Row(
                what="blocks with an error in them that iec2c compiles", value=1 - uncompiled(broken, compiler), limit=0
            ),
        ]
    else:
        rows.append(Row(what="blocks that iec2c compiled: it is not on the path (matiec)", value=0))
    print_rows("Function blocks in other readers", rows)
    return rows
