"""manifest.json of an output other than a C firmware, as a type: Structured Text, an FMU, a MATLAB function.

`codegen` writes it and `verify` compares it with the folder. These share no code, so what both read stands before them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import Artefact, Sha256
from dzdesign.design.firmware_manifest import FirmwareOrigin, Text

#: Characters of a setting in a sentence.
LONGEST_SETTING = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputManifest(Artefact):
    """Files of an output and their origin, as `dzdesign codegen` writes it."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Annotated[Literal["dzdesign.output/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.output/1"
    )
    target: Annotated[Text, Meta(description="Kind of output, as listed by `codegen --list-targets`.")]
    settings: Annotated[
        Mapping[Text, str],
        Meta(description="Option of `codegen` that is of this target alone, without hyphens, to its value."),
    ]
    law: Annotated[Text, Meta(description="Name of the law, as in compensator.json.")]
    origin: Annotated[FirmwareOrigin, Meta(description="Hashes of all files from which the output was made.")]
    files: Annotated[Mapping[Text, Sha256], Meta(description="SHA-256 of each generated file, by file name.")]

    @property
    def settings_in_words(self) -> str:
        """Return the settings behind commas; of a long one, such as a plant, the name alone."""
        return "".join(f", {word}" for word in setting_words(self.settings))


def setting_words(settings: Mapping[str, str]) -> list[str]:
    """Return each setting that is not empty, as its option is called; of a long one, such as a plant, the name alone.

    Examples
    --------
    >>> setting_words({"table_dp": "2 MPa", "plant": ""}), setting_words({"plant": "{" + 20 * " " + "}"})
    (['table-dp 2 MPa'], ['with a plant'])
    """
    words = {name.replace("_", "-"): value for name, value in settings.items() if value}
    return [f"{name} {value}" if len(value) <= LONGEST_SETTING else f"with a {name}" for name, value in words.items()]
