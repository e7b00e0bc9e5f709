"""The files of a core in block form: of each its template, and what that prints."""

from collections.abc import Iterator, Sequence

from dzdesign.codegen.calibration.built_for import BuiltFor
from dzdesign.codegen.calibration.layout import (
    LAYOUT,
    LENGTH_WORDS,
    MAGIC,
    NO_INTERLOCK,
    NODE_MASK,
    NODES,
    PLAY_MASK,
    PLAY_NODES,
    SHAPE_BITS,
    SUPPLY_MASK,
    SUPPLY_NODES,
    CalibrationBlock,
    CurrentBlock,
    SideBlock,
    Words,
    entries,
)
from dzdesign.codegen.calibration.limits import LARGEST_CODES, NAMED, OF_CURRENT, crc_steps, largest_node
from dzdesign.codegen.core.constants import LITERALS, Define, Table, c_comment, defines
from dzdesign.codegen.core.current_files import current_fault_bits
from dzdesign.codegen.core.drive_constants import drive_status_constants, status_constants
from dzdesign.codegen.core.files import CoreFile, Values
from dzdesign.codegen.core.integer_form import INT32_MAX
from dzdesign.codegen.core.misra import misra_lines
from dzdesign.codegen.core.signal_constants import difference_place
from dzdesign.core.strict_templates import strict_templates
from dzdesign.design.current.loop import CORRECTION_SHIFT
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signals import WEIGHT_SHIFT

HERE = "codegen/dzdesign/codegen/calibration/files.py"
LIMITS_FILE = "codegen/dzdesign/codegen/calibration/limits.py"
LAYOUT_FILE = "codegen/dzdesign/codegen/calibration/layout.py"
#: Bits of what dz_calibration_check() finds wrong.
FINDINGS = {
    "FORMAT": "not a calibration block, or one of another layout or length",
    "CRC": "damaged: the CRC-32 is not that of the block",
    "FIRMWARE": "for a firmware with other wiring, converter or rates",
    "SIGNALS": "a code of command or pressures outside the range of the arithmetic",
    "LAW": "a number of the law outside the range of the arithmetic, or a law that falls with the command",
    "DRIVE": "a number of the drive functions outside the range of the arithmetic",
    "CURRENT": "a number of the current controller outside the range of the arithmetic",
}
#: Of the drive's status word: the bit of a block that was refused.
CALIBRATION_PLACE = 8
#: Structs of the block, in the order in which C needs them, and their names there.
STRUCTS = {SideBlock: "dz_calibration_side", CurrentBlock: "dz_calibration_current", CalibrationBlock: "dz_calibration"}


def block_core_files(built: BuiltFor) -> dict[str, CoreFile]:
    """Return every file of the core in block form, by its name: they depend on no valve."""
    return {
        "dz_calibration.h": calibration_header(built),
        "dz_calibration.c": check_file(built),
        **block_law_files(built),
        **block_drive_files(built),
        **block_current_files(built),
    }


def calibration_header(built: BuiltFor) -> CoreFile:
    """Return dz_calibration.h: the struct, and what the firmware is compiled for."""
    constants = [*_interface(built), *_findings()]
    values: Values = {
        "misra_lines": misra_lines("dz_calibration.h"),
        "interface_defines": defines(constants),
        "structs": [{"name": name, "members": list(_declarations(kind))} for kind, name in STRUCTS.items()],
    }
    return CoreFile(template="dz_calibration.h.jinja", values=values, constants=tuple(constants))


def block_law_files(built: BuiltFor) -> dict[str, CoreFile]:
    """Return dz_comp.c and dz_comp.h."""
    bits, numbers = status_constants(), _law_numbers(built)
    header: Values = {
        "misra_lines": misra_lines(),
        "status_defines": defines(bits),
        "bipolar": built.has("BIPOLAR"),
        "swapped": built.has("SWAPPED"),
    }
    source: Values = {"misra_lines": misra_lines(), "law_defines": defines(numbers), "sides": _sides(built)}
    return {
        "dz_comp.c": CoreFile(template="dz_comp_block.c.jinja", values=source, constants=tuple(numbers)),
        "dz_comp.h": CoreFile(template="dz_comp_block.h.jinja", values=header, constants=tuple(bits)),
    }


