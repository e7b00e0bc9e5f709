"""The fixed compensation of a compensator in the steps of a device: rounded to the safe side, its range checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

from dzdesign.codegen.amplifier.device import Device, Parameter
from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import percent, quantity
from dzdesign.core.recorded_units import shown_in
from dzdesign.design.compensator import Compensator
from dzdesign.design.fixed_offset import (
    Characteristic,
    FixedOffset,
    added,
    fixed_offset,
    full_drive,
    jump,
    pressure_line,
    zero_band,
)

#: A recorded pressure drop is this near to the one that was meant.
NEAR = Fraction(1, 100)
#: A larger share of command is no threshold of a zero command.
LARGEST_THRESHOLD = 0.3
PA_IN_MPA = 10**6


def given_dp_MPa(text: str | None) -> Fraction | None:
    """Return the pressure drop of ``--table-dp``, MPa; None where it was not given.

    Examples
    --------
    >>> given_dp_MPa("25 bar"), given_dp_MPa(None)
    (Fraction(5, 2), None)
    """
    return None if text is None else Fraction(repr(quantity("pressure")(text, "--table-dp"))) / PA_IN_MPA


def given_threshold(text: str | None) -> Fraction | None:
    """Return the share of command of ``--threshold``; None where it was not given.

    Examples
    --------
    >>> given_threshold("0.5 %"), given_threshold(None)
    (Fraction(1, 200), None)
    """
    if text is None:
        return None
    threshold = percent("0.5 %")(text, "--threshold")
    if threshold > LARGEST_THRESHOLD:
        raise InputError(
            f"--threshold is '{text}', expected at most {LARGEST_THRESHOLD:.0%}: the valve rests at every command up "
            "to it"
        )
    return Fraction(repr(threshold))


@dataclass(frozen=True, slots=True, kw_only=True)
class AmplifierSetting:
    """The setting of a device in its own counts, and the drive that results from a command."""

    device: Device
    #: Parameter to counts of the device's unit, in the order in which they are written; empty of a table.
    parameters: Mapping[str, int]
    #: Of each sign of command, from the parameters as they are rounded.
    characteristics: Mapping[int, Characteristic]
    #: Of each sign, before it was rounded.
    offsets: Mapping[int, FixedOffset]
    #: Pressure drop that a table is of, MPa.
    dp_MPa: Fraction | None = None
    #: Command up to which one counts as zero, a share of full, where it was given.
    threshold: Fraction | None = None


def amplifier_setting(
    compensator: Compensator, device: Device, *, dp_MPa: Fraction | None = None, threshold: Fraction | None = None
) -> AmplifierSetting:
    """Return the largest setting of a device that opens the valve at no tested pressure drop.

    Parameters
    ----------
    compensator : Compensator
        Design whose certificate holds.
    device : Device
        Whose parameters are wanted.
    dp_MPa : Fraction, optional
        Pressure drop whose whole characteristic is wanted, of a device that takes one; dP0 without it.
    threshold : Fraction, optional
        Command up to which the device keeps the valve at rest, a share of full; that of the design's zero band
        without it.

    Raises
    ------
    InputError
        If the device's range does not hold the setting, it has fewer solenoids, or an option is not of it.
    """
    with shown_in(compensator.valve.recorded_units):
        signs, is_table, at = compensator.signals.signs, device.law == "table", None
        if len(signs) > 1 and not device.takes_both_signs:
            raise InputError(f"{device.title} drives one solenoid, but the design has two; choose another device")
        if compensator.positive is None:
            raise InputError(
                "an amplifier's setting is that of positive commands, but the valve was tested with negative ones "
                "alone; record ramp tests with positive commands, or choose another target"
            )
        offsets = {sign: fixed_offset(compensator, sign) for sign in signs}
        rest = max(zero_band(compensator, sign) for sign in signs) if threshold is None else threshold
        if dp_MPa is not None and not is_table:
            raise InputError(
                f"--table-dp applies to devices with a table of the characteristic, but {device.title} has none; leave "
                "it out"
            )
        if threshold is not None and device.threshold is None and not is_table:
            raise InputError(f"{device.title} has no threshold parameter for --threshold; leave it out")
        if is_table:
            reference = Fraction(repr(compensator.valve.positive.reference.dp_MPa))
            at = _nominal(reference if dp_MPa is None else dp_MPa, offsets)
            parameters, characteristics = dict[str, int](), _table(compensator, device, offsets, at, rest)
        elif device.law == "jump":
            parameters, characteristics = _jump(compensator, device, offsets, rest)
        else:
            _refuse_a_limit(compensator, device)
            # One offset for both signs: the smaller one.
            set_to = min(_offset_counts(device, offset) for offset in offsets.values())
            parameters = {device.jumps_to.positive: set_to}
            characteristics = dict.fromkeys(offsets, added(Fraction(set_to, device.counts_of_full)))
    return AmplifierSetting(
        device=device, parameters=parameters, characteristics=characteristics, offsets=offsets, dp_MPa=at,
        threshold=threshold,
    )  # fmt: skip


def _nominal(dp_MPa: Fraction, offsets: Mapping[int, FixedOffset]) -> Fraction:
    """Return a pressure drop, or the end of the tests where it is hardly beyond it: tests at 5 MPa were at 4.999."""
    low = max(offset.dp_MPa[0] for offset in offsets.values())
    high = min(offset.dp_MPa[1] for offset in offsets.values())
    if low * (1 - NEAR) <= dp_MPa <= low:
        return low
    return high if high <= dp_MPa <= high * (1 + NEAR) else dp_MPa


def _jump(
    compensator: Compensator, device: Device, offsets: Mapping[int, FixedOffset], rest: Fraction
) -> tuple[dict[str, int], dict[int, Characteristic]]:
    """Return the parameters of a jump at the threshold, and the drives that they make."""
    unit, parameters, characteristics = device.counts_of_full, {}, {}
    at_rest = ceil(rest * unit) if device.threshold else 0
    for sign, offset in offsets.items():
        set_to = _offset_counts(device, offset)
        full = _full_counts(compensator, device, sign)
        if full <= set_to:
            raise InputError(
                f"the largest drive of the design, {device.in_unit(full)}, is not above the offset of "
                f"{device.in_unit(set_to)}; design it with a larger --output-max"
            )
        parameters[device.jumps_to.name(sign)] = set_to
        if device.full is not None:
            parameters[device.full.name(sign)] = full
        characteristics[sign] = jump(Fraction(set_to, unit), Fraction(full, unit), Fraction(at_rest, unit))
    if device.threshold is not None:
        _check_range(device, device.threshold, device.threshold.positive, at_rest, "choose a smaller --threshold")
        parameters[device.threshold.positive] = at_rest
    return parameters, characteristics


def _table(
    compensator: Compensator, device: Device, offsets: Mapping[int, FixedOffset], dp_MPa: Fraction, rest: Fraction
) -> dict[int, Characteristic]:
    """Return points in whole counts: a command is rounded up, a drive down."""
    unit, characteristics = device.counts_of_full, {}
    for sign, offset in offsets.items():
        exact = pressure_line(compensator, offset, dp_MPa, max(rest, Fraction(1, unit)))
        nodes = [(Fraction(ceil(x * unit), unit), Fraction(floor(drive * unit), unit)) for x, drive in exact.nodes]
        for place in range(len(nodes) - 2, 0, -1):  # drives rise from point to point, where the design limits them too
            command, drive = nodes[place]
            nodes[place] = command, min(drive, nodes[place + 1][1] - Fraction(1, unit))
        characteristics[sign] = Characteristic(rest=exact.rest, nodes=tuple(nodes))
    return characteristics


def _offset_counts(device: Device, offset: FixedOffset) -> int:
    """Return the offset rounded down to the device's step; one beyond its range is refused."""
    parameter, counts = device.jumps_to, floor(offset.share * device.counts_of_full)
    instead = device.instead or "a design with PLC or drive needs no such parameter (see codegen --list-targets)"
    _check_range(device, parameter, parameter.name(offset.sign), counts, f"choose another device: {instead}")
    return counts


