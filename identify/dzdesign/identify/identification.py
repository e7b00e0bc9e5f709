"""`identify`: ramp tests in, `ValveModel` out, each side of the valve on its own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from msgspec import UNSET

from dzdesign.core.artefact_reading import rounded
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, own_result
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits, shown_in
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import most_serious_first, warn
from dzdesign.identify.data_quality.meter_faults import without_clipping, without_drop_outs
from dzdesign.identify.data_quality.pressures import about_mixtures, about_single_pressures
from dzdesign.identify.data_quality.recordings import about_recordings, about_rest, about_whole_meter
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.command import without_dither
from dzdesign.identify.ramps.sides import tests_of_side
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.scaling import units_of
from dzdesign.identify.side import Identification, SideIdentification, identify_side
from dzdesign.identify.valve.low_flow import LowFlow, readings_of_side
from dzdesign.identify.valve.model import DECIMALS, SIDES, Meter, ValveModel, Warning_

#: What ramps of several pressure drops show where a stuck sensor has made one test of them: no word on meter or valve.
EXPLAINED_BY_MIXED_PRESSURES = ("noise", "bend")


def identify(
    tests: Sequence[RampTest], options: IdentifyOptions | None = None, record: Mapping[str, str] | None = None
) -> ValveModel:
    """Identify k x_max/u_max, the thresholds and beta(dP) of a valve from ramp tests.

    Parameters
    ----------
    tests : sequence of RampTest
        Recordings in any order. Each may hold several ramps, and ramps at one pressure drop form one test. A single
        recording may lack the pressure drop. Recordings of a bipolar valve may hold both sides, or one each.
    options : IdentifyOptions, optional
        Options of the identification.
    record : mapping of str to str, optional
        Test record, such as serial number and oil. It is copied to the result unchanged.

    Returns
    -------
    ValveModel
        The law's parameters (Eqs. 5, 11), with bounds, warnings and provenance.

    Raises
    ------
    InputError
        If no threshold can be identified. The message states the reason.
    """
    return identify_sides(tests, options, record).model


@own_result()
def identify_sides(
    tests: Sequence[RampTest],
    options: IdentifyOptions | None = None,
    record: Mapping[str, str] | None = None,
    low_flow: Sequence[LowFlow] = (),
) -> Identification:
    """Identify a valve as `identify` does, and return beside it what each side was found from.

    `low_flow` are flows below the meter's floor that were measured by hand.
    """
    options = options or IdentifyOptions()
    if not tests:
        raise InputError("no ramp tests were given; expected at least one file")
    units = units_of(tests)
    with shown_in(units):
        return _identified(tests, options, units, record or {}, low_flow)


def _identified(
    tests: Sequence[RampTest],
    options: IdentifyOptions,
    units: RecordedUnits,
    record: Mapping[str, str],
    low_flow: Sequence[LowFlow],
) -> Identification:
    dither = options.dithered.of(units, options.u_max) if options.dithered else None
    tests = [without_dither(test, dither, options.u_max) for test in tests]
    sides, warnings = _each_side(tests, options, units, low_flow)
    lag = next(iter(sides.values())).described.lag
    zeros = {name: side.described.zero_L_min for name, side in sides.items()}
    # In whatever order they came: those of the pressure drops, then those of a side that was refused.
    files = dict.fromkeys(file for side in sides.values() for item in side.described.tests for file in item.files)
    files |= dict.fromkeys(sorted((test.source, test.sha256) for test in tests))
    model = ValveModel(
        tool=THIS_TOOL,
        made_from=tuple(SourceFile(source=source, sha256=digest) for source, digest in files),
        simulated=any(test.simulated for test in tests),
        u_max_V=options.u_max,
        meter=Meter(
            floor_L_min=max(side.described.floor for side in sides.values()) / L_MIN,
            lag_s=lag.seconds,
            lag_is=lag.origin,
            lag_longer_s=lag.longer,
            lag_shorter_s=lag.shorter,
            left_by_rates_s=lag.left[0] if lag.left else UNSET,
            left_by_rates_se_s=lag.left[1] if lag.left else UNSET,
            zero_L_min=options.meter_zero / L_MIN,
        ),
        knee_window=options.knee_window,
        sides={name: side.model for name, side in sides.items()},
        warnings=most_serious_first(
            (
                *about_recordings(tests),
                *about_rest(tests, options.u_max),
                *about_whole_meter(zeros, tests, options.u_max),
                *warnings,
            )
        ),
        record=dict(record),
        dithered=dither or UNSET,
    )
    # Rounded as they are, factors of a small unit would lose their digits.
    model = replace(rounded(model, DECIMALS), recorded_units=units)
    return Identification(
        model=model, sides={name: replace(side, model=model.sides[name]) for name, side in sides.items()}
    )


def _each_side(
    tests: Sequence[RampTest], options: IdentifyOptions, units: RecordedUnits, low_flow: Sequence[LowFlow]
) -> tuple[dict[str, SideIdentification], list[Warning_]]:
    """Identify each side that was recorded; warnings and a refusal are in the units of the recordings."""
    sides: dict[str, SideIdentification] = {}
    refused: list[Warning_] = []
    warnings: dict[str, list[Warning_]] = {}
    for name, sign in SIDES.items():
        of_side, by_hand = tests_of_side(tests, sign, options.u_max), readings_of_side(low_flow, sign)
        if not of_side:
            if by_hand:
                raise InputError(f"{by_hand[0].source} is of {name} commands, but no ramp test is; record one")
            continue
        with shown_in(units.of_side(name)):
            mixed = tuple(about_mixtures(of_side))
            pressures = (*mixed, *about_single_pressures(of_side))
            # At the end of its range a meter stands still as one that is stuck does.
            of_side, clipped = without_clipping(of_side, options.u_max)
            of_side, dropped = without_drop_outs(of_side)
            try:
                sides[name] = identify_side(of_side, options, units.of_side(name), by_hand)
            except InputError as error:
                # Ramps of several pressures taken for one test may be refused for any reason: the cause is this.
                reason = f"{error}; it may be that {mixed[0].text}" if mixed else str(error)
                if not sides:
                    raise InputError(reason) from error
                refused.append(warn("side-refused", side=name, reason=reason))
                continue
        found = [item for item in sides[name].warnings if not mixed or item.code not in EXPLAINED_BY_MIXED_PRESSURES]
        warnings[name] = [*pressures, *dropped, *clipped, *found]
    return sides, refused + _by_side(warnings)


def _by_side(warnings: Mapping[str, list[Warning_]]) -> list[Warning_]:
    """Return the warnings of all sides; of two sides each says which it is about, and what both give stands once."""
    if len(warnings) == 1:
        return list(*warnings.values())
    said: dict[Warning_, set[str]] = {}
    for name, of_side in warnings.items():
        for warning in of_side:
            said.setdefault(warning, set()).add(name)
    return [
        replace(warning, text=f"{f'{name} side' if not others else 'both sides'}: {warning.text}")
        for warning, (name, *others) in said.items()
    ]
