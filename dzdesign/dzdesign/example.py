"""The bundled example: ramp tests of the paper's valve, simulated, with its plant."""

from pathlib import Path


def example_folder() -> Path:
    """Return its folder: beside this module where dzdesign is installed, under ``examples/`` in a clone."""
    installed = Path(__file__).with_name("paper_valve")
    return installed if installed.is_dir() else Path(__file__).parents[2] / "examples" / "paper_valve"