def block_drive_files(built: BuiltFor) -> dict[str, CoreFile]:
    """Return dz_drive.c and dz_drive.h."""
    outside = _drive_interface(built)
    inside = [
        _limit("RAMP_UNIT", RAMP_UNIT, "uint32", "unit of the ramped command, a code of command"),
        _limit("NO_INTERLOCK", NO_INTERLOCK, "plain", "the drive waits for no zero command"),
        _limit("LARGEST_NUMBER", INT32_MAX, "uint32", "largest word that stands for a number above zero"),
        _limit("LARGEST_SHIFT", 31, "plain", "largest shift of a word of 32 bits"),
        _limit("PLAY_SHIFT_MASK", 15, "plain", "mask of play_step_shift"),
    ]
    words: Values = {"bipolar": built.has("BIPOLAR"), "rises": not built.has("FALLING")}
    header = {**words, "misra_lines": misra_lines("dz_drive.h, block form"), "interface_defines": defines(outside),
              "ramp_unit": RAMP_UNIT, "sample_Hz": built.sample_Hz}  # fmt: skip
    source = {**words, "misra_lines": misra_lines(), "drive_defines": defines(inside)}
    return {
        "dz_drive.c": CoreFile(template="dz_drive_block.c.jinja", values=source, constants=tuple(inside)),
        "dz_drive.h": CoreFile(template="dz_drive_block.h.jinja", values=header, constants=tuple(outside)),
    }


def _drive_interface(built: BuiltFor) -> list[Define]:
    ticks = built.tick_Hz // built.sample_Hz
    return [
        Define(symbol="DZ_DRIVE_TICKS_PER_SAMPLE", value=ticks, equation="PWM periods from one sample to the next",
               engineering=f"{built.tick_Hz} periods and {built.sample_Hz} samples a second", generator=HERE),
        *drive_status_constants(),
        Define(symbol="DZ_STATUS_CALIBRATION", value=1 << CALIBRATION_PLACE, rounding="a convention", generator=HERE,
               equation=f"bit {CALIBRATION_PLACE} of the drive's status word",
               engineering="dz_calibration_check() refused the block: the output is released"),
    ]  # fmt: skip


def block_current_files(built: BuiltFor) -> dict[str, CoreFile]:
    """Return dz_current.c and dz_current.h; nothing without current control."""
    if not built.has("CURRENT"):
        return {}
    bits, inside = current_fault_bits(), [_limit("SHIFT_MASK", 15, "plain", "mask of a shift")]
    if built.has("SUPPLY"):
        inside += [
            _limit("CORRECTION_SHIFT", CORRECTION_SHIFT, "plain", "fractional bits of the correction"),
            _limit("CORRECTION_HALF", 1 << (CORRECTION_SHIFT - 1), "plain", "half a PWM count: rounds to nearest"),
        ]
    words: Values = {"supply": built.has("SUPPLY"), "samples": built.samples}
    header = {**words, "misra_lines": misra_lines(), "interface_defines": defines(bits)}
    source = {**words, "misra_lines": misra_lines(), "current_defines": defines(inside)}
    return {
        "dz_current.c": CoreFile(template="dz_current_block.c.jinja", values=source, constants=tuple(inside)),
        "dz_current.h": CoreFile(template="dz_current_block.h.jinja", values=header, constants=tuple(bits)),
    }


