"""`plan`: what bench and valve are expected to be like -> a series of ramp tests, with the predicted error."""

import os
from dataclasses import KW_ONLY, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.chosen_units import read_units
from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import number, percent, quantity, quantity_range, whole_number, with_tolerance
from dzdesign.core.options import EXPECTED, FIT, METER, RECORDINGS, AnyPath, Option, Text, Texts, flag_of, read_options
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.core.worded import errors_in
from dzdesign.terminal.progress import stage_progress

if TYPE_CHECKING:
    import numpy as np

    from dzdesign.identify.planning.premises import Bench, ExpectedValve, Pilot
    from dzdesign.identify.planning.results import Premise, SeriesPlan
    from dzdesign.identify.planning.search import Request
    from dzdesign.identify.valve.model import ValveModel

#: Options that a pilot series answers.
OF_PILOT = ("dead_zone", "threshold_change", "max_flow", "u_max")


@dataclass(frozen=True)
class PlanArguments:
    """Arguments of `plan`."""

    pilot: Annotated["ValveModel | AnyPath | None", Option("VALVE.json")] = None
    """The valve.json of a quick series of this valve. It supplies noise, thresholds, flow gain and repeatability."""
    _: KW_ONLY
    side: Annotated[Text, Option("SIDE", choices=("positive", "negative"))] = None
    """Side of the pilot series' valve to be recorded, positive or negative (default: its only one, or the positive
    one)."""
    budget: Annotated[str, Option("T", example="30 min", read=quantity("time"))] = "30 min"
    """Time for the whole series, including pauses."""
    loss: Annotated[Text, Option("U", example="150 mV", read=quantity("voltage"))] = None
    """Acceptable mean distance of the certified offset below the threshold, such as "150 mV". The plan is the shortest
    series that reaches it (default: the smallest distance that the time allows)."""
    seed: Annotated[
        int | str, Option("N", read=whole_number("a whole number of zero or more, such as 1", digits=18))
    ] = "1"
    """Random seed of the order of the ramps."""
    dp_range: Annotated[Text, Option("P..P", EXPECTED, "1..5 MPa", "1..5 MPa", quantity_range("pressure"))] = None
    """Lowest and highest pressure drop to be certified. One value plans a series at that pressure drop."""
    dead_zone: Annotated[Text, Option("S", EXPECTED, "50 %", "50 %", percent("50 %"))] = None
    """Closing threshold at the lowest pressure drop, in percent of full command."""
    threshold_change: Annotated[Text, Option("S", EXPECTED, "2 %", "2 %", percent("2 %", signed=True))] = None
    """Fall of the threshold from the lowest to the highest pressure drop, in percent of full command. A rise is
    negative: --threshold-change=-2%."""
    max_flow: Annotated[Text, Option("Q", EXPECTED, "15 L/min", "15 L/min", quantity("flow"))] = None
    """Flow at full command and the lowest pressure drop."""
    repeatability: Annotated[Text, Option("S", EXPECTED, "0.25 %", "0.1 %", percent("0.1 %"))] = None
    """Standard deviation of the threshold from ramp to ramp, in percent of full command."""
    u_max: Annotated[Text, Option("U", EXPECTED, "10 V", "10 V", quantity("voltage"))] = None
    """Full command."""
    sample_rate: Annotated[str, Option("F", RECORDINGS, example="100 Hz", read=quantity("frequency"))] = "100 Hz"
    """Sampling rate of the recordings."""
    ramp_times: Annotated[str, Option("T..T", RECORDINGS, example="20..200 s", read=quantity_range("time"))] = (
        "20..200 s"
    )
    """Shortest and longest time of a ramp from zero to full command. One value fixes it."""
    pause: Annotated[str, Option("T", RECORDINGS, example="20 s", read=quantity("time"))] = "20 s"
    """Time between two ramps, for setting the pressure drop and settling at zero command."""
    noise: Annotated[Text, Option("Q", METER, "0.15 L/min", "0.15 L/min", quantity("flow"))] = None
    """Standard deviation of one reading of the flow."""
    meter_floor: Annotated[Text, Option("Q", METER, "0 L/min", "0.6 L/min", quantity("flow"))] = None
    """Flow below which the meter reads zero."""
    meter_lag: Annotated[Text, Option("T", METER, "0.1 s", "0.1 s", with_tolerance("time"))] = None
    """Lag of the flow meter for identify, with its tolerance, such as "0.1 s +- 0.02 s". Without a tolerance it is 20
    %, and at least 0.05 s."""
    meter_zero: Annotated[Text, Option("Q", METER, "0 L/min", "0.1 L/min", quantity("flow"))] = None
    """Bound of the flow meter's zero error."""
    units: Annotated[Texts | None, Option("U", RECORDINGS, read=read_units)] = None
    """Units of the printed results, such as "bar, %" (default: those of the pilot series)."""
    confidence: Annotated[float | str, Option("C", FIT, read=number("a number such as 0.99", (0.5, 1.0)))] = "0.99"
    """Joint confidence level of all lower bounds."""


