"""What the core's banners say of MISRA C:2012: how it is checked, and each deviation with rule, place and reason.

Hardware files of the targets are outside: registers and the vendors' headers decide what they look like.
"""

from textwrap import wrap

from dzdesign.codegen.core.constants import COLUMNS

CHECK = "MISRA C:2012: nothing found by cppcheck 2.10 (--platform=avr8 --std=c99 --addon=misra) in this file"
#: Every deviation, by the name of its file: rule, symbols and reason.
DEVIATIONS = {
    "dz_comp.h": "deviation from rule 2.5 (advisory) in DZ_COMPARE_MAX, DZ_COMPARE_LIMIT, DZ_ADC_CODE_MAX: the "
    "interface's limits are for those who call the core; not every firmware needs all of them.",
    "dz_drive.h": "deviation from rule 2.5 (advisory) in DZ_DRIVE_TICKS_PER_SAMPLE, DZ_DRIVE_COMMAND_ZERO, "
    "DZ_STATUS_LATCHED: they are for those who call the drive; not every firmware needs all of them.",
    "dz_calibration.h": "deviation from rule 2.5 (advisory) in DZ_CURRENT_SAMPLES, DZ_CALIBRATION_SUPPLY_NODES, "
    "DZ_CALIBRATION_SUPPLY_MASK, DZ_CALIBRATION_CURRENT: they are for current control; not every firmware has it.",
    "dz_drive.h, block form": "deviation from rule 2.5 (advisory) in DZ_DRIVE_TICKS_PER_SAMPLE, "
    "DZ_STATUS_CALIBRATION: they are for those who call the drive; not every firmware needs all of them.",
    "dz_current.h": "deviation from rule 2.5 (advisory) in DZ_CURRENT_SAMPLES: it is for those who take the codes.",
}


def misra_lines(file: str = "") -> list[str]:
    """Return the comment lines on MISRA C:2012 of a file of the core; without a name those of one that is clean."""
    if file not in DEVIATIONS:
        return wrap(f"{CHECK}.", COLUMNS - 3)
    deviation = wrap(DEVIATIONS[file], COLUMNS - 5, initial_indent="  ", subsequent_indent="  ")
    return [*wrap(f"{CHECK} but for", COLUMNS - 3), *deviation]
