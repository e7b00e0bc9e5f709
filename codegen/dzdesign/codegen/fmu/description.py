"""What an FMU says of itself: its variables, and modelDescription.xml of FMI 2.0, from the same table as its C."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal
from xml.sax.saxutils import quoteattr

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.version import __version__

SOURCE = "dz_fmu.c"
Kind = Literal["real", "integer", "boolean"]
Causality = Literal["input", "output", "parameter"]
#: In C: who may set a variable of that causality.
SETTINGS: Mapping[str, str] = {"input": "ALWAYS", "parameter": "BEFORE_START", "output": "NEVER"}
#: Units by name: factor to SI, and the exponents of the base units.
UNITS: Mapping[str, tuple[float, Mapping[str, int]]] = {
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "MPa": (1e6, {"kg": 1, "m": -1, "s": -2}),
    "L/min": (1 / 60_000, {"m": 3, "s": -1}),
    "A": (1.0, {"A": 1}),
    "m": (1.0, {"m": 1}),
    "m/s": (1.0, {"m": 1, "s": -1}),
    "mm": (1e-3, {"m": 1}),
    "s": (1.0, {"s": 1}),
    "V/A": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -2}),
    "ohm": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -2}),
    "H": (1.0, {"kg": 1, "m": 2, "s": -2, "A": -2}),
    "kg": (1.0, {"kg": 1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "N/A": (1.0, {"kg": 1, "m": 1, "s": -2, "A": -1}),
    "N/m": (1.0, {"kg": 1, "s": -2}),
    "N s/m": (1.0, {"kg": 1, "s": -1}),
    "N/MPa": (1e-6, {"m": 2}),
    "N/(mm MPa)": (1e-3, {"m": 1}),
    "kg/m3": (1.0, {"kg": 1, "m": -3}),
    "MPa/(L/min)^2": (3.6e15, {"kg": 1, "m": -7}),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One variable of an FMU."""

    name: str
    reference: int
    description: str
    causality: Causality
    kind: Kind = "real"
    #: Of `UNITS`; empty of what has none.
    unit: str = ""
    #: None of what is computed.
    start: float | None = None
    #: Names of the inputs that an output of the same moment follows.
    follows: tuple[str, ...] = ()
    #: Least and largest value.
    range: tuple[float, float] | None = None
    #: A command as it was recorded, which has a unit and a zero of its own; any other voltage is one.
    command: bool = False

    @property
    def symbol(self) -> str:
        """Name of its value reference in C."""
        return f"V_{self.name.upper()}"

    @property
    def setting(self) -> str:
        """Who may set it, in C."""
        return SETTINGS[self.causality]

    @property
    def c_start(self) -> str:
        """Return its first value in C."""
        return repr(float(self.start or 0.0))

    @property
    def c_ends(self) -> str:
        """Return the least and the largest number that it may be set to, in C."""
        if self.kind == "real":
            return "-LARGEST_REAL, LARGEST_REAL"
        least, largest = self.range or ((-(2.0**31), 2.0**31 - 1) if self.kind == "integer" else (0.0, 1.0))
        return f"{least!r}, {largest!r}"

    @property
    def variability(self) -> str:
        """Return it as FMI names it."""
        if self.causality == "parameter":
            return "fixed"
        return "continuous" if self.kind == "real" else "discrete"


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """One FMU: what it is called, and its variables."""

    #: Name of its binaries, an identifier of C.
    identifier: str
    title: str
    description: str
    #: In the order of their references.
    variables: tuple[Variable, ...]
    #: Of its C, and what that prints.
    template: str
    values: Mapping[str, object]
    #: C files of its own, and files of its data, by name.
    core: Mapping[str, bytes] = field(default_factory=dict)
    extra: Mapping[str, bytes] = field(default_factory=dict)
    #: Offered for Model Exchange too, and not for Co-Simulation alone.
    exchange: bool = False
    step_s: float
    stop_s: float
    units: RecordedUnits = field(default_factory=RecordedUnits)


def _element(name: str, attributes: Mapping[str, object], children: Sequence[str] = ()) -> str:
    """Return an element of XML, its children indented."""
    words = [name]
    for key, value in attributes.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        words.append(f"{key}={quoteattr(text)}")
    if not children:
        return f"<{' '.join(words)}/>"
    inner = "\n".join(f"  {line}" for child in children for line in child.split("\n"))
    return f"<{' '.join(words)}>\n{inner}\n</{name}>"


