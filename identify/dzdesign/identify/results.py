"""What an identification gives beside the model: for plots and warnings, what each side was found from."""

from dataclasses import dataclass

from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.knee_table import Knees
from dzdesign.identify.valve.model import ValveModel, Warning_
from dzdesign.identify.valve.side_model import SideModel


@dataclass(frozen=True, slots=True, kw_only=True)
class SideIdentification:
    """What was found about one side, and what it was found from."""

    model: SideModel
    described: DescribedTests
    knees: Knees
    warnings: tuple[Warning_, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """The model of a valve, and per side what it was found from."""

    model: ValveModel
    sides: dict[str, SideIdentification]
