"""`BoundErrors`: what the lower bounds at the tests are made of, so that anyone can compute them again.

With a confidence C of the T bounds together, each is the least of three, less the test's budget. The noise alone:
threshold - t(14, 1 - (1 - C)/T) se. And of the next closing (or opening), of a valve in the state s = -1/2 of the first
ramp or s = 1/2 of the last: threshold + s drift - uneven - t(degrees, 1 - (1 - C)/T) sqrt(variance), with

    variance = sd^2 (1 + c[i,i] + 2 s c[i,d] + s^2 c[d,d]) + max(se^2 - noise^2 c[i,i], 0).

C is the certificate's confidence under `monotone`, 1 - 0.75 (1 - confidence) under `smooth`. Under `line` the tests
count by their weights in the line, and C is 1 - 0.5 (1 - confidence); see `fitting.premises`. Where sd was not measured
the degrees are those of Welch and Satterthwaite: 14 by the squared share of se^2 in the variance of the mean.
"""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.quantity_types import Voltage, VoltageError

#: Of a covariance over a variance: any number that arithmetic can hold.
Lever = Annotated[float, quantity("1", ge=-1e6, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundErrors:
    """Errors of the thresholds at the tests of one guard, and what else is taken off its bounds."""

    noise_se_V: Annotated[
        tuple[VoltageError, ...], quantity("V", "Standard error of each threshold by the noise of the readings.")
    ]
    ramp_sd_V: Annotated[VoltageError, Meta(description="Standard deviation of the threshold from ramp to ramp.")]
    ramp_noise_V: Annotated[
        VoltageError,
        Meta(description="Part of ramp_sd_V that is the noise of a single ramp; 0 if it was not measured."),
    ]
    degrees_of_freedom: Annotated[
        float, quantity("1", "Degrees of freedom of ramp_sd_V; null if it was not measured.", gt=0, le=1e9)
    ] | None
    of_largest: Annotated[
        bool,
        Meta(
            description="Whether ramp_sd_V is that of the pressure drop with the largest scatter. If so, the level C "
            "replaces 1 - (1 - C)/T."
        ),
    ]
    covariance: Annotated[
        tuple[tuple[Lever, ...], ...],
        Meta(
            description="Covariance of the tests' thresholds over ramp_sd_V^2, one row per test. An additional last "
            "row and column are those of the drift."
        ),
    ]
    drift_V: Annotated[
        Voltage | None,
        Meta(description="Drift from the first ramp of the series to the last; null if the model has none."),
    ]
    uneven_V: Annotated[VoltageError, Meta(description="Largest undetected departure from a linear drift.")]
    budget_V: Annotated[
        tuple[Voltage, ...],
        quantity(
            "V",
            "Systematic errors taken off each bound: lag and zero error of the meter, leak, soft edge, "
            "stick-slip, and departure from the trend. Negative if a declared zero flow raises the bound.",
        ),
    ]

    def __post_init__(self) -> None:
        tests = len(self.noise_se_V)
        size = tests + (self.drift_V is not None)
        if len(self.budget_V) != tests or [len(row) for row in self.covariance] != [size] * size:
            raise RuleError(
                f"the errors of {tests} thresholds stand beside {len(self.budget_V)} budgets and a covariance of "
                f"{len(self.covariance)} rows, expected {tests} and {size} rows of {size}"
            )
