"""What a target folder hands to the renderer: one flat, frozen plan of printed strings."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from types import MappingProxyType

from dzdesign.codegen.telemetry import Link
from dzdesign.core.errors import DzdesignError

RENDERER_NAMES = frozenset({"banner", "project", "u_max_V", "pressure_span_MPa", "firmware_origin"})
"""Names that the renderer itself passes to every template; a target's context may not use them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """One microcontroller and its project files.

    Parameters
    ----------
    name
        Name on the command line and of the folder, for example ``"f28335"``.
    description
        One line for ``--list-targets``.
    compare_max
        Compare value of 100 % duty; the core's ``DZ_COMPARE_MAX``. Fits an unsigned 16-bit register.
    adc_code_max
        Largest code of the converter, right-justified; the core's ``DZ_ADC_CODE_MAX``.
    templates
        Output path, relative to the firmware folder, to the template's file name in ``templates/``.
    context
        Every value that a template prints, already a string.
    link
        The serial line of its telemetry, or None if it sends none.

    Raises
    ------
    DzdesignError
        If the plan is not printable as it stands.
    """

    name: str
    description: str
    compare_max: int
    adc_code_max: int
    templates: Mapping[str, str]
    context: Mapping[str, str]
    link: Link | None = None

    def __post_init__(self) -> None:
        if not self.name.isidentifier():
            raise DzdesignError(f"target name: expected an identifier, got {self.name!r}")
        for label, value in (("compare_max", self.compare_max), ("adc_code_max", self.adc_code_max)):
            if not 0 < value <= 0xFFFF:
                raise DzdesignError(f"target {self.name}: {label} must fit 16 bits unsigned, got {value}")
        for path in self.templates:
            parts = PurePosixPath(path)
            if parts.is_absolute() or ".." in parts.parts or "\\" in path:
                raise DzdesignError(
                    f"target {self.name}: output path must stay below the firmware folder, got {path!r}"
                )
        for key, value in self.context.items():
            if not isinstance(value, str):
                raise DzdesignError(
                    f"target {self.name}: context {key!r} must be printed text, got {type(value).__name__}"
                )
        if taken := sorted(RENDERER_NAMES & self.context.keys()):
            raise DzdesignError(f"target {self.name}: context names {taken} belong to the renderer")
        object.__setattr__(self, "templates", MappingProxyType(dict(self.templates)))
        object.__setattr__(self, "context", MappingProxyType(dict(self.context)))
