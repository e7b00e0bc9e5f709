"""What the report says of one output, and of all that lie in a folder."""

from dataclasses import dataclass

from dzdesign.core.verdicts import verdict_words


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutput:
    """One output of the compensator that a report is of: a folder, or a file alone."""

    #: Such as "C firmware", "Structured Text" by its target, or "calibration block".
    kind: str
    #: What was chosen of it, in words; empty if nothing is to be chosen.
    settings: str
    #: Folder or file, below the folder of the report.
    place: str
    #: SHA-256 of its manifest.json; of a file alone that of its bytes.
    sha256: str
    #: What evidence about these bytes says; None without such evidence, or where a requirement was not checked.
    holds: bool | None = None
    #: How many inputs were compared with the exact law.
    inputs: int = 0
    #: Where that evidence stands; empty without one.
    evidence: str = ""
    #: Which requirement does not hold, or was not checked.
    fault: str = ""
    #: What differs from the manifest: the files are no longer those that were generated.
    changed: str = ""

    @property
    def verdict(self) -> str:
        """In words, as the terminal prints it."""
        if self.changed:
            return "CHANGED"
        return verdict_words(self.holds) if self.evidence or self.holds is not None else "NOT VERIFIED"

    @property
    def is_wrong(self) -> bool:
        """Whether nobody should use it: it was changed, or its evidence says that it does not hold."""
        return bool(self.changed) or self.holds is False


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutputs:
    """The outputs of one compensator in a folder; `others` are sentences on those that were not listed."""

    listed: tuple[MadeOutput, ...] = ()
    others: tuple[str, ...] = ()


NO_OUTPUTS = MadeOutputs()
