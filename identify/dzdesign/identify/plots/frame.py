"""What plots in files share: title above, one legend below, and bytes that depend on nothing but what is drawn."""

import io
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

#: Of a figure, inches; of a line of its title, characters.
WIDTH, TITLE_WIDTH = 9, 105
DPI = 150
#: Neither the day nor the version of a library: the same valve gives the same bytes.
METADATA = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}


def new_figure(height: float, *title: str) -> "Figure":
    """Return an empty figure, `height` inches high, under the lines of its title; one too long is wrapped, then cut.

    A file's name in it is no mathematics, whatever signs it has.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.06))
    FigureCanvasAgg(figure)
    # What can't be printed can't stand in XML either, and half a character ends the drawing.
    title = tuple(one_line(line) for line in title)
    lines = [part for line in title for part in textwrap.wrap(line, TITLE_WIDTH, max_lines=2, placeholder=" ...")]
    figure.suptitle("\n".join(lines), parse_math=False)
    return figure


def finish(figure: "Figure", rows: int) -> "Figure":
    """Put one legend of all panels under them, in so many rows, where it covers no data; lay everything out, once."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    columns = -(-len(entries) // rows)
    legend = figure.legend(
        list(entries.values()), list(entries), loc="outside lower center", ncols=columns, columnspacing=1.2
    )
    for marker, label in zip(legend.legend_handles, entries, strict=True):
        if marker and label.startswith("samples"):  # as small and light as in the panels nobody would tell them apart
            marker.set(markersize=5, alpha=1)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine(None)  # SVG and PNG are then laid out alike
    return figure


def saved(figure: "Figure", suffix: str) -> bytes:
    """Return the finished figure as the content of a file, "svg" or "png"."""
    out = io.BytesIO()
    figure.savefig(out, format=suffix, dpi=DPI, metadata=METADATA[suffix])
    return out.getvalue()


def pressure_names(stems: Sequence[str], dp_MPa: Sequence[float | None]) -> list[str]:
    """Return a file name for each pressure drop, with as few digits of it as tell all names apart."""
    names: list[str] = []
    for digits in range(3, 17):
        names = [
            stem if dp is None else f"{stem}_{dp:.{digits}g}_MPa" for stem, dp in zip(stems, dp_MPa, strict=True)
        ]
        if len(set(names)) == len(names):
            break
    return names
