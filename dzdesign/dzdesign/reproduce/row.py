"""One number of the paper beside ours: what it is, whose ours are, and in which range they must lie."""

from dataclasses import asdict, dataclass
from typing import Any

#: Decimals in reproduction.json: more than the paper prints, fewer than a compiler's last bits reach.
DIGITS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Our number for one of the paper's: whose it is, and the range in which it must lie (None: in none)."""

    by: str
    value: float | None
    allowed: tuple[float, float] | None = None

    @property
    def holds(self) -> bool | None:
        """Whether the requirement holds; None where there is none."""
        if self.allowed is None or self.value is None:
            return None
        return self.allowed[0] <= self.value <= self.allowed[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One printed number and ours.

    Attributes
    ----------
    valve : str
        Of the paper.
    quantity, unit : str
        What it is; "without" and "with" are of the compensator.
    dp_MPa : float or None
        Pressure drop.
    published : str
        As printed.
    in_fit : bool
        Whether the number went into the fit of the valve's parameters; else ours is a prediction.
    outcomes : tuple of Outcome
        Of the bare valve; or of the paper's law and of the product.
    tolerance : str
        Why so closely; empty where nothing is required.
    why : str
        Where ours differs, or is not required to agree: why.
    """

    valve: str
    quantity: str
    unit: str
    dp_MPa: float | None
    published: str
    in_fit: bool = False
    outcomes: tuple[Outcome, ...]
    tolerance: str = ""
    why: str = ""

    @property
    def holds(self) -> bool | None:
        """Whether every requirement of the row holds; None where there is none."""
        found = [outcome.holds for outcome in self.outcomes if outcome.holds is not None]
        return all(found) if found else None

    def difference(self, outcome: Outcome) -> float | None:
        """Return an outcome less the printed number; None where either is no number."""
        try:
            return None if outcome.value is None else outcome.value - float(self.published)
        except ValueError:
            return None

    def to_document(self) -> dict[str, Any]:
        """Return the row as it stands in reproduction.json."""
        document = asdict(self)
        document["outcomes"] = [
            {
                "by": outcome.by,
                "value": _rounded(outcome.value),
                "difference": _rounded(self.difference(outcome)),
                "allowed": None if outcome.allowed is None else [_rounded(end) for end in outcome.allowed],
                "holds": outcome.holds,
            }
            for outcome in self.outcomes
        ]
        return {**document, "holds": self.holds}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)
