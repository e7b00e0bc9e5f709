"""What `print` says of each result: some lines of plain text, the first of which alone names it."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from dzdesign.core.errors import one_line
from dzdesign.core.verdicts import NOT_CHECKED, verdict_words
from dzdesign.terminal.notebook import side_lines

if TYPE_CHECKING:
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.verify.verification import Verification


def _knee(u_V: float | None, se_V: float | None) -> str:
    return "not recorded" if u_V is None else f"{u_V:.3f} ± {se_V:.3f}"


def valve_summary(valve: "ValveModel") -> str:
    """Return full command, each test's knees and bound, what the law takes, the trend, and the warnings' codes."""
    count = len(valve.made_from)
    lines = [
        f"Valve of {valve.u_max_V:g} V, {' and '.join(valve.sides)} side{'s' * (len(valve.sides) > 1)}, from {count} "
        f"recording{'s' * (count != 1)}"
    ]
    for name, side in valve.sides.items():
        lines.append(f"  {name} side, thresholds in V:")
        for test in side.tests:
            at = "dP unknown" if test.dp_MPa is None else f"{test.dp_MPa:.3f} MPa"
            opens = _knee(test.u_knee_rising_V, test.u_knee_rising_se_V)
            closes = _knee(test.u_knee_falling_V, test.u_knee_falling_se_V)
            lines.append(
                f"    {at}: knee opening {opens}, closing {closes}; lower bound of the {side.certificate.guard} "
                f"threshold {test.u_guard_lower_V:.3f}; largest flow {test.q_max_L_min:.2f} L/min"
            )
        lines += [f"    {line}" for line in side_lines(side)]
    codes = list(dict.fromkeys(warning.code for warning in valve.warnings))
    lines.append(f"  warnings: {', '.join(codes) or 'none'}" + ("; their texts are in .warnings" if codes else ""))
    return "\n".join(map(one_line, lines))


def compensator_summary(compensator: "Compensator") -> str:
    """Return target and law, the offset and certificate of each side, and the costs."""
    target = f" for {compensator.target.name}" if compensator.target else ""
    lines = [f"Compensator{target}, law {compensator.law}, of a valve of {float(compensator.u_max_V):g} V"]
    for sign in compensator.signals.signs:
        side = compensator.side(sign)
        low, high = (float(end) for end in side.certificate.dp_MPa)
        lines.append(
            f"  {'positive' if sign > 0 else 'negative'} commands: u_min0/u_max = {float(side.u_min0_over_u_max):.5f}, "
            f"k x_max/u_max = {float(side.drive_range_over_u_max):.5f}; certified from {low:.3f} to {high:.3f} MPa "
            f"with {100 * side.certificate.confidence:.6g} % confidence, guarding {side.certificate.guard}"
        )
    return "\n".join(map(one_line, [*lines, *(f"  cost: {line}" for line in compensator.costs)]))


def firmware_summary(firmware: "Firmware") -> str:
    """Return target and law, and the files."""
    head = f"Firmware for {firmware.manifest.target}, law {firmware.manifest.law}, {len(firmware.files)} files"
    note = [f"  {firmware.note}"] if firmware.note else []
    return "\n".join(map(one_line, [head, *(f"  {name}" for name in firmware.files), *note]))


def verification_summary(verification: "Verification") -> str:
    """Return the verdict, every requirement with its figures, and what was not tried."""
    from dzdesign.verify.requirements import not_tried

    checks = [f"  {verdict_words(check.holds)}: {check.name}: {check.text}" for check in verification.evidence.checks]
    untried = [f"  {NOT_CHECKED}: {name}".replace("`", "") for name in not_tried(verification.evidence)]
    return "\n".join(map(one_line, [f"Verification: {verification.verdict}", *checks, *untried]))


#: Class of a result -> its summary, for `dzdesign.core.result_display`.
SUMMARIES: Mapping[str, Callable[[Any], str]] = {
    "ValveModel": valve_summary,
    "Compensator": compensator_summary,
    "Firmware": firmware_summary,
    "Verification": verification_summary,
}
