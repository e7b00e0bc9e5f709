"""The files of the current controller: dz_current.c and .h, their constants and what else they print."""

from collections.abc import Sequence
from textwrap import wrap

from dzdesign.codegen.core.constants import COLUMNS, Constant, Define, Table, defines
from dzdesign.codegen.core.files import CoreFile
from dzdesign.codegen.core.misra import misra_lines
from dzdesign.core.strict_templates import strict_templates
from dzdesign.design.current.loop import CORRECTION_SHIFT, CurrentLoop

HERE = "codegen/dzdesign/codegen/core/current_files.py"
LOOP = "design/dzdesign/design/current/loop.py"
CHOICE = "design/dzdesign/design/current/choosing.py"
CURRENT_SOURCES, CURRENT_HEADERS = ("dz_current.c",), ("dz_current.h",)
#: Bits of the controller's word of faults, and what each says.
FAULT_BITS = {
    "NO_OFFSET": "the offset of the current's codes is not calibrated yet",
    "SENSOR": "that offset is too far from the designed one",
    "OPEN": "no current where one must flow: wire or coil open",
    "SHORT": "the current is beyond the converter's range",
    "OVER": "the current stayed above its limit",
}


def current_files(loop: CurrentLoop) -> dict[str, CoreFile]:
    """Return the files of the current controller, by name."""
    inside, outside, table = current_constants(loop), current_interface(loop), supply_table(loop)
    tables: tuple[Constant, ...] = () if table is None else (table,)
    words = {
        "supply": loop.supply is not None,
        "samples": loop.samples,
        "offset_ticks": 1 << loop.offset_shift,
        "gain_unit": 1 << loop.gain_shift,
    }
    source = {
        **words,
        "misra_lines": misra_lines(),
        "current_defines": defines(inside),
        "supply_table": table,
        "supply_lines": [] if table is None else _lines(table),
    }
    header = {**words, "misra_lines": misra_lines("dz_current.h"), "interface_defines": defines(outside)}
    return {
        "dz_current.c": CoreFile(template="dz_current.c.jinja", values=source, constants=(*inside, *tables)),
        "dz_current.h": CoreFile(template="dz_current.h.jinja", values=header, constants=tuple(outside)),
    }


def current_texts(loop: CurrentLoop, banner: Sequence[str] = ()) -> dict[str, str]:
    """Return the text of each file of the current controller by itself, without a compensator around it."""
    templates = strict_templates("dzdesign.codegen.core", autoescape=False)
    return {
        name: templates.get_template(file.template).render(banner=banner, **file.values)
        for name, file in current_files(loop).items()
    }


def current_interface(loop: CurrentLoop) -> list[Define]:
    """Return what a caller must know: `#define`s of dz_current.h."""
    return [
        Define(symbol="DZ_CURRENT_SAMPLES", value=loop.samples, equation="samples of the current in a sum",
               engineering="equally far apart in a PWM period", data=("current_drive.loop.samples",), generator=LOOP),
        Define(symbol="DZ_CURRENT_OFFSET_TICKS", value=1 << loop.offset_shift,
               equation="sums that the offset is the mean of", engineering="with the output off",
               data=("current_drive.loop.offset_shift",), generator=LOOP),
        *current_fault_bits(),
    ]  # fmt: skip


def current_fault_bits() -> list[Define]:
    """Return the bits of the controller's word of faults: a convention, from no datum."""
    return [
        Define(symbol=f"DZ_CURRENT_{name}", value=1 << place, equation=f"bit {place} of the faults",
               engineering=text, rounding="a convention", generator=HERE)
        for place, (name, text) in enumerate(FAULT_BITS.items())
    ]  # fmt: skip


