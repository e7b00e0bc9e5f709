"""The files of the core: of each its template, and what that prints.

The law, the drive functions and the current controller are one form of C that reads a `struct dz_calibration`: of a
firmware in block form the one that its caller passes, else the `static const` one of dz_valve.h, which the compiler
folds into the code.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from textwrap import wrap

from dzdesign.codegen.calibration.acceptance import LARGEST_CODES, NAMED, OF_CURRENT, largest_node
from dzdesign.codegen.calibration.block import built_for, numbers_of
from dzdesign.codegen.calibration.layout import (
    INNER,
    LAYOUT,
    LENGTH_WORDS,
    MAGIC,
    NO_INTERLOCK,
    SHAPE_BITS,
    BuiltFor,
    CalibrationBlock,
    CurrentBlock,
    SensorBlock,
    SideBlock,
    Words,
    entries,
)
from dzdesign.codegen.calibration.numbers import ValvePage
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.core.certificate_text import (
    KAPPA_ROUNDING,
    U_MIN0_ROUNDING,
    certificate_lines,
    equation_of,
    zero_command,
)
from dzdesign.codegen.core.constants import (
    COLUMNS,
    LITERALS,
    OF_B,
    Define,
    Values,
    c_comment,
    current_fault_bits,
    defines,
    drive_status_constants,
    status_constants,
)
from dzdesign.codegen.core.integer_form import INT32_MAX
from dzdesign.codegen.target import Target
from dzdesign.derivation.law import law
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CORRECTION_SHIFT
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.pressure_inputs import what_machine_switches
from dzdesign.design.signals import INPUT_NAMES, WEIGHT_SHIFT

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
#: Structs of the block, in the order in which C needs them, and their names there.
STRUCTS = {
    SensorBlock: "dz_calibration_sensor",
    SideBlock: "dz_calibration_side",
    CurrentBlock: "dz_calibration_current",
    CalibrationBlock: "dz_calibration",
}
#: Members whose length is a macro of the firmware.
LENGTHS = {
    "nodes": "DZ_CALIBRATION_NODES",
    "play": "DZ_CALIBRATION_PLAY_NODES",
    "supply": "DZ_CALIBRATION_SUPPLY_NODES",
}
#: The numbers of a valve, beside the law.
VALVE_HEADER = "dz_valve.h"
#: What holds a block in a target's folder, and gives it a flash sector of its own.
BLOCK_SOURCE, BLOCK_HEADER, LINKER_FILE = "dz_block.c", "dz_block.h", "dz_calibration.cmd"
#: 04C11DB7h, reflected.
CRC_POLYNOMIAL = 0xEDB88320


def block_core_files(built: BuiltFor) -> dict[str, Values]:
    """Return what each file of the core in block form prints, by its name: it depends on no valve."""
    return _files(built)


def fixed_core_files(compensator: Compensator) -> dict[str, Values]:
    """Return what each file of the core with the numbers of a compensator in it prints, by its name."""
    built = built_for(compensator, fixed=True)
    return valve_files(ValvePage(compensator=compensator, block=numbers_of(compensator), built=built))


def valve_files(page: ValvePage) -> dict[str, Values]:
    """Return what each file of a core that has these numbers in it prints."""
    return {VALVE_HEADER: _valve_header(page), **_files(page.built, page.block)}


def _files(built: BuiltFor, numbers: CalibrationBlock | None = None) -> dict[str, Values]:
    """Return what both forms have; `numbers` are those that stand in the firmware."""
    plan = _plan(built)
    return {name: {**plan, "constants": defines(constants)} for name, constants in _constants(built, numbers).items()}


def core_sources(*, block: bool, current: bool) -> tuple[str, ...]:
    """Return the sources of the core."""
    return (*(("dz_calibration.c",) if block else ()), "dz_comp.c", "dz_drive.c",
            *(("dz_current.c",) if current else ()))  # fmt: skip


def core_headers(*, block: bool, current: bool) -> tuple[str, ...]:
    """Return the headers of the core."""
    return ("dz_calibration.h", *(() if block else (VALVE_HEADER,)), "dz_comp.h", "dz_drive.h",
            *(("dz_current.h",) if current else ()))  # fmt: skip


def _form(built: BuiltFor) -> Values:
    """Return how the functions of a form get the numbers: their first parameter, or a line that names them."""
    return {
        "fixed": built.fixed,
        "parameter": "" if built.fixed else "const struct dz_calibration *block, ",
        "given": "" if built.fixed else "block, ",
        "numbers": "const struct dz_calibration *block = &dz_valve;",
        "bipolar": built.has("BIPOLAR"),
        "three": "C" in built.inputs,
        "pressures": {name: f"p_{name.lower()}_adc" for name in built.inputs},
        "shunts": built.has("SHUNTS"),
    }


def _plan(built: BuiltFor) -> Values:
    """Return what the templates print of wiring, outputs, converter and rates."""
    steps = [LITERALS["uint32"].format(step) for step in _crc_steps()]
    return {
        **_form(built),
        "rises": not built.has("FALLING"),
        "current": built.has("CURRENT"),
        "supply": built.has("SUPPLY"),
        "samples": built.samples,
        "sample_Hz": built.sample_Hz,
        "ramp_unit": RAMP_UNIT,
        "sides": _sides(built),
        "structs": [
            {"name": name, "members": list(_declarations(kind, built))}
            for kind, name in STRUCTS.items()
            if kind is not CurrentBlock or not built.fixed or built.has("CURRENT")
        ],
        "crc_steps": [", ".join(steps[at : at + 4]) for at in range(0, len(steps), 4)],
        # Of a converter with fewer codes no command is too long for the drive functions.
        "wide_codes": built.code_max > LARGEST_CODES,
    }


def _valve_header(page: ValvePage) -> Values:
    """Return dz_valve.h: the numbers, and what they are certified for."""
    c = page.compensator
    chosen, units = law(c.law), c.valve.recorded_units.of_controller
    return {
        **_form(page.built),
        "u_max": units.text(float(c.u_max_V), "g V"),
        "law_text": str(chosen.output).replace("**", "^"),
        "law_equation": equation_of(chosen),
        "transition_codes": c.transition_codes,
        "sides": [
            {
                "text": f"{'Positive' if sign > 0 else 'Negative'} commands. " if c.two_sided else "",
                "kappa": f"{_rational(c.side(sign).drive_range_over_u_max)}, {KAPPA_ROUNDING}",
                "u_min0": f"{_rational(c.side(sign).u_min0_over_u_max)}, {U_MIN0_ROUNDING}",
                "at_zero": zero_command(c, sign),
                "certificate": certificate_lines(c, sign),
            }
            for sign in c.signals.signs
        ],
        "switched": wrap(what_machine_switches(c), COLUMNS - 3),
        "lines": page.lines(),
    }


def _rational(value: Fraction) -> str:
    return f"{value.numerator}/{value.denominator} = {float(value):.6f}"


def _constants(built: BuiltFor, numbers: CalibrationBlock | None) -> dict[str, list[Define]]:
    """Return the constants of each file, in the order of the files."""
    step_shift = Define(symbol="BETA_STEP_SHIFT", value=built.beta_step.bit_length() - 1,
                        equation="the power of two in DZ_BETA_STEP", engineering=f"1/{built.beta_step}")  # fmt: skip
    found = {"dz_calibration.h": _interface(built)}
    if not built.fixed:
        node = "largest node: times DZ_BETA_STEP below 2^31"
        found["dz_calibration.h"] += _findings()
        found["dz_calibration.c"] = [
            step_shift,
            _limit("LARGEST_NODE", largest_node(built.beta_step), "uint32", node),
            *(_limit(*each) for each in NAMED + (OF_CURRENT if built.has("CURRENT") else ())),
        ]
    found["dz_comp.c"] = [
        step_shift,
        _limit("TOP_BIT", INT32_MAX + 1, "int64", "the top bit of a word, set where it stands for a negative number"),
        _limit("LARGEST_SHIFT", 31, "plain", "largest shift of a word of 32 bits"),
        _limit("LARGEST_WIDE_SHIFT", 63, "plain", "largest shift of 64 bits"),
    ]
    found["dz_comp.h"] = status_constants(built.inputs)
    found["dz_drive.c"] = [
        _limit("RAMP_UNIT", RAMP_UNIT, "uint32", "unit of the ramped command, a code of command"),
        _limit("NO_INTERLOCK", NO_INTERLOCK, "plain", "the drive waits for no zero command"),
        _limit("LARGEST_NUMBER", INT32_MAX, "uint32", "largest word that stands for a number above zero"),
        _limit("LARGEST_SHIFT", 31, "plain", "largest shift of a word of 32 bits"),
        _limit("PLAY_SHIFT_MASK", 15, "plain", "mask of play_step_shift"),
    ]
    ticks = built.tick_Hz // built.sample_Hz
    found["dz_drive.h"] = [
        Define(symbol="DZ_DRIVE_TICKS_PER_SAMPLE", value=ticks, equation="PWM periods from one sample to the next",
               engineering=f"{built.tick_Hz} periods and {built.sample_Hz} samples a second"),
        *([] if numbers is None else [
            Define(symbol="DZ_DRIVE_COMMAND_ZERO", value=numbers.command_zero, equation="code of zero command",
                   engineering="command_zero of dz_valve.h")
        ]),
        *drive_status_constants(block=not built.fixed),
    ]  # fmt: skip
    if built.has("CURRENT"):
        found["dz_current.c"] = [_limit("SHIFT_MASK", 15, "plain", "mask of a shift")]
        found["dz_current.h"] = current_fault_bits(two=built.has("BIPOLAR"))
    if built.has("CURRENT") and built.has("BIPOLAR"):
        found["dz_current.c"].append(_limit("OF_B", OF_B, "plain", "places by which faults of solenoid B stand higher"))
    if built.has("CURRENT") and numbers is not None:
        sums = (1 + built.has("SHUNTS")) << numbers.current.offset_shift
        offset = Define(symbol="DZ_CURRENT_OFFSET_TICKS", value=sums, equation="sums of the offset's calibration",
                        engineering="with the output off")  # fmt: skip
        found["dz_current.h"].insert(0, offset)
    if built.has("SUPPLY"):
        found["dz_current.c"] += [
            _limit("CORRECTION_SHIFT", CORRECTION_SHIFT, "plain", "fractional bits of the correction"),
            _limit("CORRECTION_HALF", 1 << (CORRECTION_SHIFT - 1), "plain", "half a PWM count: rounds to nearest"),
        ]
    return found


def _crc_steps() -> tuple[int, ...]:
    """Return what four zero bits more make of the CRC-32 of four bits, for each value of these.

    Examples
    --------
    >>> [f"{step:08X}" for step in _crc_steps()[:3]]
    ['00000000', '1DB71064', '3B6E20C8']
    """
    found = list(range(16))
    for _ in range(4):
        found = [step >> 1 ^ (CRC_POLYNOMIAL if step & 1 else 0) for step in found]
    return tuple(found)


def _limit(symbol: str, value: int, literal: str, text: str) -> Define:
    return Define(symbol=symbol, value=value, literal=literal, equation=text, engineering=f"{value}")


def _sides(built: BuiltFor) -> list[Values]:
    """Return the C that depends on the sign of command: ending of the names, and which way the signals count."""
    rises, falls = "u - side->band_end", "side->band_end - u"
    forward, back = (falls, rises) if built.has("FALLING") else (rises, falls)
    positive = {"s": "", "text": "positive", "from_band": forward, **_pair(built, 1)}
    negative = {"s": "_negative", "text": "negative", "from_band": back, **_pair(built, -1)}
    return [positive, negative] if built.has("BIPOLAR") else [positive]


def _pair(built: BuiltFor, sign: int) -> Values:
    """Return the pressure inputs of a side: of each its name, that of its code, and its sensor in the struct."""
    return {
        place: {"name": name, "code": f"p_{name.lower()}_adc", "sensor": f"block->sensors[{INPUT_NAMES.index(name)}]"}
        for place, name in zip(("ahead", "behind"), built.pair(sign), strict=True)
    }


def _declarations(kind: type, built: BuiltFor) -> Iterator[str]:
    """Yield the lines of a struct's members, each with its comment."""
    own = entries(kind)
    for name in kind.__dataclass_fields__:  # type: ignore[attr-defined]
        if name in own and built.keeps(own[name]):
            yield from c_comment(_comment(own[name]))
            yield f"{_declared(name, own[name])};"
        elif name == "sensors":
            yield from c_comment("Of the pressures A, B and C; all zero where there is none.")
            yield "struct dz_calibration_sensor sensors[DZ_CALIBRATION_SENSORS];"
        elif name == "sides":
            yield from c_comment("Of positive, then of negative commands; all zero where there are none.")
            yield "struct dz_calibration_side sides[DZ_CALIBRATION_SIDES];"
        elif name in INNER and (not built.fixed or built.has("CURRENT")):
            yield from c_comment("All zero without current control.")
            yield "struct dz_calibration_current current;"


