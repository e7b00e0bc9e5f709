"""Every input of the compiled core against the exactly rounded law, and the properties that make it safe."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.lot_check import LotCheck, check_lot
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.exhaustive.zero_command import zero_command_margins
from dzdesign.verify.toolchain.compiled_core import CompiledCore, Findings


@dataclass(frozen=True, slots=True, kw_only=True)
class InputCheck:
    """What checking every input of one side found; every count but `inputs` must be zero.

    Attributes
    ----------
    sign : int
        Of the commands that the side is for.
    inputs : int
        Pairs of command code and difference of pressure codes, each compared with the exact law.
    wrong : int
        Pairs whose compare value is not the exactly rounded law.
    largest_error : int
        Largest difference in counts.
    out_of_range, not_monotone_in_u, not_monotone_in_dp : int
        Compare values above the limit; falls with rising command; steps in dP against the law's own direction.
    over_compensated : int
        Pressure codes of the tested interval whose zero-command drive lies above the threshold's lower bound.
    odd_pairs : int
        Pairs of pressure codes that give another value than their difference does.
    bad_fallbacks, bad_status : int
        Codes that are not sound and do not fall back to the safe value; status words that say something else.
    bad_betas : int
        Pairs of pressure codes at which what is shown of beta is not the law's, rounded down.
    smallest_margin_V : float
        Smallest distance from the zero-command drive to the threshold's lower bound; negative if it is exceeded.
    core_sha256, object_sha256 : str
        Hashes of the C that was compiled and of the object that was tried.
    outputs_hash : str
        Hash of the compare values of all inputs, in their order.
    calls : int
        Calls of the core in all: the inputs, the pairs of pressures at zero command and what is not sound.
    pressure_pairs : int
        Pairs of sound pressure codes; each is tried, see `check_all_inputs`.
    first_wrong : str or None
        The first failure, in words.
    lot : LotCheck or None
        Of a common setting: every valve of its lot; None of a valve's own.
    """

    sign: int
    inputs: int
    wrong: int
    largest_error: int
    out_of_range: int
    not_monotone_in_u: int
    not_monotone_in_dp: int
    over_compensated: int
    odd_pairs: int
    bad_fallbacks: int
    bad_status: int
    bad_betas: int
    smallest_margin_V: float
    core_sha256: str
    object_sha256: str
    outputs_hash: str
    calls: int
    pressure_pairs: int
    first_wrong: str | None
    lot: LotCheck | None = None

    @property
    def holds(self) -> bool:
        """True if nothing was found."""
        return not any(
            (
                self.wrong,
                self.out_of_range,
                self.not_monotone_in_u,
                self.not_monotone_in_dp,
                self.over_compensated,
                self.odd_pairs,
                self.bad_fallbacks,
                self.bad_status,
                self.bad_betas,
                self.lot and self.lot.over_compensated,
            )
        )


def check_all_inputs(folder: Path, sign: int = 1) -> InputCheck:
    """Compare one side of the compiled core with the exact law on every pair of command and pressure difference.

    The core has three inputs, 2^36 triples of 12 bits; it may depend on the two pressures by their difference only.
    That is itself checked. At each difference the commands take the pairs of pressures that make it in turn, so that
    every input is tried once, and with it every pair of sound pressure codes of which there are no more than commands;
    at zero command, where it matters most, all pairs that the law follows are tried, and all that are not sound.

    Parameters
    ----------
    folder : Path
        Firmware folder: ``core/`` and ``compensator.json``.
    sign : {1, -1}
        Sign of the commands that the side is for.

    Raises
    ------
    RequirementError
        If the core does not compile, crashes, or hangs.
    """
    document = json.loads((folder / "compensator.json").read_bytes())
    prepared = PreparedInputs(ExactLaw(document, sign))
    core = CompiledCore(folder, sign)
    return input_check(document, prepared, core, core.check(prepared.everything()))


def input_check(document: dict[str, Any], prepared: PreparedInputs, core: CompiledCore, found: Findings) -> InputCheck:
    """Return what was found, with the bound at zero command.

    Parameters
    ----------
    document : dict
        compensator.json.
    prepared : PreparedInputs
        What was tried.
    core : CompiledCore
        What it was tried on.
    found : Findings
        What the machine reported.
    """
    exact = prepared.exact
    above, margin = zero_command_margins(document, exact, prepared.differences, found.at_zero)
    return InputCheck(
        sign=1 if exact.side == "positive" else -1,
        inputs=found.inputs,
        wrong=found.wrong,
        largest_error=found.largest_error,
        out_of_range=found.out_of_range,
        not_monotone_in_u=found.falls,
        not_monotone_in_dp=found.against,
        over_compensated=above,
        odd_pairs=found.odd,
        bad_fallbacks=found.bad_fallbacks,
        bad_status=found.bad_status,
        bad_betas=found.bad_betas,
        smallest_margin_V=float(margin),
        core_sha256=core.sha256,
        object_sha256=found.object_sha256,
        outputs_hash=found.outputs_hash,
        calls=found.calls,
        pressure_pairs=prepared.differences.pairs,
        first_wrong=first_wrong(prepared, found),
        lot=check_lot(document, exact, prepared.differences, found.at_zero),
    )


def first_wrong(prepared: PreparedInputs, found: Findings) -> str | None:
    """Return the first wrong value in words, or None.

    Parameters
    ----------
    prepared : PreparedInputs
        What was tried: everything.
    found : Findings
        What the machine reported.
    """
    if not found.wrong:
        return None
    return (
        f"command code {prepared.code_at(found.first_place)}, pressure-difference code "
        f"{prepared.differences.values[found.first_row]}: compare value {found.first_found}, "
        f"expected {found.first_expected}"
    )
