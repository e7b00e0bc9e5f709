"""Quantities of valve.json: unit, and bounds far beyond any valve that keep exact arithmetic from overflowing.

A field adds what it means: ``Annotated[Voltage, Meta(description="Full command.")]``.
"""

from typing import Annotated

from dzdesign.core.artefact_types import quantity

Voltage = Annotated[float, quantity("V", ge=-1e4, le=1e4)]
VoltageError = Annotated[float, quantity("V", ge=0, le=1e4)]
PressureDrop = Annotated[float, quantity("MPa", ge=1e-6, le=1e3)]
Flow = Annotated[float, quantity("L/min", ge=0, le=1e6)]
#: A reading: noise may take it below zero.
SignedFlow = Annotated[float, quantity("L/min", ge=-1e6, le=1e6)]
FlowGain = Annotated[float, quantity("L/min/V", ge=0, le=1e6)]
#: Largest beta(dP): a table of it has room for that, and dP0 can be chosen so that none is larger.
LARGEST_BETA = 2
Ratio = Annotated[float, quantity("1", ge=0, le=LARGEST_BETA)]
#: Of thresholds as the data have them, which no table has to hold.
IdentifiedRatio = Annotated[float, quantity("1", ge=-1e6, le=1e6)]
RatioError = Annotated[float, quantity("1", ge=0, le=1e6)]
Probability = Annotated[float, quantity("1", ge=0, le=1)]
SecondDifference = Annotated[float, quantity("V/MPa2", ge=0, le=1e9)]
