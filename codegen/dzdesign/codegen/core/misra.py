"""What the core's banners say of MISRA C:2012: how it is checked, and each deviation with rule, place and reason.

Hardware files of the targets are outside: registers and the vendors' headers decide what they look like.
"""

from textwrap import wrap

from dzdesign.codegen.core.constants import COLUMNS

CHECK = "MISRA C:2012: nothing found by cppcheck 2.10 (--platform=avr8 --std=c99 --addon=misra) in this file"
#: Rule, symbols and reason of every deviation, by the name of the file.
DEVIATIONS = {
    "dz_comp.h": (
        (
            "2.5",
            "DZ_COMPARE_MAX, DZ_COMPARE_LIMIT, DZ_ADC_CODE_MAX",
            "the interface's limits are for those who call the core; not every firmware needs all of them.",
        ),
    ),
    "dz_drive.h": (
        (
            "2.5",
            "DZ_DRIVE_TICKS_PER_SAMPLE",
            "it is for those who call the drive; who is told of a new sample does without.",
        ),
    ),
}


def misra_lines(file: str = "") -> list[str]:
    """Return the comment lines on MISRA C:2012 of a file of the core; without a name those of one that is clean."""
    deviations = DEVIATIONS.get(file, ())
    if not deviations:
        return wrap(f"{CHECK}.", COLUMNS - 3)
    found = wrap(f"{CHECK} but for", COLUMNS - 3)
    for rule, symbols, reason in deviations:
        found += wrap(f"deviation from rule {rule} (advisory) in {symbols}: {reason}", COLUMNS - 5,
                      initial_indent="  ", subsequent_indent="  ")  # fmt: skip
    return found
