"""modelDescription.xml of FMI 2.0 and 3.0, and the buildDescription.xml that FMI 3 has beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal
from xml.sax.saxutils import quoteattr

from dzdesign.codegen.fmu.variables import TIME, Variable, named
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.core.version import __version__

Fmi = Literal[2, 3]
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
#: Of FMI 2 and 3: what the XML calls a variable of a kind.
ELEMENTS: Mapping[Fmi, Mapping[str, str]] = {
    2: {"real": "Real", "integer": "Integer", "boolean": "Boolean"},
    3: {"real": "Float64", "integer": "Int32", "boolean": "Boolean"},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """One FMU: what it is called, and its variables."""

    #: Name of its binaries, an identifier of C.
    identifier: str
    title: str
    description: str
    #: In the order of their references; event indicators last.
    variables: tuple[Variable, ...]
    #: Names of the event indicators, which FMI 3 has as variables.
    indicators: tuple[str, ...] = ()
    #: Between two events it has memory that each step of an integrator updates.
    follows_integrator: bool = False
    step_s: float
    stop_s: float
    units: RecordedUnits = field(default_factory=RecordedUnits)

    def of(self, fmi: Fmi) -> tuple[Variable, ...]:
        """Return the variables that a version of FMI has."""
        if fmi == 3:
            return (TIME, *self.variables)
        return tuple(each for each in self.variables if each.name not in self.indicators)

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


def model_description(model: Model, fmi: Fmi, token: str) -> str:
    """Return modelDescription.xml."""
    interface = _interfaces(model, fmi)
    head = {
        "fmiVersion": f"{fmi}.0",
        "modelName": model.title,
        "guid" if fmi == 2 else "instantiationToken": token,
        "description": model.description,
        "generationTool": f"dzdesign {__version__}",
        "variableNamingConvention": "structured",
    }
    if fmi == 2:
        head["numberOfEventIndicators"] = str(len(model.indicators))
    children = [
        *interface,
        _units(model, fmi),
        _element("LogCategories", {}, [_element("Category", {"name": "logStatusError"})]),
        _element("DefaultExperiment", {"startTime": "0", "stopTime": model.stop_s, "stepSize": model.step_s}),
        _element("ModelVariables", {}, [_variable(model, each, fmi) for each in model.of(fmi)]),
        _structure(model, fmi),
    ]
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{_element("fmiModelDescription", head, children)}\n'


def _interfaces(model: Model, fmi: Fmi) -> list[str]:
    identifier = {"modelIdentifier": model.identifier}
    if fmi == 3:
        return [
            _element("ModelExchange", {**identifier, "needsCompletedIntegratorStep": model.follows_integrator}),
            _element("CoSimulation", {**identifier, "canHandleVariableCommunicationStepSize": True,
                                      "hasEventMode": True}),
        ]  # fmt: skip
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


def _units(model: Model, fmi: Fmi) -> str:
    found = []
    commands = any(each.command for each in model.of(fmi))
    for name in dict.fromkeys(each.unit for each in model.of(fmi) if each.unit):
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


def _variable(model: Model, variable: Variable, fmi: Fmi) -> str:
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
    element = ELEMENTS[fmi][variable.kind]
    if fmi == 3:
        if variable.derivative_of:
            of_kind["derivative"] = named(model.variables)[variable.derivative_of].reference
        return _element(element, {**common, **of_kind, **start})
    if variable.derivative_of:
        of_kind["derivative"] = _index(model, fmi, variable.derivative_of)
    return _element("ScalarVariable", common, [_element(element, {**of_kind, **start})])


def _index(model: Model, fmi: Fmi, name: str) -> int:
    """Return which of the variables it is, from 1 on: FMI 2 counts them."""
    return next(index for index, each in enumerate(model.of(fmi), 1) if each.name == name)


def _structure(model: Model, fmi: Fmi) -> str:
    """Return outputs, derivatives, event indicators, and what is computed at initialization, with what they follow."""
    variables = model.of(fmi)
    outputs = [each for each in variables if each.causality == "output"]
    rates = [each for each in variables if each.derivative_of]
    signs = [each for each in variables if each.name in model.indicators]
    unknown = [each for each in (*outputs, *rates) if each.nominal is None]

    def entry(tag: str, each: Variable) -> str:
        names = each.follows if each.nominal is None else (each.name,)
        if fmi == 3:
            known = named(model.variables)
            key, references = {"valueReference": each.reference}, [known[name].reference for name in names]
        else:
            key, references = {"index": _index(model, fmi, each.name)}, [_index(model, fmi, name) for name in names]
        return _element(tag, {**key, "dependencies": " ".join(map(str, sorted(references)))})

    def initial(tag: str, each: Variable) -> str:
        """Return an unknown of initialization, when parameters are known as inputs are: it may follow them all."""
        key = {"valueReference": each.reference} if fmi == 3 else {"index": _index(model, fmi, each.name)}
        return _element(tag, key)

    if fmi == 3:
        entries = [
            *(entry("Output", each) for each in outputs),
            *(entry("ContinuousStateDerivative", each) for each in rates),
            *(initial("InitialUnknown", each) for each in unknown),
            *(entry("EventIndicator", each) for each in signs),
        ]
        return _element("ModelStructure", {}, entries)
    groups = {
        "Outputs": [entry("Unknown", each) for each in outputs],
        "Derivatives": [entry("Unknown", each) for each in rates],
        "InitialUnknowns": [initial("Unknown", each) for each in unknown],
    }
    entries = [_element(tag, {}, group) for tag, group in groups.items() if group]
    return _element("ModelStructure", {}, entries)


def build_description(model: Model) -> str:
    """Return the sources/buildDescription.xml of FMI 3."""
    files = _element("SourceFileSet", {"language": "C99"}, [_element("SourceFile", {"name": SOURCE})])
    built = _element("BuildConfiguration", {"modelIdentifier": model.identifier}, [files])
    document = _element("fmiBuildDescription", {"fmiVersion": "3.0"}, [built])
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{document}\n'