def _full_counts(compensator: Compensator, device: Device, sign: int) -> int:
    """Return the drive at full command: what opens the valve fully at every test, at most the design's limit."""
    unit = device.counts_of_full
    if device.full is None:
        _refuse_a_limit(compensator, device)
        return unit
    tests = compensator.valve.side(sign).tests
    drives = [full_drive(compensator, Fraction(repr(test.dp_MPa)), sign) for test in tests]
    limit = floor(_limit(compensator) * unit)
    if limit < device.full.least:
        raise InputError(
            f"{device.title} drives at least {device.in_unit(device.full.least)} at full command, and the design "
            f"allows {device.in_unit(limit)}; design it with a larger --output-max, or choose another device"
        )
    return min(max(floor(max(drives) * unit), device.full.least), limit, device.full.most)


def _refuse_a_limit(compensator: Compensator, device: Device) -> None:
    if (limit := _limit(compensator)) < 1:
        raise InputError(
            f"{device.title} has no limit of its drive here, and the design allows {float(limit):.1%} of full drive; "
            "design it without --output-max, or choose another device"
        )


def _limit(compensator: Compensator) -> Fraction:
    return Fraction(compensator.drive_functions.compare_limit, compensator.signals.compare_max)


def _check_range(device: Device, parameter: Parameter, name: str, counts: int, remedy: str) -> None:
    if parameter.least <= counts <= parameter.most:
        return
    end, limit, verb = ("least", parameter.least, "safe") if counts < parameter.least else (
        "most", parameter.most, "needed")  # fmt: skip
    raise InputError(
        f"{device.title} takes at {end} {device.in_unit(limit)} as {name}, and {device.in_unit(counts)} are {verb}; "
        f"{remedy}"
    )
