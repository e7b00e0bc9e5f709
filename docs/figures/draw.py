"""Draws every figure: `python docs/figures/draw.py FOLDER`; the documentation's build calls `draw_all`."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

from figures import law_figures, valve_figures
from figures.example import read_example
from figures.frame import save, style

#: File -> function of the example.
FIGURES = {
    "dead_zone": valve_figures.dead_zone,
    "thresholds": valve_figures.thresholds,
    "beta": valve_figures.beta,
    "staircase": valve_figures.staircase,
    "over_compensation": law_figures.over_compensation,
    "residual": law_figures.residual,
    "transition": law_figures.transition,
    "pwm": law_figures.pwm,
    "every_input": law_figures.every_input,
}


def draw_all(folder: Path, say: Callable[[str], None] = lambda _: None) -> list[Path]:
    """Draw every figure as SVG in a folder.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    say : callable
        Told what comes next.

    Returns
    -------
    list of Path
        The files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    say("identifying the bundled example")
    example = read_example()
    paths = []
    with style():
        for number, (name, draw) in enumerate(FIGURES.items(), start=1):
            say(f"figure {number} of {len(FIGURES)}: {name.replace('_', ' ')}")
            paths.append(folder / f"{name}.svg")
            save(draw(example), paths[-1])
    return paths


if __name__ == "__main__":
    for path in draw_all(Path(sys.argv[1])):
        print(path)
