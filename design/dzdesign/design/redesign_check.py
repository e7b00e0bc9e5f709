"""Check that a compensator follows from its valve and options; an edited file would otherwise change the firmware."""

from dataclasses import replace
from fractions import Fraction
from itertools import takewhile

from dzdesign.core.errors import InputError, RequirementError, quoted
from dzdesign.core.value_differences import differences
from dzdesign.design.certificate import prove_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.lot_margins import prove_lot
from dzdesign.design.lot_valves import LotSide
from dzdesign.design.options import options_of
from dzdesign.design.signals import SIDE_NAMES

#: Coarsest unit of the law's coefficients, see `dzdesign.design.side_design`.
COARSEST = Fraction(1, 2**12)
#: Characters before the first difference of two texts that a message shows.
CONTEXT = 12


def refuse_without_options(compensator: Compensator, source: str) -> None:
    """Refuse a file that does not say what it was designed with: nothing in it could be derived again."""
    if compensator.target is None:
        raise InputError(
            f"'{source}' does not say for which target and with which options it was designed ('target' and 'options' "
            f"are null), so no number in it can be derived again; {Compensator.REMEDY}"
        )


def prove_derived(compensator: Compensator) -> None:
    """Design the compensator again from the valve and the options in it; refuse the first key that does not follow.

    Of a lot's setting the sides are not those of the one valve in the file: their certificates are proved, and that the
    setting over-compensates no valve. Of a file that does not say what was asked for nothing can be told.
    """
    if compensator.target is None or compensator.options is None:
        return
    try:
        redesigned = design(compensator.valve, options_of(compensator.options, compensator.target))
    except InputError as error:
        raise InputError(f"its valve can't be designed with its options: {error}; {Compensator.REMEDY}") from error
    if compensator.lot:
        prove_certificates(compensator)
        try:
            prove_lot(compensator)
        except RequirementError as error:
            raise InputError(f"{error}; make it again with `dzdesign batch`") from error
        _prove_lot_setting(compensator, redesigned)
        redesigned = replace(redesigned, sides=compensator.sides, lot=compensator.lot, costs=compensator.costs)
    redesigned = replace(redesigned, tool=compensator.tool)
    for found in differences(compensator, redesigned):
        stated, follows = _from_where_they_differ(found.stated, found.follows)
        raise InputError(
            f"'{found.place}' is {_words(stated)}, but {_words(follows)} follows from its valve and its options; "
            f"{Compensator.REMEDY}"
        )


def _prove_lot_setting(compensator: Compensator, redesigned: Compensator) -> None:
    """Bound what follows from all valves by what follows from the one in the file: no larger offset, all of its travel.

    Full command must not ask for more than full drive either. That valve is one of the lot, with the bounds it has.
    """
    of_carrier = [each for each in compensator.lot if each.valve_sha256 == compensator.valve_json_sha256]
    for sign in compensator.signals.signs:
        common, single, name = compensator.side(sign), redesigned.side(sign), SIDE_NAMES[sign]
        drive_range, offset = common.drive_range_over_u_max, common.u_min0_over_u_max
        for place, value, low, high in (
            ("u_min0_over_u_max", offset, Fraction(0), single.u_min0_over_u_max),
            ("drive_range_over_u_max", drive_range, single.drive_range_over_u_max - COARSEST, 1 - offset + COARSEST),
        ):
            if not low <= value <= high:
                raise InputError(
                    f"'sides.{name}.{place}' is {float(value):.6f}, expected {float(low):.6f} to {float(high):.6f} of "
                    f"a setting for this valve among others; {Compensator.REMEDY}"
                )
        bounds = LotSide.of(compensator.valve.sides[name], common.certificate.guard)
        if bounds not in [each.side(sign) for each in of_carrier]:
            raise InputError(
                f"the lot has no valve with the hash and the {name} bounds of the valve in the file; make it again "
                "with `dzdesign batch`"
            )


def _from_where_they_differ(stated: object, follows: object) -> tuple[object, object]:
    """Return two values, of long texts what stands about their first difference: a message shows only so much."""
    if not (isinstance(stated, str) and isinstance(follows, str)):
        return stated, follows
    alike = takewhile(lambda pair: pair[0] == pair[1], zip(stated, follows, strict=False))
    same = sum(1 for _ in alike)
    begin = stated.rfind(" ", 0, max(same - CONTEXT, 0)) + 1
    return stated[begin:], follows[begin:]


def _words(value: object) -> str:
    if isinstance(value, Fraction):
        return f"{float(value):.6f}"
    return "nothing" if value is None else quoted(value)
