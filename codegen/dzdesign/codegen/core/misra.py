"""What the core's banners say of MISRA C:2012: how it is checked, and each deviation with rule, place and reason.

Hardware files of the targets are outside: registers and the vendors' headers decide what they look like.
"""

from textwrap import wrap

from dzdesign.codegen.core.constants import COLUMNS

CHECK = "MISRA C:2012: nothing found by cppcheck 2.10 (--platform=avr8 --std=c99 --addon=misra) in this file"
_FOR_CALLERS = "they are for those who call it; not every firmware needs all of them."
#: Every deviation, by the name of its file: rule, symbols and reason.
DEVIATIONS = {
    "dz_calibration.h": "deviation from rule 2.5 (advisory) in DZ_CURRENT_SAMPLES, DZ_CALIBRATION_SUPPLY_NODES, "
    "DZ_CALIBRATION_SUPPLY_MASK, DZ_CALIBRATION_CURRENT: they are for current control; not every firmware has it.",
    "dz_drive.h": "deviation from rule 2.5 (advisory) in DZ_DRIVE_TICKS_PER_SAMPLE, DZ_STATUS_CALIBRATION: "
    + _FOR_CALLERS,
}
#: The same of a firmware with the numbers of its valve in it.
FIXED_DEVIATIONS = {
    "dz_valve.h": "deviation from rule 5.9 (advisory) in dz_valve: each source has the numbers as constants of its "
    "own, so that a compiler folds them into the code.",
    "dz_calibration.h": "deviation from rule 2.5 (advisory) in DZ_COMPARE_MAX, DZ_ADC_CODE_MAX, DZ_SAMPLE_HZ, "
    "DZ_TICK_HZ, DZ_CURRENT_SAMPLES: " + _FOR_CALLERS,
    "dz_drive.h": "deviation from rule 2.5 (advisory) in DZ_DRIVE_TICKS_PER_SAMPLE, DZ_DRIVE_COMMAND_ZERO: "
    + _FOR_CALLERS,
    "dz_current.h": "deviation from rule 2.5 (advisory) in DZ_CURRENT_OFFSET_TICKS: " + _FOR_CALLERS,
}


def misra_lines(file: str = "", *, fixed: bool = False) -> list[str]:
    """Return the comment lines on MISRA C:2012 of a file of the core; without a name those of one that is clean."""
    deviations = FIXED_DEVIATIONS if fixed else DEVIATIONS
    if file not in deviations:
        return wrap(f"{CHECK}.", COLUMNS - 3)
    deviation = wrap(deviations[file], COLUMNS - 5, initial_indent="  ", subsequent_indent="  ")
    return [*wrap(f"{CHECK} but for", COLUMNS - 3), *deviation]
