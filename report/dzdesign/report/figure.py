"""A figure of the report: SVG that takes its colours from the page, and its numbers as CSV.

Matplotlib draws in the light theme's colours; each is then replaced by a variable of the page, so that a dark page has
a dark figure and a printed one a light figure, from one drawing. Lines differ in dash, marker or a label at their end,
never in colour alone.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import quote
from xml.etree import ElementTree

from dzdesign.identify.plots.style import HUES, plot_style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Hues of the light theme, and the same of the dark one.
LIGHT = HUES
DARK = {
    "ink": "#e3e7ec",
    "soft": "#a5b0bb",
    "grid": "#333c46",
    "face": "#161b21",
    "blue": "#56b4e9",
    "vermilion": "#f0883e",
    "green": "#2fc496",
    "purple": "#dd8fc0",
    "orange": "#e6b422",
    "sky": "#9ad0f5",
}
#: Ends of the one hue that stands for the pressure drop, lowest and highest, of the light theme and of the dark one.
#: The highest contrasts most with the paper.
PRESSURE_ENDS = {"light": ((104, 178, 226), (6, 26, 62)), "dark": ((58, 108, 152), (236, 246, 255))}
SHADES = 8


def _shades(theme: str) -> list[str]:
    """Return shades from that of the lowest pressure drop to that of the highest."""
    ends = list(zip(*PRESSURE_ENDS[theme], strict=True))
    steps = [at / (SHADES - 1) for at in range(SHADES)]
    return ["#" + "".join(f"{round(low + step * (high - low)):02x}" for low, high in ends) for step in steps]


LIGHT_SHADES = _shades("light")
#: Name of a variable of the page -> (light, dark).
PALETTE = {name: (light, DARK[name]) for name, light in LIGHT.items()} | {
    f"dp{at}": pair for at, pair in enumerate(zip(LIGHT_SHADES, _shades("dark"), strict=True))
}
#: As a page has them; without, each name in the markup would get a prefix of its own.
for prefix, address in (("", "http://www.w3.org/2000/svg"), ("xlink", "http://www.w3.org/1999/xlink")):
    ElementTree.register_namespace(prefix, address)
#: Inches, and points of the numbers on axes and of the words of a legend.
WIDTH, TICK_SIZE, LEGEND_SIZE = 7.4, 8.5, 8.5
#: Room that a label at a line's end takes, of the height of the axes.
LABEL_HEIGHT = 0.063


@dataclass(frozen=True, slots=True)
class PressureHues:
    """The shade of each pressure drop of a report, MPa, in rising order: the same one in every figure."""

    known: tuple[float, ...]

    def of(self, dp_MPa: float | None) -> str:
        """Return the shade of the known pressure drop that is nearest; the darkest of one that was not recorded."""
        if dp_MPa is None or len(self.known) < 2:
            return LIGHT_SHADES[-1]
        at = min(range(len(self.known)), key=lambda place: abs(self.known[place] - dp_MPa))
        return LIGHT_SHADES[round(at * (SHADES - 1) / (len(self.known) - 1))]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFigure:
    """A figure as the page shows it: markup in which every text is escaped, and the numbers that were drawn.

    The caption says what it shows and how to read it, the description what is found there, for who can't see it. The
    name is that of its anchor and of the CSV file.
    """

    name: str
    caption: str
    description: str
    svg: str
    csv: str


def data_uri(text: str) -> str:
    """Return CSV text as a data: address.

    Examples
    --------
    >>> data_uri("a,b")
    'data:text/csv;charset=utf-8,a,b'
    """
    return "data:text/csv;charset=utf-8," + quote(text, safe=",.:;-_()=+/")


def csv_text(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return rows as CSV; None is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw in the style of all plots, for a page: no background, and text that stays text."""
    with plot_style(
        axes__facecolor="none",
        axes__titlesize=9.5,
        xtick__labelsize=TICK_SIZE,
        ytick__labelsize=TICK_SIZE,
        legend__fontsize=LEGEND_SIZE,
        svg__fonttype="none",  # to be searched, read out, and set in the page's own font
    ):
        yield


