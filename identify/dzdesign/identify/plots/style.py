"""One style for all plots: of `identify --plots` and of the report."""

import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

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
