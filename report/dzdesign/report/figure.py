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

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.plots.style import HUES, plot_style

if TYPE_CHECKING:
    import numpy as np
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
#: Name of a variable of the page -> (light, dark).
PALETTE = {name: (light, DARK[name]) for name, light in LIGHT.items()}
#: As a page has them; without, each name in the markup would get a prefix of its own.
for prefix, address in (("", "http://www.w3.org/2000/svg"), ("xlink", "http://www.w3.org/1999/xlink")):
    ElementTree.register_namespace(prefix, address)
WIDTH = 7.4
#: Left margin, and the width of numbers on the axis for which it has room: of ``5.150``.
LEFT, TICKS_IN_MARGIN = 0.6, 0.345
#: Of the numbers on axes, points.
TICK_SIZE = LEGEND_SIZE = 8.5
#: How often the words of a legend that is too wide are made smaller, by 7 % each.
SMALLER = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFigure:
    """A figure as the page shows it: markup in which every text is escaped, and the numbers that were drawn.

    The caption says what it shows and how to read it, the description what is found there, for who can't see it. The
    name is that of its anchor and of the CSV file. `narrow_svg` is the same for a narrow page, where there is one.
    """

    name: str
    caption: str
    description: str
    svg: str
    csv: str
    narrow_svg: str = ""


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


def new_figure(
    height: float, *, legend_rows: int = 0, right: float = 0.2, top: float = 0.12, width: float = WIDTH
) -> "Figure":
    """Return an empty figure; sizes in inches.

    Its margins are stated, because laying it out by itself takes as long as drawing it: room for the rows of a legend
    below the axes, at the right for labels at the lines' ends, at the top for titles.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), facecolor="none")
    FigureCanvasSVG(figure)
    bottom = 0.5 + (0.1 + 0.2 * legend_rows if legend_rows else 0.0)
    figure.subplots_adjust(
        left=LEFT / width, right=1 - right / width, bottom=bottom / height, top=1 - top / height
    )
    return figure


def titled_axes(
    height: float, name: str, both: bool, *, legend_rows: int = 0, right: float = 0.2
) -> "tuple[Figure, Axes]":
    """Return an empty figure of one panel; of a valve with two sides its title says which it is of."""
    figure = new_figure(height, legend_rows=legend_rows, right=right, top=0.3 if both else 0.12)
    axes = figure.subplots()
    if both:
        axes.set_title(f"{name} commands")
    return figure, axes


def side_words(name: str, both: bool) -> str:
    """Return which side a caption is of, where a valve has two."""
    return f", {name} commands" if both else ""


def span(values: "Sequence[float] | np.ndarray", form: str, units: RecordedUnits) -> str:
    """Return from where to where values run, with their unit."""
    return f"{units.number(min(values), form)} to {units.text(max(values), form)}"


def legend_below(figure: "Figure", columns: int) -> None:
    """Put a legend of all axes below them, each label once, in a figure made with `legend_rows`."""
    found: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    figure.legend(
        found.values(), found.keys(), loc="lower center", ncols=columns, columnspacing=1.2, borderpad=0.1,
        borderaxespad=0.1,
    )  # fmt: skip


def label_ends(axes: "Axes", labels: Sequence[tuple[float, float, str, str]]) -> None:
    """Write names at lines' ends (x, y, text, hue; in the axes' units), moved apart where one would cover another."""
    labels = sorted(labels, key=lambda label: label[1])
    room = 0.055 * max((label[1] for label in labels), default=1.0)
    places = apart([label[1] for label in labels], room)
    for (x, _, text, hue), place in zip(labels, places, strict=True):
        axes.annotate(text, (x, place), xytext=(5, 0), textcoords="offset points", va="center", fontsize=8,
                      color=hue, annotation_clip=False)  # fmt: skip


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


def to_report_figure(
    figure: "Figure", name: str, caption: str, description: str, csv: str, narrow: "Figure | None" = None
) -> ReportFigure:
    """Return a figure as the page shows it; see `ReportFigure`."""
    for each in (figure, narrow):
        if each is not None:
            _make_room_for_ticks(each)
            _make_room_for_legend(each)
    return ReportFigure(
        name=name,
        caption=caption,
        description=description,
        svg=_svg_of(figure, name, description),
        csv=csv,
        narrow_svg=_svg_of(narrow, f"{name}-narrow", description, "drawing narrow") if narrow else "",
    )


def _make_room_for_ticks(figure: "Figure") -> None:
    """Widen the margin of a single panel whose numbers are wider than the usual ones: counts, or many digits."""
    if len(figure.axes) != 1:
        return
    low, high = sorted(figure.axes[0].get_ylim())
    ticks = [tick for tick in figure.axes[0].get_yticks() if low <= tick <= high]
    labels = figure.axes[0].yaxis.get_major_formatter().format_ticks(ticks)
    em = max((sum(0.32 if sign in ".," else 0.64 for sign in label) for label in labels), default=0.0)
    surplus = TICK_SIZE * em / 72 - TICKS_IN_MARGIN
    if surplus > 0:
        figure.subplots_adjust(left=(LEFT + surplus + 0.04) / figure.get_figwidth())


def _make_room_for_legend(figure: "Figure") -> None:
    """Make the words of a legend below the axes smaller where it is wider than the figure."""
    for legend in figure.legends:
        for step in range(1, SMALLER + 1):
            if legend.get_window_extent().width <= figure.bbox.width:
                break
            for text in legend.get_texts():
                text.set_fontsize(LEGEND_SIZE * 0.93**step)


def _svg_of(figure: "Figure", name: str, description: str, kind: str = "drawing") -> str:
    """Return a figure, drawn in the colours of `LIGHT`, as markup whose ids follow from its name."""
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({"svg.hashsalt": name}):  # same input, same ids
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    drawing = ElementTree.fromstring(out.getvalue())
    box = drawing.get("viewBox", "")
    size = dict(zip(("width", "height"), box.split()[2:], strict=True))
    drawing.attrib = {"class": kind, "role": "img", "aria-label": description, "viewBox": box, **size}
    for part in [each for each in drawing if each.tag.endswith("metadata")]:
        drawing.remove(part)
    for part in drawing.iter():
        if part.tag.endswith("}g"):
            part.attrib.pop("id", None)  # Matplotlib numbers its groups alike in every figure
        if "style" in part.attrib:
            part.attrib["style"] = _in_page_colours(part.attrib["style"])
    return ElementTree.tostring(drawing, encoding="unicode")


def _in_page_colours(style: str) -> str:
    for variable, (light, _) in PALETTE.items():
        style = style.replace(light, f"var(--fig-{variable})")
    return style