def current_constants(loop: CurrentLoop) -> list[Define]:
    """Return the `#define`s of dz_current.c."""
    unit, per_count = 1 << loop.gain_shift, "PWM counts per count of "
    rows: list[tuple[str, int, str, str, str, tuple[str, ...]]] = [
        ("COMPARE_LIMIT", loop.compare_limit, "plain", "largest compare value", "of the PWM", ("compare_limit",)),
        ("RATE", loop.rate, "uint32", "largest change of the set point in a period", "counts", ("rate",)),
        ("CURRENT_GAIN", loop.current_gain, "plain", "counts of current for a code of the sum, over 2^CURRENT_SHIFT",
         f"{loop.current_gain / (1 << loop.current_shift):.6g}", ("current_gain", "current_shift")),
        ("CURRENT_SHIFT", loop.current_shift, "plain", "fractional bits of CURRENT_GAIN", "", ("current_shift",)),
        ("CURRENT_HALF", 1 << (loop.current_shift - 1), "plain", "half a count of current", "rounds to nearest",
         ("current_shift",)),
        ("GAIN_SHIFT", loop.gain_shift, "plain", "fractional bits of the gains", "", ("gain_shift",)),
        ("GAIN_HALF", unit // 2, "plain", "half a PWM count", "rounds to nearest", ("gain_shift",)),
        ("PROPORTIONAL", loop.proportional, "plain", f"{per_count}error, over 2^GAIN_SHIFT",
         f"{loop.proportional / unit:.6g}", ("proportional", "gain_shift")),
        ("INTEGRAL", loop.integral, "plain", f"{per_count}error in each period, over 2^GAIN_SHIFT",
         f"{loop.integral / unit:.6g}", ("integral", "gain_shift")),
        ("FEED_FORWARD", loop.feed_forward, "plain", f"{per_count}set point, over 2^GAIN_SHIFT: R i over the supply",
         f"{loop.feed_forward / unit:.6g}", ("feed_forward", "gain_shift")),
        ("INTEGRAL_LIMIT", loop.integral_limit << loop.gain_shift, "uint32", "largest magnitude of the integral",
         f"{loop.integral_limit} PWM counts", ("integral_limit", "gain_shift")),
        ("RELEASE", loop.release << loop.gain_shift, "uint32", "output below the integral by",
         f"{loop.release} PWM counts: the current does not overshoot on release", ("release", "gain_shift")),
        ("OFFSET_NOMINAL", loop.offset_nominal, "plain", "sum without current", "as designed", ("offset_nominal",)),
        ("OFFSET_LOW", max(loop.offset_nominal - loop.offset_tolerance, 0), "plain", "lowest plausible offset", "",
         ("offset_nominal", "offset_tolerance")),
        ("OFFSET_HIGH", loop.offset_nominal + loop.offset_tolerance, "plain", "highest plausible offset", "",
         ("offset_nominal", "offset_tolerance")),
        ("OFFSET_SHIFT", loop.offset_shift, "plain", "the power of two in DZ_CURRENT_OFFSET_TICKS", "",
         ("offset_shift",)),
        ("OFFSET_HALF", (1 << loop.offset_shift) // 2, "plain", "half of the mean's divisor", "rounds to nearest",
         ("offset_shift",)),
        ("SHORT_SUM", loop.short_sum, "plain", "sum from which the load counts as shorted", "", ("short_sum",)),
        ("OVER_SUM", loop.over_sum, "plain", "sum minus offset from which the current is too high", "", ("over_sum",)),
        ("OVER_TICKS", loop.over_ticks, "plain", "such PWM periods in a row that are a fault", "", ("over_ticks",)),
        ("OPEN_SUM", loop.open_sum, "plain", "sum minus offset below which no current flows", "", ("open_sum",)),
        ("OPEN_COMPARE", loop.open_compare, "plain", "compare value from which current must flow", "",
         ("open_compare",)),
        ("OPEN_TICKS", loop.open_ticks, "plain", "such PWM periods in a row that are a fault", "", ("open_ticks",)),
    ]  # fmt: skip
    if loop.supply:
        low, high = loop.supply.valid_codes
        keys = ("supply.valid_codes", "supply.step_codes")
        rows += [
            ("SUPPLY_LOW", low, "plain", "lowest code of the supply", "", keys),
            ("SUPPLY_HIGH", high, "plain", "highest code of the supply", "", keys),
            ("SUPPLY_STEP", loop.supply.step_codes, "plain", "codes between two nodes", "", keys),
            ("SUPPLY_SHIFT", loop.supply.step_codes.bit_length() - 1, "plain", "the power of two in SUPPLY_STEP", "",
             keys),
            ("CORRECTION_SHIFT", CORRECTION_SHIFT, "plain", "fractional bits of the correction", "", ()),
            ("CORRECTION_HALF", 1 << (CORRECTION_SHIFT - 1), "plain", "half a PWM count", "rounds to nearest", ()),
        ]  # fmt: skip
    return [
        Define(symbol=symbol, value=value, literal=literal, equation=text, engineering=engineering or "as designed",
               data=tuple(f"current_drive.loop.{key}" for key in keys), generator=CHOICE if keys else HERE)
        for symbol, value, literal, text, engineering, keys in rows
    ]  # fmt: skip


def supply_table(loop: CurrentLoop) -> Table | None:
    """Return the supply's correction; None where the supply is not measured."""
    if loop.supply is None:
        return None
    return Table(
        symbol="correction",
        value=tuple((node, 0) for node in loop.supply.nodes),
        equation="nominal over measured supply times 2^CORRECTION_SHIFT, every SUPPLY_STEP codes from SUPPLY_LOW",
        engineering="straight between them",
        rounding="rounded to nearest",
        data=("current_drive.loop.supply.nodes",),
        generator=CHOICE,
    )


def _lines(table: Table) -> list[str]:
    """Return a table's numbers in lines of C."""
    return wrap(", ".join(f"{number}u" for number, _ in table.value), COLUMNS - 8)