def check_file(built: BuiltFor) -> CoreFile:
    """Return dz_calibration.c, which blocks the core may use."""
    named = NAMED + (OF_CURRENT if built.has("CURRENT") else ())
    limits = [
        *_shifts(built),
        _limit("LARGEST_NODE", largest_node(built.beta_step), "uint32", "largest node: times DZ_BETA_STEP below 2^31"),
        *(_limit(*each) for each in named),
    ]
    equation, of = "four zero bits more of a CRC-32", "polynomial 04C11DB7h, reflected"
    rows = tuple((step, 0) for step in crc_steps())
    table = Table(symbol="steps", value=rows, equation=equation, engineering=of, generator=LIMITS_FILE)
    steps = [LITERALS["uint32"].format(step) for step, _ in table.value]
    values: Values = {
        "misra_lines": misra_lines(),
        "limit_defines": defines(limits),
        "rises": not built.has("FALLING"),
        "bipolar": built.has("BIPOLAR"),
        "swapped": built.has("SWAPPED"),
        "current": built.has("CURRENT"),
        "supply": built.has("SUPPLY"),
        "crc_steps": [", ".join(steps[at : at + 4]) for at in range(0, len(steps), 4)],
        # Of a converter with fewer codes no command is too long for the drive functions.
        "wide_codes": built.code_max > LARGEST_CODES,
    }
    return CoreFile(template="dz_calibration.c.jinja", values=values, constants=(*limits, table))


def _limit(symbol: str, value: int, literal: str, text: str) -> Define:
    return Define(symbol=symbol, value=value, literal=literal, equation=text, engineering=f"{value}",
                  generator=LIMITS_FILE)  # fmt: skip


def _sides(built: BuiltFor) -> list[Values]:
    """Return the C that depends on the sign of command: ending of the names, and which way the signals count."""
    rises, falls = "u - side->band_end", "side->band_end - u"
    forward, back = (falls, rises) if built.has("FALLING") else (rises, falls)
    swapped = "0u - " if built.has("SWAPPED") else ""
    positive = {"s": "", "text": "positive", "from_band": forward, "turn": "", "pad": ""}
    negative = {"s": "_negative", "text": "negative", "from_band": back, "turn": swapped, "pad": " " * 9}
    return [positive, negative] if built.has("BIPOLAR") else [positive]


def _law_numbers(built: BuiltFor) -> list[Define]:
    return [
        *_shifts(built),
        _limit("LARGEST_NUMBER", INT32_MAX, "uint32", "largest word that stands for a number above zero"),
        Define(symbol="LARGEST_SHIFT", value=31, equation="largest shift of a word of 32 bits", engineering="all ones",
               generator=HERE),
        Define(symbol="LARGEST_WIDE_SHIFT", value=63, equation="largest shift of 64 bits", engineering="all ones",
               generator=HERE),
        difference_place(),
    ]  # fmt: skip


def _shifts(built: BuiltFor) -> list[Define]:
    """Return from weighted codes to codes, and from these to nodes."""
    return [
        Define(symbol="WEIGHT_SHIFT", value=WEIGHT_SHIFT, equation="from weighted codes to codes of sensor A",
               engineering=f"1/2^{WEIGHT_SHIFT}", rounding="the difference is rounded down", generator=HERE),
        Define(symbol="BETA_STEP_SHIFT", value=built.beta_step.bit_length() - 1, generator=HERE,
               equation="the power of two in DZ_BETA_STEP", engineering=f"1/{built.beta_step}"),
    ]  # fmt: skip


def texts(files: dict[str, CoreFile], banner: Sequence[str] = ()) -> dict[str, str]:
    """Return the text of each file, by name, without a firmware around it."""
    templates = strict_templates("dzdesign.codegen.calibration", autoescape=False)
    return {name: templates.get_template(file.template).render(banner=banner, **file.values) for name, file in
            files.items()}  # fmt: skip