def _declared(name: str, entry: Words) -> str:
    kind = "struct dz_calibration_node" if entry.pairs else "uint16_t" if entry.bits == 16 else "uint32_t"
    count = entry.count * max(entry.bits // 32, 1)
    length = LENGTHS.get(name, str(count) if count > 1 else "")
    return f"{kind} {name}{f'[{length}]' if length else ''}"


def _comment(entry: Words) -> str:
    text = entry.text[0].upper() + entry.text[1:]
    return f"{text}{'; low word first' if entry.bits == 64 else ''}{f' ({entry.unit})' if entry.unit else ''}."


def _interface(built: BuiltFor) -> list[Define]:
    """Return what the firmware is compiled for, and the numbers of the layout."""

    def define(symbol: str, value: int, equation: str, engineering: str, literal: str = "plain") -> Define:
        return Define(symbol=symbol, value=value, equation=equation, engineering=engineering, literal=literal)

    magic, sizes = int.from_bytes(MAGIC, "little"), built.sizes
    shape = ", ".join(text for name, text in SHAPE_BITS.items() if built.has(name)) or "one solenoid"
    found = [
        define("DZ_COMPARE_MAX", built.compare_max, "PWM compare value of u_max", "100 % duty"),
        define("DZ_ADC_CODE_MAX", built.code_max, "largest code of the converter", "the top of its range"),
        define("DZ_SAMPLE_HZ", built.sample_Hz, "samples per second", "of the firmware's timer"),
        define("DZ_TICK_HZ", built.tick_Hz, "PWM periods per second", "of the firmware's timer"),
        define("DZ_BETA_STEP", built.beta_step, "codes of pressure drop between two nodes of beta", "a power of two"),
        define("DZ_WEIGHT_SHIFT", WEIGHT_SHIFT, "from weighted codes to codes of the sensor ahead", "1/4096"),
    ]
    if not built.fixed:
        found += [
            define("DZ_CALIBRATION_SHAPE", built.shape, "what this firmware is compiled for", shape),
            define("DZ_CALIBRATION_MAGIC", magic, "first 32 bits of a block", f"octets {MAGIC.decode()}", "uint32"),
            define("DZ_CALIBRATION_LAYOUT", LAYOUT, "version of the block's layout", "a convention"),
            define("DZ_CALIBRATION_WORDS", LENGTH_WORDS, "words of 16 bits in a block", f"{2 * LENGTH_WORDS} octets"),
        ]
    if not built.fixed or built.has("CURRENT"):
        found.append(
            define("DZ_CURRENT_SAMPLES", built.samples, "samples of the current in a sum", "0 without current control")
        )
    found.append(define("DZ_CALIBRATION_SENSORS", sizes.sensors, "room for pressure sensors", "A, B, C"))
    found.append(define("DZ_CALIBRATION_SIDES", sizes.sides, "room for signs of command", "positive, negative"))
    for name, mask, what in (
        ("NODE", sizes.node_mask, "nodes of beta"),
        ("PLAY", sizes.play_mask, "nodes of the play's width"),
        ("SUPPLY", sizes.supply_mask, "nodes of the supply's correction"),
    ):
        if name == "SUPPLY" and built.fixed and not built.has("CURRENT"):
            continue
        nodes = "DZ_CALIBRATION_NODES" if name == "NODE" else f"DZ_CALIBRATION_{name}_NODES"
        found += [
            define(nodes, mask + 2, f"room for {what}", "two more than the mask"),
            define(f"DZ_CALIBRATION_{name}_MASK", mask, "largest index of a node that has a successor", "all ones"),
        ]
    return found


def _findings() -> list[Define]:
    return [
        Define(symbol=f"DZ_CALIBRATION_{name}", value=1 << place, equation=f"bit {place} of dz_calibration_check()",
               engineering=text, rounding="a convention")
        for place, (name, text) in enumerate(FINDINGS.items())
    ]  # fmt: skip


def block_templates(target: Target, block: CalibrationBlock | None) -> Mapping[str, str]:
    """Return the files that hold the block in a target's folder, path to template."""
    return {f"{target.folder}/{name}": f"{name}.jinja" for name in _files_of_block(target, block)}


def _files_of_block(target: Target, block: CalibrationBlock | None) -> tuple[str, ...]:
    return (BLOCK_SOURCE, BLOCK_HEADER, *([LINKER_FILE] if target.sector else [])) if block else ()


def block_values(compensator: Compensator, block: CalibrationBlock | None, target: Target) -> Values:
    """Return what the templates around the core print of the block; `block` is its calls' first argument."""
    current, lines, sector = compensator.current_drive, list[str](), target.sector
    if block:
        with_crc = replace(block, crc32=unpack(pack(block)).crc32)
        lines = ValvePage(compensator=compensator, block=with_crc, built=built_for(compensator)).lines()
    values: Values = {
        "block": "&dz_block, " if block else "",
        "block_files": _files_of_block(target, block),
        "block_sources": (BLOCK_SOURCE,) if block else (),
        "block_headers": (BLOCK_HEADER,) if block else (),
        "block_lines": lines,
        "command_zero": "dz_block.command_zero" if block else "DZ_DRIVE_COMMAND_ZERO",
        "offset_ticks": f"{current.loop.offset_ticks}u" if block and current else "DZ_CURRENT_OFFSET_TICKS",
        "sector": sector is not None,
    }
    if sector:
        place = {"block_address": f"{sector.address:#x}", "block_words": LENGTH_WORDS}
        return {**values, **place, "region": sector.region, "region_page": sector.page, "region_file": sector.file}
    return values