def new_figure(height: float) -> "Figure":
    """Return an empty figure of this height, inches, which lays itself out around its words."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), facecolor="none", layout="constrained")
    FigureCanvasSVG(figure)
    return figure


def titled_axes(height: float, name: str, both: bool) -> "tuple[Figure, Axes]":
    """Return an empty figure of one panel; of a valve with two sides its title says which it is of."""
    figure = new_figure(height)
    axes = figure.subplots()
    if both:
        axes.set_title(f"{name} commands")
    return figure, axes


def side_words(name: str, both: bool) -> str:
    """Return which side a caption is of, where a valve has two."""
    return f", {name} commands" if both else ""


def legend_below(figure: "Figure", columns: int) -> None:
    """Put a legend of all axes below them, each label once, in as many of these columns as there is room for."""
    found: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    for count in range(columns, 0, -1):
        legend = figure.legend(
            found.values(), found.keys(), loc="outside lower center", ncols=count, columnspacing=1.2, borderpad=0.1
        )
        if count == 1 or legend.get_window_extent().width <= 0.97 * figure.bbox.width:
            break
        legend.remove()


def label_ends(axes: "Axes", labels: Sequence[tuple[float, float, str]]) -> None:
    """Write names beside lines' ends (x, y, text; in the axes' units), moved apart where one would cover another.

    Of an end at negative x the name stands at its left.
    """
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    for sign, align in ((1, "left"), (-1, "right")):
        ends = sorted((label for label in labels if (label[0] < 0) is (sign < 0)), key=lambda label: label[1])
        places = apart([end[1] for end in ends], LABEL_HEIGHT * (high - low))
        for (x, _, text), place in zip(ends, places, strict=True):
            axes.annotate(text, (x, place), xytext=(5 * sign, 0), textcoords="offset points", va="center", ha=align,
                          fontsize=8, annotation_clip=False)  # fmt: skip


def apart(places: Sequence[float], room: float) -> list[float]:
    """Return rising places moved as little as it takes for each to have its room.

    Examples
    --------
    >>> apart([0.0, 1.0, 5.0], 2.0)
    [-0.5, 1.5, 5.0]
    """
    groups: list[list[float]] = []  # of places that touch, each less the room of those below it
    for index, place in enumerate(places):
        groups.append([place - room * index])
        while len(groups) > 1 and sum(groups[-2]) / len(groups[-2]) > sum(groups[-1]) / len(groups[-1]):
            groups[-2:] = [groups[-2] + groups[-1]]
    kept = [sum(group) / len(group) for group in groups for _ in group]
    return [base + room * index for index, base in enumerate(kept)]


def to_report_figure(figure: "Figure", name: str, caption: str, description: str, csv: str) -> ReportFigure:
    """Return a figure as the page shows it; see `ReportFigure`."""
    return ReportFigure(
        name=name, caption=caption, description=description, svg=_svg_of(figure, name, description), csv=csv
    )


def _svg_of(figure: "Figure", name: str, description: str) -> str:
    """Return a figure, drawn in the colours of `LIGHT`, as markup whose ids follow from its name."""
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({"svg.hashsalt": name}):  # same input, same ids
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    drawing = ElementTree.fromstring(out.getvalue())
    box = drawing.get("viewBox", "")
    size = dict(zip(("width", "height"), box.split()[2:], strict=True))
    drawing.attrib = {"class": "drawing", "role": "img", "aria-label": description, "viewBox": box, **size}
    for part in [each for each in drawing if each.tag.endswith("metadata")]:
        drawing.remove(part)
    for group in drawing.iter("{http://www.w3.org/2000/svg}g"):
        group.attrib.pop("id", None)  # Matplotlib numbers its groups alike in every figure
    text = ElementTree.tostring(drawing, encoding="unicode")
    for variable, (light, _) in PALETTE.items():
        text = text.replace(light, f"var(--fig-{variable})")
    return text