def _declarations(kind: type) -> Iterator[str]:
    """Yield the lines of a struct's members, each with its comment."""
    own = entries(kind)
    for name in kind.__dataclass_fields__:  # type: ignore[attr-defined]
        if name in own:
            yield from c_comment(_comment(own[name]))
            yield f"{_declared(name, own[name])};"
        elif name == "sides":
            yield from c_comment("Of positive, then of negative commands; all zero where there are none.")
            yield "struct dz_calibration_side sides[2];"
        else:
            yield from c_comment("All zero without current control.")
            yield "struct dz_calibration_current current;"


def _declared(name: str, entry: Words) -> str:
    if entry.pairs:
        return f"struct dz_calibration_node {name}[{entry.count // 2}]"
    count = entry.count * max(entry.bits // 32, 1)
    return f"{'uint16_t' if entry.bits == 16 else 'uint32_t'} {name}{f'[{count}]' if count > 1 else ''}"


def _comment(entry: Words) -> str:
    text = entry.text[0].upper() + entry.text[1:]
    return f"{text}{'; low word first' if entry.bits == 64 else ''}{f' ({entry.unit})' if entry.unit else ''}."


def _interface(built: BuiltFor) -> list[Define]:
    """Return what the firmware is compiled for, and the numbers of the layout."""

    def define(symbol: str, value: int, equation: str, engineering: str, literal: str = "plain") -> Define:
        return Define(symbol=symbol, value=value, equation=equation, engineering=engineering, literal=literal,
                      generator=LAYOUT_FILE)  # fmt: skip

    magic = int.from_bytes(MAGIC, "little")
    shape = ", ".join(text for name, text in SHAPE_BITS.items() if built.has(name)) or "one solenoid"
    return [
        define("DZ_COMPARE_MAX", built.compare_max, "PWM compare value of u_max", "100 % duty"),
        define("DZ_ADC_CODE_MAX", built.code_max, "largest code of the converter", "the top of its range"),
        define("DZ_SAMPLE_HZ", built.sample_Hz, "samples per second", "of the firmware's timer"),
        define("DZ_TICK_HZ", built.tick_Hz, "PWM periods per second", "of the firmware's timer"),
        define("DZ_BETA_STEP", built.beta_step, "codes of pressure drop between two nodes of beta", "a power of two"),
        define("DZ_CURRENT_SAMPLES", built.samples, "samples of the current in a sum", "0 without current control"),
        define("DZ_CALIBRATION_SHAPE", built.shape, "what this firmware is compiled for", shape),
        define("DZ_CALIBRATION_MAGIC", magic, "first 32 bits of a block", f"octets {MAGIC.decode()}", "uint32"),
        define("DZ_CALIBRATION_LAYOUT", LAYOUT, "version of the block's layout", "a convention"),
        define("DZ_CALIBRATION_WORDS", LENGTH_WORDS, "words of 16 bits in a block", f"{2 * LENGTH_WORDS} octets"),
        define("DZ_CALIBRATION_NODES", NODES, "room for nodes of beta", "the fallback and those of the table"),
        define("DZ_CALIBRATION_NODE_MASK", NODE_MASK, "largest index of a node that has a successor", "all ones"),
        define("DZ_CALIBRATION_PLAY_NODES", PLAY_NODES, "room for nodes of the play's width", "each side"),
        define("DZ_CALIBRATION_PLAY_MASK", PLAY_MASK, "largest index of a node that has a successor", "all ones"),
        define("DZ_CALIBRATION_SUPPLY_NODES", SUPPLY_NODES, "room for nodes of the supply's correction", "one table"),
        define("DZ_CALIBRATION_SUPPLY_MASK", SUPPLY_MASK, "largest index of a node that has a successor", "all ones"),
    ]  # fmt: skip


def _findings() -> list[Define]:
    return [
        Define(symbol=f"DZ_CALIBRATION_{name}", value=1 << place, equation=f"bit {place} of dz_calibration_check()",
               engineering=text, rounding="a convention", generator=HERE)
        for place, (name, text) in enumerate(FINDINGS.items())
    ]  # fmt: skip
