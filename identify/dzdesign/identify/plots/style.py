"""One style for all plots, of `identify --plots` and of the report; and what plots in files share.

That is the title above, one legend below, and bytes that depend on nothing but what is drawn.
"""

import io
import os
import sys
import textwrap
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

#: Hues of Okabe and Ito, darker or lighter where a label's contrast (4.5 to 1) asks for it; `sky` fills areas only.
HUES = {
    "ink": "#1b2128",
    "soft": "#5a6570",
    "grid": "#d9dee4",
    "face": "#fefefe",
    "blue": "#0072b2",
    "vermilion": "#c44e00",
    "green": "#008060",
    "purple": "#a0467a",
    "orange": "#8f6200",
    "sky": "#3b8fc4",
}
#: For a series over the pressure drop: hues in turn.
CYCLE = ("blue", "vermilion", "green", "purple", "orange", "ink")
#: No text below 8 pt, on a page as wide as the figure.
STYLE: Mapping[str, object] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "figure.titlesize": 10,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": HUES["grid"],
    "grid.linewidth": 0.7,
    "axes.edgecolor": HUES["soft"],
    "axes.labelcolor": HUES["ink"],
    "text.color": HUES["ink"],
    "xtick.color": HUES["soft"],
    "ytick.color": HUES["soft"],
    "xtick.labelcolor": HUES["ink"],
    "ytick.labelcolor": HUES["ink"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.8,
    "text.parse_math": False,  # a file's name is no mathematics, whatever signs it has
    "svg.fonttype": "path",
    "svg.hashsalt": "dzdesign",  # ids in the file follow from its content: same input, same bytes
}


@contextmanager
def plot_style(**changes: object) -> Iterator[None]:
    """Draw alike on every machine, whatever its matplotlibrc says; `changes` with ``__`` for the dots of their names.

    A name may have letters that the font for measuring lacks.
    """
    _import_matplotlib()
    from matplotlib import style

    own = {name.replace("__", "."): value for name, value in changes.items()}
    with style.context(["default", {**STYLE, **own}]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def _import_matplotlib() -> None:
    """Import matplotlib without the matplotlibrc of the working folder: recordings lie there, and it may be anything.

    matplotlib looks there before all else, and no setting forbids that; one that is no text ends the import, and a pipe
    holds it for ever. Rejected: another working folder meanwhile, into which other threads would write.
    """
    if "matplotlib" in sys.modules:
        return
    exists = os.path.exists
    os.path.exists = lambda path: path != "matplotlibrc" and exists(path)
    try:
        import matplotlib  # noqa: F401
    finally:
        os.path.exists = exists


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
