"""A `Contender`: one implementation of the law as C sources with the entry ``dz_comp``, and how it was made."""

from collections.abc import Mapping
from dataclasses import dataclass

from dzdesign.codegen.project import generate
from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """One row of the table.

    Attributes
    ----------
    name : str
        In the table.
    made : str
        How, in a sentence.
    sources : mapping
        File name to text; together they define ``uint16_t dz_comp(uint16_t, uint16_t, uint16_t)``.
    ours : bool
        True for the product's own.
    fast : bool
        False for soft floating point in doubles, with which all inputs on an emulated Cortex-M4 take hours.
    prelude : str
        C ahead of the program that counts, where that calls something else or with more than the codes.
    """

    name: str
    made: str
    sources: Mapping[str, str]
    ours: bool = False
    fast: bool = True
    prelude: str = ""


def our_forms(compensator: Compensator) -> list[Contender]:
    """Return the product's core, with the numbers of the valve in it."""
    files = generate(compensator, "f28335").files
    names = ("dz_comp.c", "dz_comp.h", "dz_calibration.h", "dz_valve.h")
    sources = {name: files[f"core/{name}"] for name in names}
    return [Contender(name="ours", made="`dzdesign codegen`, 32x32->64 bit products.", sources=sources, ours=True)]
