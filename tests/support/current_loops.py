"""Current loops for the tests: the gains and limits of a coil of 4 ohm and 40 mH, with and without the supply."""

import re
from collections.abc import Sequence
from dataclasses import replace

from dzdesign.codegen.calibration.block import built_for, current_block, numbers_of
from dzdesign.codegen.calibration.files import valve_files
from dzdesign.codegen.calibration.numbers import ValvePage
from dzdesign.design.current.circuit import CurrentLoop, SupplyCorrection
from tests.support.core_texts import texts
from tests.support.core_variants import variant

PLAIN = CurrentLoop(
    full_counts=60000,
    compare_limit=57000,
    rate=4800,
    samples=8,
    current_gain=22500,
    current_shift=13,
    gain_shift=12,
    proportional=3300,
    integral=130,
    feed_forward=680,
    integral_limit=60000,
    release=768,
    offset_nominal=400,
    offset_tolerance=160,
    offset_shift=6,
    short_sum=32000,
    over_sum=27000,
    over_ticks=4,
    open_sum=400,
    open_compare=3000,
    open_ticks=50,
)
#: 16 V at code 1638 to 32 V at code 3276, nominal 24 V.
SUPPLY = SupplyCorrection(
    valid_codes=(1638, 3276),
    step_codes=64,
    nodes=tuple(round(24 / (16 + 64 * node * 40 / 4096) * 16384) for node in range(27)),
)
#: Gains, limits and ends as large as they may be.
LARGEST = replace(
    PLAIN,
    full_counts=65535,
    compare_limit=65535,
    current_gain=11500,
    current_shift=12,
    gain_shift=13,
    proportional=8191,
    integral=8191,
    feed_forward=8191,
    integral_limit=65535,
    release=65535,
    offset_shift=0,
    rate=65535,
)
LOOPS = {"plain": PLAIN, "supply": replace(PLAIN, supply=SUPPLY, integral_limit=5000, release=1000), "largest": LARGEST}


def current_texts(loop: CurrentLoop, banner: Sequence[str] = ()) -> dict[str, str]:
    """Return the files of a current controller by itself, its numbers beside those of the goldens' valve."""
    compensator = variant("default")
    built = built_for(compensator, fixed=True)
    sizes = replace(built.sizes, supply_mask=63 if loop.supply else 0)
    built = replace(built, shape=64 + 128 * bool(loop.supply), samples=loop.samples, sizes=sizes)
    numbers = replace(numbers_of(compensator), current=current_block(loop, sizes))
    made = texts(valve_files(ValvePage(compensator=compensator, block=numbers, built=built)), banner)
    # The stand-ins for dz_comp.h have these two of their own.
    made["dz_calibration.h"] = re.sub(r"#define DZ_(?:COMPARE|ADC_CODE)_MAX .*", "", made["dz_calibration.h"])
    return {name: made[name] for name in ("dz_current.c", "dz_current.h", "dz_calibration.h", "dz_valve.h")}
