"""What a target folder hands to the renderer: one flat, frozen plan of printed strings."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from types import MappingProxyType

from dzdesign.codegen.calibration.packing import Place
from dzdesign.codegen.telemetry.frame import Link
from dzdesign.core.errors import DzdesignError, InputError
from dzdesign.design.current.circuit import CurrentSampling
from dzdesign.design.signals import Signals
from dzdesign.design.target_inputs import Converter, TargetInputs


@dataclass(frozen=True, slots=True, kw_only=True)
class FlashSector:
    """A flash sector for calibration blocks: a memory range of a vendor's linker file that it places nothing in.

    `address` and `words` count words of 16 bits.
    """

    region: str
    page: int
    file: str
    address: int
    words: int

    @property
    def place(self) -> Place:
        """Where a block begins in it."""
        return Place(address=self.address, unit_octets=2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """One microcontroller and its project files.

    A plan that is not printable as it stands is a `DzdesignError`.
    """

    #: On the command line, for example ``"cortex-m4"``; the target's folder is the same with underscores.
    name: str
    #: One line for ``--list-targets``.
    description: str
    #: Compare value of 100 % duty, the core's ``DZ_COMPARE_MAX``: fits an unsigned 16-bit register.
    compare_max: int
    #: Its codes are right-justified, the largest is the core's ``DZ_ADC_CODE_MAX``; a target without one takes the
    #: F28335's, errors included.
    converter: Converter = field(default_factory=Converter)
    #: Samples and PWM periods in a second.
    sample_Hz: int = 1250
    tick_Hz: int = 2500
    #: Output path in the firmware folder to the template, in the target's ``templates/`` or in those that all share.
    templates: Mapping[str, str]
    #: The same for files that only a firmware of block form has.
    block_templates: Mapping[str, str] = field(default_factory=dict)
    #: Every value that a template prints, already a string.
    context: Mapping[str, str]
    #: Of a target without a converter and timer of its own, such as a library: it takes the scalings of any
    #: compensator, and `compare_max` and `converter` are only what `design` uses if nobody says otherwise.
    takes_any_signals: bool = False
    #: Whether it takes samples and ticks by a timer of its own, at `sample_Hz` and `tick_Hz` and no other rate.
    has_timer: bool = True
    #: When its files sample the current of a solenoid that they control; None where they do not.
    current_sampling: CurrentSampling | None = None
    #: Output paths of the files that are the user's to fill in; the rest is generated again as it is.
    board: frozenset[str] = frozenset()
    #: Where a calibration block has a flash sector of its own.
    sector: FlashSector | None = None
    #: The serial line of its telemetry, if it sends any.
    link: Link | None = None
    #: Declared of the board: its crystal, and the converter's channels in the order of `c2000.ROLES`.
    crystal_Hz: int | None = None
    channels: tuple[str, ...] = ()
    #: What makes this target on a declared board; None where a board has nothing that these files would know.
    of_board: Callable[[int | None, Sequence[str], Sequence[str]], "Target"] | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", self.name):
            raise DzdesignError(f"target name: expected words of a-z and 0-9 with hyphens, got {self.name!r}")
        for label, number in (("compare_max", self.compare_max), ("converter.code_max", self.converter.code_max)):
            if not 0 < number <= 0xFFFF:
                raise DzdesignError(f"target {self.name}: {label} must fit 16 bits unsigned, got {number}")
        for path in (*self.templates, *self.block_templates):
            parts = PurePosixPath(path)
            if parts.is_absolute() or ".." in parts.parts or "\\" in path:
                raise DzdesignError(
                    f"target {self.name}: output path must stay below the firmware folder, got {path!r}"
                )
        if strangers := sorted(self.board - self.templates.keys()):
            raise DzdesignError(f"target {self.name}: board files {strangers} have no template")
        for key, value in self.context.items():
            if not isinstance(value, str):
                raise DzdesignError(
                    f"target {self.name}: context {key!r} must be printed text, got {type(value).__name__}"
                )
        object.__setattr__(self, "templates", MappingProxyType(dict(self.templates)))
        object.__setattr__(self, "block_templates", MappingProxyType(dict(self.block_templates)))
        object.__setattr__(self, "context", MappingProxyType(dict(self.context)))

    @property
    def folder(self) -> str:
        """Name of the target's folder: an identifier, because it is a package."""
        return folder_of(self.name)

    @property
    def block_place(self) -> Place:
        """Where a calibration block lies; address 0, in octets, where it has no sector of its own."""
        return self.sector.place if self.sector else Place()

    def on_board(self, crystal_Hz: int | None, channels: Sequence[str], inputs: Sequence[str] = ()) -> "Target":
        """Return the target on a board with this crystal and these channels; without any the target as it is.

        The channels are those of `inputs`, one by one: of a design's, or as long as it is not made of all that may be.

        Raises
        ------
        InputError
            If the target's files know of no board, or can't work on this one.
        """
        if crystal_Hz is None and not channels:
            return self
        if self.of_board is None:
            given = "--crystal" if crystal_Hz else "--channels"
            raise InputError(f"{given} is of a board of TI's C2000, and target {self.name} has none; leave it out")
        try:
            return replace(self.of_board(crystal_Hz, channels, inputs), of_board=self.of_board)
        except InputError:
            raise
        except DzdesignError as error:
            raise InputError(f"--crystal: {self.name} can't be clocked by it: {error}") from error

    def inputs(self) -> TargetInputs:
        """Return the converter and timer that a compensator for this target is designed for."""
        return TargetInputs(
            name=self.name,
            converter=self.converter,
            compare_max=self.compare_max,
            sample_Hz=self.sample_Hz,
            tick_Hz=self.tick_Hz,
            current_sampling=self.current_sampling,
            crystal_Hz=self.crystal_Hz,
            channels=self.channels,
        )

    def check_current_control(self, sampling: CurrentSampling) -> None:
        """Refuse a compensator with current control where the target's files have none, or sample at other times."""
        if self.current_sampling is None:
            raise InputError(
                f"the compensator controls the current, but the files of target {self.name} do not; "
                "design it again with --drive duty, or for another target"
            )
        if sampling != self.current_sampling and not self.takes_any_signals:
            ours = self.current_sampling
            raise InputError(
                f"the compensator's current loop is for {sampling.samples} samples a PWM period, {sampling.before} of "
                f"them before the interrupt, but target {self.name} takes {ours.samples} and {ours.before}; "
                f"design it again with `dzdesign design --target {self.name}`"
            )

    def check_signals(self, signals: Signals) -> None:
        """Refuse a compensator that was designed for another converter or PWM: the first scaling that differs."""
        for what, asked, has, fixed in (
            ("largest compare value", signals.compare_max, self.compare_max, not self.takes_any_signals),
            ("largest converter code", signals.code_max, self.converter.code_max, not self.takes_any_signals),
            ("number of samples a second", signals.sample_Hz, self.sample_Hz, self.has_timer),
            ("number of PWM periods per second", signals.tick_Hz, self.tick_Hz, self.has_timer),
        ):
            if fixed and asked != has:
                raise InputError(
                    f"the compensator's {what} is {asked}, but target {self.name} has {has}; "
                    f"design it again with `dzdesign design --target {self.name}`"
                )

    def check_designed_for(self, designed_for: TargetInputs) -> str:
        """Refuse a compensator whose codes are other voltages or times here than those that it was designed for.

        Of a harmless difference it returns what a person should know; empty if there is none.
        """
        theirs, other = designed_for.converter, designed_for.name != self.name
        word = f"the compensator was designed for target {designed_for.name}; {self.name} "
        if self.takes_any_signals and other:
            word += f"takes its codes as they are: {theirs.levels} codes over {float(theirs.full_V):g} V, "
            return f"{word}{designed_for.compare_max} counts at full drive"
        ours = self.inputs()
        for what, asked, has in (
            ("a converter's range in V", theirs.full_V, ours.converter.full_V),
            ("a converter's codes", theirs.levels, ours.converter.levels),
            ("counts at full drive", designed_for.compare_max, ours.compare_max),
            ("samples a second", designed_for.sample_Hz, ours.sample_Hz),
            ("PWM periods per second", designed_for.tick_Hz, ours.tick_Hz),
        ):
            if asked != has:
                stated = (
                    f"was designed for target {designed_for.name} ({what}: {float(asked):g}), but {self.name} has"
                    if other
                    else f"says that target {self.name} has {float(asked):g} ({what}), but it has"
                )
                remedy = f"design it again with `dzdesign design --target {self.name}`"
                raise InputError(f"the compensator {stated} {float(has):g}; {remedy}")
        return f"{word}has the same converter and timer" if other else ""


def folder_of(name: str) -> str:
    """Return the folder of a target's name.

    Examples
    --------
    >>> folder_of("cortex-m4")
    'cortex_m4'
    """
    return name.replace("-", "_")
