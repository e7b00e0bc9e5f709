"""That a compensator is what its valve and its options give: a file can be edited, and the firmware would follow it."""

import re
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError, RequirementError, quoted
from dzdesign.design.certificate import prove_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.compensator_file import REMEDY, compensator_document
from dzdesign.design.designing import design
from dzdesign.design.lot import LotSide, prove_lot
from dzdesign.design.option_texts import options_of
from dzdesign.identify.valve.model import ValveModel

#: What of a common setting no single valve gives.
OF_ALL_VALVES = ("k_x_max_over_u_max", "u_min0_over_u_max", "beta", "certificate")
#: Keys of a common setting that no design of one valve has, or has otherwise.
OF_THE_LOT = ("costs", "common_valves", "lot", "lot_sha256")
#: Coarsest unit of the law's coefficients, see `dzdesign.design.quantise`.
COARSEST = Fraction(1, 2**12)
#: Keys whose pair is one rational number.
RATIONAL = re.compile(r"(_over_u_max|u_max_V|margin_V|converter_V|span_MPa|(error|dp)_MPa\[\d\])$")


def refuse_unsaid(compensator: Compensator, source: str) -> None:
    """Refuse a file that does not say what it was designed with: nothing in it could be derived again.

    Parameters
    ----------
    compensator : Compensator
        As it was read.
    source : str
        The file, for the message.

    Raises
    ------
    InputError
        If it does not.
    """
    if compensator.request is None:
        raise InputError(
            f"'{source}' does not say for which target and with which options it was designed ('target', 'options', "
            f"'common_valves', 'valve_sha256'), so no number in it can be derived again; {REMEDY}"
        )


def prove_derived(compensator: Compensator) -> None:
    """Design the compensator again from the valve and the options in it, and compare every number.

    A file that does not say what was asked for, as all from before that was kept, has its certificates proved alone.

    Raises
    ------
    InputError
        For the first key that does not follow.
    """
    prove_certificates(compensator)
    try:
        prove_lot(compensator)
    except RequirementError as error:
        raise InputError(f"{error}; make it again with `dzdesign batch`") from error
    if compensator.request is None:
        return
    try:
        options = options_of(dict(compensator.request.options), compensator.request.target)
        content = compensator.valve_document.encode()
        own = design(read_artefact(content, ValveModel, "compensator.json: valve"), options, content)
    except InputError as error:
        raise InputError(f"its valve can't be designed with its options: {error}; {REMEDY}") from error
    said, follows = compensator_document(compensator), compensator_document(own)
    if compensator.common_valves:
        _prove_common(compensator, own)
        for document in (said, follows):
            for key in OF_THE_LOT:
                document.pop(key, None)
            for side in filter(None, document["sides"].values()):
                for key in OF_ALL_VALVES:
                    del side[key]
    said["made_from"] = follows["made_from"] = []  # hash of a file whose spacing is not kept
    for place, one, other in _differences(said, follows):
        raise InputError(
            f"'{place}' is {_words(one, place)}, but {_words(other, place)} follows from its valve and its options; "
            f"{REMEDY}"
        )


def _prove_common(compensator: Compensator, own: Compensator) -> None:
    """Bound what follows from all valves by what follows from the one in the file: no larger offset, all of its travel.

    Full command must not ask for more than full drive either. That valve is one of the lot, with the bounds it has.
    """
    valve = read_artefact(compensator.valve_document.encode(), ValveModel, "compensator.json: valve")
    of_carrier = [each for each in compensator.lot if each.valve_sha256 == compensator.valve_sha256]
    for sign in compensator.signals.signs:
        common, single = compensator.side(sign), own.side(sign)
        name = "positive" if sign > 0 else "negative"
        k_x_max, offset = common.k_x_max_over_u_max, common.u_min0_over_u_max
        for place, value, low, high in (
            ("u_min0_over_u_max", offset, Fraction(0), single.u_min0_over_u_max),
            ("k_x_max_over_u_max", k_x_max, single.k_x_max_over_u_max - COARSEST, 1 - offset + COARSEST),
        ):
            if not low <= value <= high:
                raise InputError(
                    f"'sides.{name}.{place}' is {float(value):.6f}, expected {float(low):.6f} to {float(high):.6f} of "
                    f"a setting for this valve among others; {REMEDY}"
                )
        bounds = LotSide.of(valve.sides[name], common.certificate.guard)
        if compensator.lot and bounds not in [each.positive if sign > 0 else each.negative for each in of_carrier]:
            raise InputError(
                f"the lot has no valve with the hash and the {name} bounds of the valve in the file; make it again "
                "with `dzdesign batch`"
            )


def _differences(said: Any, follows: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield place, value and what should stand there, of each key that differs."""
    if isinstance(said, dict) and isinstance(follows, dict):
        for key in {**follows, **said}:
            path = f"{place}.{key}" if place else key
            yield from _differences(said.get(key), follows.get(key), path)
    elif said != follows and isinstance(said, list) and isinstance(follows, list) and len(said) == len(follows):
        if RATIONAL.search(place):
            yield place, said, follows
            return
        for index, (one, other) in enumerate(zip(said, follows, strict=True)):
            yield from _differences(one, other, f"{place}[{index}]")
    elif said != follows:
        yield place, said, follows


def _words(value: Any, place: str) -> str:
    if RATIONAL.search(place) and isinstance(value, list):
        return f"{float(Fraction(*value)):.6f}"
    return "nothing" if value is None else quoted(value)
