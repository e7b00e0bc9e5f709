"""modelDescription.xml of FMI 2.0."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

from dzdesign.codegen.fmu.variables import Variable
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.version import __version__

SOURCE = "dz_fmu.c"
#: Units by name: factor to SI, and the exponents of the base units.
UNITS: Mapping[str, tuple[float, Mapping[str, int]]] = {
    "s": (1.0, {"s": 1}),
    "V": (1.0, {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "MPa": (1e6, {"kg": 1, "m": -1, "s": -2}),
    "L/min": (1 / 60_000, {"m": 3, "s": -1}),
    "A": (1.0, {"A": 1}),
    "A/s": (1.0, {"A": 1, "s": -1}),
    "m": (1.0, {"m": 1}),
    "m/s": (1.0, {"m": 1, "s": -1}),
    "m/s2": (1.0, {"m": 1, "s": -2}),
    "mm": (1e-3, {"m": 1}),
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
class Model:
    """One FMU: what it is called, and its variables."""

    #: Name of its binaries, an identifier of C.
    identifier: str
    title: str
    description: str
    #: In the order of their references.
    variables: tuple[Variable, ...]
    #: Number of event indicators.
    indicators: int = 0
    #: Between two events it has memory that each step of an integrator updates.
    follows_integrator: bool = False
    step_s: float
    stop_s: float
    units: RecordedUnits = field(default_factory=RecordedUnits)

    @property
    def states(self) -> tuple[Variable, ...]:
        """The continuous states."""
        return tuple(each for each in self.variables if each.nominal is not None)


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
        "numberOfEventIndicators": model.indicators,
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
    identifier = {"modelIdentifier": model.identifier}
    files = _element("SourceFiles", {}, [_element("File", {"name": SOURCE})])
    static = {"canNotUseMemoryManagementFunctions": True}
    return [
        _element("ModelExchange", {**identifier, "completedIntegratorStepNotNeeded": not model.follows_integrator,
                                   **static}, [files]),
        _element("CoSimulation", {**identifier, "canHandleVariableCommunicationStepSize": True, **static}, [files]),
    ]  # fmt: skip


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
    current = units.current.factor if units.current else 1.0
    return label, {"MPa": units.pressure.factor, "L/min": units.flow.factor, "A": current}[unit], 0.0


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
    start = _start(variable)
    common: dict[str, object] = {
        "name": variable.name,
        "valueReference": variable.reference,
        "causality": variable.causality,
        "variability": variable.variability,
        "description": variable.description,
    }
    if variable.nominal is not None:
        common["initial"] = "exact"
    of_kind: dict[str, object] = {}
    if variable.unit:
        of_kind["unit"] = variable.unit
        if displayed := _displayed(model, variable.unit, variable.command):
            of_kind["displayUnit"] = displayed[0]
    if variable.range is not None:
        of_kind |= dict(zip(("min", "max"), map(int, variable.range), strict=True))
    if variable.nominal is not None:
        of_kind["nominal"] = repr(variable.nominal)
    if variable.derivative_of:
        of_kind["derivative"] = _index(model, variable.derivative_of)
    return _element("ScalarVariable", common, [_element(variable.kind.capitalize(), {**of_kind, **start})])


def _index(model: Model, name: str) -> int:
    """Return which of the variables it is, from 1 on."""
    return next(index for index, each in enumerate(model.variables, 1) if each.name == name)


def _structure(model: Model) -> str:
    """Return outputs, derivatives, and what is computed at initialization, with what they follow."""
    outputs = [each for each in model.variables if each.causality == "output"]
    rates = [each for each in model.variables if each.derivative_of]
    unknown = [each for each in (*outputs, *rates) if each.nominal is None]

    def entry(each: Variable) -> str:
        names = each.follows if each.nominal is None else (each.name,)
        follows = " ".join(map(str, sorted(_index(model, name) for name in names)))
        return _element("Unknown", {"index": _index(model, each.name), "dependencies": follows})

    groups = {
        "Outputs": [entry(each) for each in outputs],
        "Derivatives": [entry(each) for each in rates],
        # At initialization parameters are known as inputs are: it may follow them all.
        "InitialUnknowns": [_element("Unknown", {"index": _index(model, each.name)}) for each in unknown],
    }
    entries = [_element(tag, {}, group) for tag, group in groups.items() if group]
    return _element("ModelStructure", {}, entries)
