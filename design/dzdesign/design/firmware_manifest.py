"""manifest.json as a type: of a firmware, and of any other output.

`codegen` writes it and `verify` compares it with the folder. These share no code, so what both read stands before them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, get_args

from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_types import Artefact, Sha256, SourceFile
from dzdesign.core.errors import InputError, nearest

#: Where the numbers of the valve stand, and the file of a calibration block in the firmware's folder.
Calibration = Literal["fixed", "block"]
FORMS: tuple[Calibration, ...] = get_args(Calibration)
BLOCK_FILE = "calibration.bin"
Text = Annotated[str, Meta(min_length=1)]
#: Test vectors, beside compensator.json.
VECTORS_NAME = "vectors.csv"


def form_named(name: str | None) -> Calibration:
    """Return the form of that name, without one the first; an unknown name is an `InputError`.

    Examples
    --------
    >>> form_named(None), form_named("block")
    ('fixed', 'block')
    """
    for form in FORMS:
        if name in (form, None):
            return form
    raise InputError(f"--calibration: '{name}' is unknown{nearest(name or '', FORMS)}; known: {', '.join(FORMS)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareOrigin:
    """Hashes of all files from which the firmware was made."""

    compensator_json: Annotated[Sha256, Meta(description="SHA-256 of compensator.json.")]
    valve_json: Annotated[Sha256, Meta(description="SHA-256 of valve.json.")]
    ramp_tests: Annotated[tuple[SourceFile, ...], Meta(description="Recordings that the valve was identified from.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareManifest(Artefact):
    """Files of a firmware and their origin, as `dzdesign codegen` writes it."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Literal["dzdesign.firmware/1"] = "dzdesign.firmware/1"
    """Name and version of this schema."""
    target: Text
    """Microcontroller, as `codegen --list-targets` names it."""
    calibration: Annotated[
        Calibration,
        Meta(
            description="Place of the valve's numbers. fixed: constants in the core. block: a calibration block that "
            f"the core receives, {BLOCK_FILE}."
        ),
    ]
    law: Text
    """Name of the law, as in compensator.json."""
    core: Annotated[tuple[Text, ...], Meta(min_length=1)]
    """Files that do not depend on the hardware."""
    board: tuple[Text, ...]
    """Files for the user to complete. `codegen` keeps them if they were changed, and `verify` does not check them."""
    origin: FirmwareOrigin
    """Hashes of all files from which the firmware was made."""
    vectors: Annotated[int, Meta(ge=0, le=99999)]
    """Number of test vectors in vectors.csv, set by `codegen --vectors`; 0 if there are none."""
    files: Mapping[Text, Sha256]
    """SHA-256 of each generated file, by file name."""


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
