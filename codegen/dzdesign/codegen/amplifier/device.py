"""`Device`: what a device file states of an amplifier, and the list of those files."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import msgspec

from dzdesign.core.errors import DzdesignError, InputError, nearest, quoted

FOLDER = Path(__file__).parent / "devices"
#: What ``--to`` takes: the names of the files.
DEVICE_NAMES: tuple[str, ...] = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))

Format = Literal["commands", "dcf", "parameters", "structured text", "csv"]
#: jump: no drive up to a threshold, then from an offset straight to full. added: the offset on top of every command.
#: table: points of the whole characteristic.
Law = Literal["jump", "added", "table"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of a device: how it is called for each sign of command, and its range in the device's unit."""

    positive: str
    #: Empty where one value is for both signs, or there is one solenoid.
    negative: str = ""
    least: int
    most: int

    def name(self, sign: int) -> str:
        """Return how it is called for a sign of command."""
        return self.positive if sign > 0 else self.negative or self.positive


@dataclass(frozen=True, slots=True, kw_only=True)
class DictionaryObject:
    """An object of a CANopen device's dictionary."""

    #: That of the parameter whose value it holds, or of one with a value of its own.
    name: str
    index: int
    #: None of an object that is a variable by itself.
    sub_index: int | None = None
    #: Its number in CiA 301.
    data_type: int
    #: Where no parameter has its name; else 0 where the design sets none.
    value: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """An amplifier or controller that can be told to compensate a dead zone."""

    #: On the command line, after ``--to``.
    name: str
    title: str
    description: str
    #: Document and section of everything here.
    sources: tuple[str, ...]
    #: What they leave open.
    unconfirmed: str = ""
    #: What else is to be done on the device.
    hint: str = ""
    #: What to take where its range is too small.
    instead: str = ""
    format: Format
    law: Law
    ending: str
    #: Of all its parameters: counts of one unit.
    unit: str
    counts_of_full: int
    #: Unit in which a count is written in its file, where that is another: V for mV.
    written_in: Literal["", "V"] = ""
    #: Of a table none of these.
    offset: Parameter | None = None
    full: Parameter | None = None
    threshold: Parameter | None = None
    #: Of a CANopen device.
    objects: tuple[DictionaryObject, ...] = ()

    @property
    def takes_both_signs(self) -> bool:
        """Whether it drives two solenoids."""
        return self.law != "jump" or self.offset is None or bool(self.offset.negative)

    @property
    def jumps_to(self) -> Parameter:
        """The parameter of the offset, which all devices but those with a table have."""
        if self.offset is None:
            raise DzdesignError(f"the file of device '{self.name}' states no offset, expected a table [offset]")
        return self.offset

    def in_unit(self, counts: int) -> str:
        """Return counts with their unit, volts for a device that counts in millivolts."""
        return f"{counts / 1000:g} V" if self.unit == "mV" else f"{100 * counts / self.counts_of_full:.2f} %"


@cache
def device_named(name: str | None) -> Device:
    """Return a device by its name; an unknown one, or none, is an `InputError` that lists those there are."""
    if name not in DEVICE_NAMES:
        known = f"known: {', '.join(DEVICE_NAMES)}"
        if name is None:
            raise InputError(f"--to is missing, expected the device whose parameters are wanted; {known}")
        raise InputError(f"--to is {quoted(name)}{nearest(name, DEVICE_NAMES)}; {known}")
    stated = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    return msgspec.convert({"name": name, **stated}, Device)