def model_description(model: Model, token: str) -> str:
    """Return modelDescription.xml."""
    head = {
        "fmiVersion": "2.0",
        "modelName": model.title,
        "guid": token,
        "description": model.description,
        "generationTool": f"dzdesign {__version__}",
        "variableNamingConvention": "structured",
        "numberOfEventIndicators": 0,
    }
    children = [
        *_interfaces(model),
        _units(model),
        _element("LogCategories", {}, [_element("Category", {"name": "logStatusError"})]),
        _element("DefaultExperiment", {"startTime": "0", "stopTime": model.stop_s, "stepSize": model.step_s}),
        _element("ModelVariables", {}, [_variable(model, each) for each in model.variables]),
        _structure(model),
    ]
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{_element("fmiModelDescription", head, children)}\n'


def _interfaces(model: Model) -> list[str]:
    files = _element("SourceFiles", {}, [_element("File", {"name": SOURCE})])
    common = {"modelIdentifier": model.identifier, "canNotUseMemoryManagementFunctions": True}
    exchange = _element("ModelExchange", {**common, "completedIntegratorStepNotNeeded": True}, [files])
    stepped = _element("CoSimulation", {**common, "canHandleVariableCommunicationStepSize": True}, [files])
    return [exchange, stepped] if model.exchange else [stepped]


def _displayed(model: Model, unit: str, command: bool) -> tuple[str, float, float] | None:
    """Return name, factor and offset of the unit in which the valve was recorded, where that is another.

    That of the command is not a unit of other voltages.
    """
    if unit not in ("V", "MPa", "L/min", "A") or (unit == "V" and not command):
        return ("mm", 1e3, 0.0) if unit == "m" else None
    label = model.units.label(unit)
    if label == unit:
        return None
    units = model.units
    if unit == "V":
        return label, units.command.factor, units.command.at_zero
    return label, {"MPa": units.pressure.factor, "L/min": units.flow.factor}[unit], 0.0


def _units(model: Model) -> str:
    found = []
    commands = any(each.command for each in model.variables)
    for name in dict.fromkeys(each.unit for each in model.variables if each.unit):
        factor, exponents = UNITS[name]
        scaled = {} if factor == 1.0 else {"factor": repr(factor)}
        inner = [_element("BaseUnit", {**exponents, **scaled})]
        if displayed := _displayed(model, name, commands):
            label, per_unit, offset = displayed
            moved = {"offset": repr(offset)} if offset else {}
            inner.append(_element("DisplayUnit", {"name": label, "factor": repr(per_unit), **moved}))
        found.append(_element("Unit", {"name": name}, inner))
    return _element("UnitDefinitions", {}, found)


def _start(variable: Variable) -> dict[str, object]:
    if variable.start is None:
        return {}
    if variable.kind == "boolean":
        return {"start": bool(variable.start)}
    return {"start": int(variable.start) if variable.kind == "integer" else repr(variable.start)}


def _variable(model: Model, variable: Variable) -> str:
    common: dict[str, object] = {
        "name": variable.name,
        "valueReference": variable.reference,
        "causality": variable.causality,
        "variability": variable.variability,
        "description": variable.description,
    }
    of_kind: dict[str, object] = {}
    if variable.unit:
        of_kind["unit"] = variable.unit
        if displayed := _displayed(model, variable.unit, variable.command):
            of_kind["displayUnit"] = displayed[0]
    if variable.range is not None:
        of_kind |= dict(zip(("min", "max"), map(int, variable.range), strict=True))
    return _element("ScalarVariable", common, [_element(variable.kind.capitalize(), {**of_kind, **_start(variable)})])


def _structure(model: Model) -> str:
    """Return the outputs with the inputs that they follow, and which are computed at initialization: all."""
    places = {each.name: index for index, each in enumerate(model.variables, 1)}
    outputs = [each for each in model.variables if each.causality == "output"]
    follows = {each.name: " ".join(map(str, sorted(places[name] for name in each.follows))) for each in outputs}
    entries = [_element("Unknown", {"index": places[name], "dependencies": text}) for name, text in follows.items()]
    # At initialization parameters are known as inputs are: an output may follow them all.
    unknown = [_element("Unknown", {"index": places[name]}) for name in follows]
    return _element("ModelStructure", {}, [_element("Outputs", {}, entries), _element("InitialUnknowns", {}, unknown)])