def plan(arguments: PlanArguments) -> "SeriesPlan":
    """Plan a series of ramp tests: pressure drops, ramp times, repeats and order, with the predicted error.

    Returns
    -------
    SeriesPlan
        The chosen series and its order, with alternatives and premises.

    Raises
    ------
    InputError
        If the file or an option can't be read, or no series with enough repeats fits into the time.
    """
    from dzdesign.identify.planning.results import series_plan
    from dzdesign.identify.planning.search import plan_series

    read = read_options(arguments, [each.name for each in fields(PlanArguments) if each.name != "pilot"])
    pilot = _read_pilot(arguments)
    units = AS_COMPUTED if pilot is None else pilot.recorded_units
    if read["units"] is not None:
        units = read["units"].over(units, read["u_max"] if pilot is None else pilot.u_max)
    with errors_in(units):
        valve, bench, request = _premises(arguments, read, pilot)
        with stage_progress("comparing series"):
            found = plan_series(valve, bench, request)
    return series_plan(found, valve, bench, request, _stated(arguments, valve, bench, pilot, units), units)


def _read_pilot(arguments: PlanArguments) -> "Pilot | None":
    """Return what the pilot series tells; refuse options that it answers."""
    from dzdesign.core.artefact_reading import read_artefact
    from dzdesign.identify.planning.premises import read_pilot
    from dzdesign.identify.valve.model import ValveModel

    if arguments.pilot is None:
        if arguments.side is not None:
            raise InputError("--side is a side of the pilot series' valve; leave it out, or give VALVE.json")
        return None
    answered = [flag_of(name) for name in OF_PILOT if getattr(arguments, name) is not None]
    if answered:
        raise InputError(f"{answered[0]} is answered by the pilot series; leave out the option, or VALVE.json")
    if isinstance(arguments.pilot, ValveModel):
        return read_pilot(arguments.pilot, arguments.side)
    content = read_bytes(Path(arguments.pilot), "valve file")
    return read_pilot(read_artefact(content, ValveModel, os.fspath(arguments.pilot)), arguments.side)


def _premises(
    arguments: PlanArguments, read: dict[str, Any], pilot: "Pilot | None"
) -> "tuple[ExpectedValve, Bench, Request]":
    """Return the expected valve, the bench and the request: what is given, else the pilot's, else the defaults."""
    from dzdesign.identify.planning.search import Request

    u_max = read["u_max"] if pilot is None else pilot.u_max
    if pilot is not None and arguments.dp_range is None:
        dp_range = (float(pilot.valve.dp[0]), float(pilot.valve.dp[-1]))
    else:
        dp_range = read["dp_range"]
    valve = _expected_valve(arguments, read, pilot, dp_range, u_max)
    request = Request(
        dp_range=dp_range,
        budget=read["budget"],
        ramp_times=read["ramp_times"],
        wanted=read["loss"],
        seed=read["seed"],
    )
    return valve, _bench(arguments, read, pilot, u_max, valve.scatter / u_max), request


def _expected_valve(
    arguments: PlanArguments, read: dict[str, Any], pilot: "Pilot | None", dp_range: tuple[float, float], u_max: float
) -> "ExpectedValve":
    from dzdesign.identify.planning.premises import straight_valve

    scatter = read["repeatability"] * u_max
    if pilot is not None:
        return pilot.valve if arguments.repeatability is None else replace(pilot.valve, scatter=scatter)
    return straight_valve(
        dp_range,
        threshold=read["dead_zone"] * u_max,
        change=read["threshold_change"] * u_max,
        max_flow=read["max_flow"],
        u_max=u_max,
        scatter=scatter,
    )


