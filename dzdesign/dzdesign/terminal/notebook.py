"""What a notebook shows of each result: a small table without script, style sheet or network; all text escaped."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from dzdesign.core.units import chance
from dzdesign.core.verdicts import verdict_words

if TYPE_CHECKING:
    from dzdesign.codegen.project import Firmware
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel
    from dzdesign.identify.valve.side_model import SideModel
    from dzdesign.verify.verification import Verification


def _table(caption: str, headings: Sequence[str], rows: Iterable[Sequence[str]], words: Sequence[int] = (0,)) -> str:
    """Return a table; columns of `words` stand at the left, those of numbers at the right."""
    styles = [f"padding:2px 8px;text-align:{'left' if at in words else 'right'}" for at in range(len(headings))]

    def line(tag: str, cells: Sequence[str]) -> str:
        pairs = zip(styles, cells, strict=True)
        return "<tr>" + "".join(f'<{tag} style="{style}">{escape(cell)}</{tag}>' for style, cell in pairs) + "</tr>"

    body = "".join(line("td", row) for row in rows)
    return (
        f'<table><caption style="text-align:left"><b>{escape(caption)}</b></caption>'
        f"<thead>{line('th', headings)}</thead><tbody>{body}</tbody></table>"
    )


def _sentences(lines: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def _knee(u_V: float | None, se_V: float | None) -> str:
    return "-" if u_V is None else f"{u_V:.3f} ± {se_V:.4f}"


def valve_html(valve: "ValveModel") -> str:
    """Return the thresholds with their standard errors, the trend and every warning of a valve."""
    parts = [_table("Record", ("entry", "text"), valve.record.items(), words=(0, 1))] if valve.record else []
    for name, side in valve.sides.items():
        rows = []
        for test, beta in zip(side.tests, side.beta.beta or (None,), strict=True):
            rows.append(
                [
                    test.source,
                    "?" if test.dp_MPa is None else f"{test.dp_MPa:.3f}",
                    _knee(test.u_knee_rising_V, test.u_knee_rising_se_V),
                    _knee(test.u_knee_falling_V, test.u_knee_falling_se_V),
                    f"{test.u_guard_lower_V:.3f}",
                    "-" if beta is None else f"{beta:.4f}",
                    f"{test.q_max_L_min:.2f}",
                ]
            )
        headings = ("ramp test", "dP (MPa)", "knee opening (V)", "closing (V)", "bound (V)", "beta", "Q max (L/min)")
        parts += [_table(f"Valve, {name} side: thresholds ± s.e.", headings, rows), _sentences(side_lines(side))]
    for each in valve.warnings:
        source = f"{each.source}: " if each.source else ""
        parts.append(_sentences([f"warning [{each.code}] {source}{each.text}"]))
    return "".join(parts)


def side_lines(side: "SideModel") -> list[str]:
    """Say what the law takes from a side."""
    at = "" if side.reference.dp_MPa is None else f" at dP0 = {side.reference.dp_MPa:.3f} MPa"
    lines = [
        f"u_min0 = {side.reference.u_min_V:.4f} V{at}, under the {100 * side.certificate.confidence:.6g}% lower bound "
        f"of the {side.certificate.guard} threshold, for all tests together",
        f"drive range of the valve k x_max/u_max = {side.k_x_max_over_u_max:.4f}: command from the knee to full "
        "stroke, as a share of full command; the law's counts from its offset, which lies lower",
    ]
    if side.trend_change_V is None or side.trend_change_se_V is None:
        return [*lines, "trend with dP: can't be said from one ramp test"]
    change, error = 1e3 * side.trend_change_V, 1e3 * side.trend_change_se_V
    return [*lines, f"trend with dP: {side.trend} ({change:+.1f} ± {error:.1f} mV, {chance(side.trend_p or 0.0)})"]


def compensator_html(compensator: "Compensator") -> str:
    """Return the law, the certificate of each side and the costs of a design."""
    from dzdesign.derivation.law import law

    chosen = law(compensator.law)
    rows = []
    for sign in compensator.signals.signs:
        side = compensator.side(sign)
        certificate = side.certificate
        low, high = (float(end) for end in certificate.dp_MPa)
        rows.append(
            [
                "positive" if sign > 0 else "negative",
                f"{float(side.drive_range_over_u_max):.5f}",
                f"{float(side.u_min0_over_u_max):.5f}",
                f"{100 * certificate.confidence:.6g}% bound of the {certificate.guard} threshold",
                f"{low:.3f} to {high:.3f}",
                f"{1e3 * float(certificate.smallest_margin_V):.3f}",
            ]
        )
    headings = ("commands", "k x_max/u_max of the law", "u_min0/u_max", "offset stays under", "dP (MPa)", "margin (mV)")
    caption = f"Compensator, law {chosen.name} {chosen.equation}: u_O = {chosen.output}"
    return _table(caption, headings, rows, words=(0, 3)) + _sentences(compensator.costs)


def firmware_html(firmware: "Firmware") -> str:
    """Return the files of a firmware and their sizes in bytes."""
    rows = [[name, f"{len(text.encode())}"] for name, text in firmware.files.items()]
    caption = f"Firmware for {firmware.manifest.target}, law {firmware.manifest.law}"
    return _table(caption, ("file", "bytes"), rows)


def verification_html(verification: "Verification") -> str:
    """Return the verdict, every check and the closed loop of a verification."""
    checks = _table(
        verification.verdict,
        ("requirement", "verdict", "figures"),
        ((check.name, verdict_words(check.holds), check.text) for check in verification.evidence.checks),
        words=(0, 1, 2),
    )
    rows = [
        [
            f"{loop.result.side}, {loop.result.dp_MPa:.2f}",
            f"{100 * loop.result.dead_zone_opening:.1f}",
            f"{100 * loop.result.residual_opening:.1f}",
            f"{100 * loop.result.residual_closing:.1f}",
            f"{loop.result.q_zero_L_min:.2f}",
        ]
        for loop in verification.loops
    ]
    headings = ("side, dP (MPa)", "dead zone without (%)", "with: opening (%)", "closing (%)", "Q at zero (L/min)")
    caption = f"Closed loop (plant: {verification.evidence.closed_loop.plant_source})"
    return checks + (_table(caption, headings, rows) if rows else "")


#: Class of a result -> its HTML, for `dzdesign.core.result_display`.
WRITERS: Mapping[str, Callable[[Any], str]] = {
    "ValveModel": valve_html,
    "Compensator": compensator_html,
    "Firmware": firmware_html,
    "Verification": verification_html,
}
