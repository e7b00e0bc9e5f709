"""The plots of the evidence."""

import io

from dzdesign.verify.closed_loop.loop import LoopComparison

#: Every so many records are drawn: a tenth of a second, finer than the line is wide.
PLOTTED_RECORD = 10


def plot_loops(loops: tuple[LoopComparison, ...]) -> bytes:
    """Draw flow over command, without and with the compensator, both branches, one colour a pressure drop."""
    from matplotlib import colormaps, rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.hashsalt": "dzdesign", "svg.fonttype": "path"}):
        figure = Figure(figsize=(8, 5), layout="constrained")
        axes = figure.subplots()
        for index, loop in enumerate(loops):
            colour = colormaps["viridis"](index / max(len(loops) - 1, 1) * 0.9)
            for run, line, label in (
                (loop.direct, ":", None),
                (loop.compensated, "-", f"{loop.result.dp_MPa:.2f} MPa"),
            ):
                thin = slice(None, None, PLOTTED_RECORD)
                axes.plot(100 * run.command[thin], run.q_L_min[thin], line, color=colour, label=label)
        axes.set(
            xlabel="command (% of full)",
            ylabel="flow (L/min)",
            title="Closed loop: without (dotted) and with (solid) the compensator",
            xlim=(0, 100),
            ylim=(0, None),
        )
        axes.grid(alpha=0.3)
        axes.legend(title="pressure drop")
        out = io.BytesIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
