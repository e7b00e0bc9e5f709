"""What all figures of the pages share: colours, style, a panel, and files whose bytes follow from what is drawn."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.identify.plots.style import METADATA, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Of Okabe and Ito, told apart by the colour-blind; every pair differs in lightness or in its line too.
BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK, GREY = (
    *("#0072B2", "#E69F00", "#009E73", "#A0467A", "#56B4E9", "#000000", "#6E6E6E"),
)
#: Inches: with 9 pt text it is read on a page 700 pixels wide, and still on a telephone.
WIDTH = 6.6
#: A white ground, also on a dark page.
GROUND = {
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "axes.spines.top": False,
    "axes.spines.right": False,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw alike on every machine, as the product's own plots are drawn."""
    from matplotlib import style as styles

    with styles.context(["default", {**STYLE, "axes.titlesize": 9.5, **GROUND}]):
        yield


def panels(height: float, columns: int = 1, **keywords: object) -> tuple["Figure", list["Axes"]]:
    """Return a figure and its panels side by side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False, **keywords)[0]
    return figure, list(axes)


def note(axes: "Axes", text: str, at: tuple[float, float], to: tuple[float, float] | None = None, **keywords) -> None:
    """Write a note at a place, with an arrow to another."""
    arrow = {"arrowprops": {"arrowstyle": "->", "color": GREY, "lw": 0.9}} if to else {}
    axes.annotate(text, to or at, at, fontsize=8, **{"ha": "center", "va": "center", **arrow, **keywords})


def span(axes: "Axes", start: float, end: float, height: float, text: str, colour: str = BLACK) -> None:
    """Draw a dimension line from `start` to `end` at a height, its text above."""
    ends = {"arrowstyle": "<->", "color": colour, "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (start, height), (end, height), arrowprops=ends)
    axes.annotate(
        text, ((start + end) / 2, height), (0, 3), textcoords="offset points", ha="center", fontsize=8, color=colour
    )


def save(figure: "Figure", path: Path) -> None:
    """Write a figure as SVG: the same drawing, the same bytes."""
    figure.savefig(path, format="svg", metadata=METADATA["svg"])
