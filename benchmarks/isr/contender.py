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
    """

    name: str
    made: str
    sources: Mapping[str, str]
    ours: bool = False
    fast: bool = True


def our_forms(compensator: Compensator) -> list[Contender]:
    """Return the product's core in every form that the generator has."""
    forms = {"wide": "32x32->64 bit products"}
    return [
        Contender(
            name=f"ours, {form}",
            made=f"`dzdesign codegen`, {text}.",
            sources=_core_of(compensator, form),
            ours=True,
        )
        for form, text in forms.items()
    ]


def _core_of(compensator: Compensator, form: str) -> Mapping[str, str]:
    """Return the core's files in one form; until the generator has a choice there is one."""
    files = {"wide": lambda: generate(compensator, "f28335").files}[form]()
    return {path.removeprefix("core/"): text for path, text in files.items() if path.startswith("core/")}
