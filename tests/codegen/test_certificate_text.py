"""What header and pages say of the certificate: no error of a pressure reading that the margin does not hold."""

from fractions import Fraction

from dzdesign.codegen.core.certificate_text import certificate_lines
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.target_inputs import Converter
from tests.support.golden_firmware import GOLDENS
from tests.support.paths import ROOT


def largest_excess_V(compensator: Compensator, codes: int) -> float:
    """Return by how much zero command's drive exceeds the bound at most, each input off by so many codes, V."""
    signals, side = compensator.signals, compensator.side(1)
    guarded = compensator.valve.sides["positive"].certified[side.certificate.guard]
    bound = guarded.bound()
    first, last = (int(signals.dp_code(Fraction(repr(end)))) for end in (guarded.dp_MPa[0], guarded.dp_MPa[-1]))
    excess = []
    for code in range(first + 1, last):
        least = float(bound.at(signals.dp_MPa(code)))
        for read in (code - 2 * codes, code + 2 * codes):
            drive = compensator.compare(signals.command.zero_code, max(read, 0), 1) / signals.compare_max
            excess.append(drive * float(compensator.u_max_V) - least)
    return max(excess)


def test_rounding_alone_is_claimed_for_more_is_not_held():
    compensator = read_artefact((GOLDENS / "compensator.json").read_bytes(), Compensator, "compensator.json")
    assert largest_excess_V(compensator, 0) < 0
    # The data sheet's error of the same converter on both pressure inputs: the margin is not made for it.
    assert largest_excess_V(compensator, Converter().offset_codes) > 1e-3
    header = " ".join(certificate_lines(compensator, 1))
    assert "converters' error" not in header and "in addition to the rounding" in header
    assert "does not cover coil temperature" in header
    page = " ".join((ROOT / "docs" / "not-proved.md").read_text(encoding="utf-8").split())
    assert "errors of the pressure sensors and of their converters beyond rounding" in page
