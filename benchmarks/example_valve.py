"""The bundled example, identified: the valve that most benchmarks begin with."""

from dzdesign.example import example_folder
from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.valve.model import ValveModel


def example_valve() -> ValveModel:
    """Return the bundled example, identified."""
    ramps = example_folder() / "ramps"
    return identify([read_ramp_file(ramp) for ramp in sorted(ramps.glob("*.csv.gz"))])
