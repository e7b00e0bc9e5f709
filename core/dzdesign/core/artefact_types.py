"""Artefacts as types: one frozen dataclass is read from JSON, written as JSON and described as JSON Schema by itself.

An artefact is declared once. The annotation of a field says its type, unit and bounds, the docstring below the field
its meaning, or a ``description`` in the annotation where all of it fits on that line; ``__post_init__`` holds the rules
between fields. `dzdesign.core.artefact_reading` reads it and describes it.

Examples
--------
>>> from dataclasses import dataclass
>>> from typing import Annotated, ClassVar, Literal
>>> @dataclass(frozen=True, slots=True, kw_only=True)
... class Supply(Artefact):
...     "A pump as its data sheet has it."
...
...     FILE_NAME: ClassVar[str] = "supply.json"
...     schema: Literal["dzdesign.supply/1"] = "dzdesign.supply/1"
...     p_MPa: Annotated[float, quantity("MPa", ge=0, le=50)]
...     "Set pressure."
>>> to_json_bytes(Supply(tool=THIS_TOOL, made_from=(), p_MPa=21.0))[:32]
b'{\\n "schema": "dzdesign.supply/1"'
"""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from fractions import Fraction
from typing import Annotated, Any, ClassVar

from msgspec import Meta, ValidationError, to_builtins

from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError, InternalError, quoted
from dzdesign.core.version import __version__


class RuleError(InputError, ValueError):
    """A rule between the fields of one object does not hold; raised in its ``__post_init__``.

    The reader adds the file and the object's place in it; to an `InputError` that is no `RuleError`, the file alone.
    """


@contextlib.contextmanager
def own_result() -> Iterator[None]:
    """Blame dzdesign where a result that it makes itself breaks a rule: no input is at fault then."""
    try:
        yield
    except (RuleError, ValidationError) as error:
        raise InternalError(
            f"internal error of dzdesign {__version__}, which refuses its own result ({error}); the input is not to "
            "blame: please report this line, with the command and its files"
        ) from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """The program that wrote a file."""

    name: Annotated[str, Meta(description="Always dzdesign.")]
    version: Annotated[str, Meta(description="Version of the program.")]


#: A SHA-256 in hex; ``$`` alone would let a line break pass.
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceFile:
    """A file from which an artefact was made."""

    source: Annotated[str, Meta(description="File name.")]
    sha256: Annotated[Sha256, Meta(description="SHA-256 of the file's content.")]


#: What this program writes into the header of its artefacts.
THIS_TOOL = Tool(name="dzdesign", version=__version__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Artefact:
    """Header of every artefact; a subclass gives `FILE_NAME`, and `schema` as a ``Literal`` with its default."""

    FILE_NAME: ClassVar[str]
    #: What to do about a bad file; by default to run the command again that writes it.
    REMEDY: ClassVar[str] = ""
    schema: Annotated[str, Meta(description="Name and version of this schema.")]
    tool: Annotated[Tool, Meta(description="The program that wrote the file.")]
    made_from: Annotated[tuple[SourceFile, ...], Meta(description="Files from which this artefact was made.")]


class JsonText(ABC):
    """A value that stands in a file as text, such as a formula; it is written only, never read back."""

    @abstractmethod
    def json_text(self) -> str:
        """Return the text."""


def quantity(unit: str, description: str | None = None, **bounds: Any) -> Meta:
    """Return the metadata of a physical quantity, for an annotation.

    The unit is as a person writes it, such as ``L/min``; ``1`` of a ratio. The description is one sentence; a type of
    several fields leaves it to them. Bounds (``ge``, ``gt``, ``le``, ``lt``) are only of an ``int`` or a ``float``;
    those of the items of a list stand in the annotation of the item.

    Examples
    --------
    >>> quantity("MPa", "Nominal pressure drop.", ge=0, le=200).le
    200
    """
    return Meta(description=description, extra_json_schema={"unit": unit}, **bounds)


def schema_of(kind: type[Artefact]) -> str:
    """Return the name and version of the schema of an artefact.

    Examples
    --------
    >>> from dzdesign.core.artefact_types import Artefact
    >>> schema_of(Artefact)
    Traceback (most recent call last):
    TypeError: Artefact has no default of 'schema', expected a Literal with its value
    """
    default = next(field.default for field in fields(kind) if field.name == "schema")
    if default is MISSING:
        raise TypeError(f"{kind.__name__} has no default of 'schema', expected a Literal with its value")
    return str(default)


def as_document(artefact: object) -> dict[str, Any]:
    """Return a dataclass as it stands in JSON: objects and lists, keys in the order of declaration."""
    document: dict[str, Any] = to_builtins(artefact, enc_hook=_encoded)
    return document


def to_json_bytes(artefact: Artefact) -> bytes:
    """Return an artefact as the bytes of its file; the same artefact gives the same bytes.

    A number that is NaN or infinite is a ValueError; a type that no artefact has, such as a NumPy number, a TypeError.
    Of a file's name that is no UTF-8, what can't be written is a question mark.
    """
    return to_json(as_document(artefact)).encode(errors="replace")


def _encoded(value: object) -> object:
    """Write what JSON has no type for."""
    if isinstance(value, Fraction):
        return [value.numerator, value.denominator]
    if isinstance(value, JsonText):
        return value.json_text()
    if isinstance(value, Mapping):  # one that is read-only
        return dict(value)
    raise TypeError(f"an artefact holds {quoted(value)} of type {type(value).__name__}, which can't be written")