def _bench(
    arguments: PlanArguments, read: dict[str, Any], pilot: "Pilot | None", u_max: float, repeatability: float
) -> "Bench":
    from dzdesign.identify.knees.meter_lag import find_lag
    from dzdesign.identify.options import IdentifyOptions
    from dzdesign.identify.planning.premises import Bench

    def of(name: str) -> Any:
        return getattr(pilot, name) if pilot is not None and getattr(arguments, name) is None else read[name]

    lag, tolerance = read["meter_lag"]
    if pilot is not None and arguments.meter_lag is None and pilot.meter_lag is not None:
        lag, tolerance = pilot.meter_lag, None
    options = IdentifyOptions(
        u_max=u_max,
        meter_floor=of("meter_floor"),
        meter_lag=lag,
        meter_lag_tolerance=tolerance,
        meter_zero=of("meter_zero"),
        confidence=read["confidence"],
        repeatability=repeatability,
    )
    return Bench(
        u_max=u_max,
        noise=of("noise"),
        noise_inflation=1.0 if pilot is None else pilot.noise_inflation,
        sample_rate=read["sample_rate"],
        meter_floor=options.meter_floor or 0.0,
        meter_zero=options.meter_zero,
        lag=find_lag([], options),
        pause=read["pause"],
        confidence=options.confidence,
        flat_below=options.flat_below,
    )


def _stated(
    arguments: PlanArguments, valve: "ExpectedValve", bench: "Bench", pilot: "Pilot | None", units: RecordedUnits
) -> "list[Premise]":
    """Return the premises as text, and where each is from."""
    from dzdesign.identify.constants import L_MIN
    from dzdesign.identify.planning.results import Premise

    def origin(name: str, *, in_pilot: bool = True) -> str:
        if getattr(arguments, name) is not None:
            return "given"
        return "pilot series" if pilot is not None and in_pilot else "assumed"

    def span(values: "np.ndarray", unit: str) -> str:
        ends = (values[0], values[-1])
        return " to ".join(
            dict.fromkeys(units.number(end, f".3g {unit}") if unit else f"{end:.3g}" for end in ends)
        )

    def flow(value: float) -> str:
        return units.text(value / L_MIN, ".3g L/min")

    # A share of a signal that is not zero at zero command is no share of its reading.
    unnamed = units.command.at_zero or units.command.unit == "%"
    full = "full command" if unnamed else units.text(bench.u_max, "g V")

    whole = {origin(name) for name in ("dead_zone", "threshold_change")}
    return [
        Premise(
            name="threshold",
            value=f"{span(100 * valve.threshold / bench.u_max, '')} % of {full}",
            origin=whole.pop() if len(whole) == 1 else "partly assumed",
        ),
        Premise(
            name="largest flow",
            value=f"{span(valve.q_max / L_MIN, 'L/min')} {units.label('L/min')}",
            origin=origin("max_flow"),
        ),
        Premise(
            name="repeatability",
            value=f"{100 * valve.scatter / bench.u_max:.3g}{_error_of_scatter(arguments, bench, pilot)} %",
            origin=origin("repeatability", in_pilot=pilot is not None and pilot.scatter_is != "assumed"),
        ),
        Premise(name="noise", value=flow(bench.noise), origin=origin("noise")),
        Premise(
            name="meter lag",
            value=f"{bench.lag.seconds:.3g} s, at most {bench.lag.shorter:.3g} s shorter",
            origin=origin("meter_lag", in_pilot=pilot is not None and pilot.meter_lag is not None),
        ),
        Premise(name="meter floor", value=flow(bench.meter_floor), origin=origin("meter_floor")),
        Premise(name="meter zero", value=flow(bench.meter_zero), origin=origin("meter_zero")),
    ]


def _error_of_scatter(arguments: PlanArguments, bench: "Bench", pilot: "Pilot | None") -> str:
    """Return the standard error of a scatter that the pilot's repeats measured, in percent of full command."""
    if pilot is None or arguments.repeatability is not None or pilot.scatter_is != "repeats":
        return ""
    return f" ± {100 * pilot.scatter_se / bench.u_max:.1g}"
