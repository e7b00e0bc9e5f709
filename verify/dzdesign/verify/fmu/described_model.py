"""modelDescription.xml against the compensator and the plant's parameters: variables, units, interfaces, dependencies.

Units are taken apart by pint; whatever else stands there than must is a fault.
"""

import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

from dzdesign.design.compensator import Compensator
from dzdesign.verify.fmu.expected_variables import Expected, of_compensator, of_plant
from dzdesign.verify.fmu.fmu_file import DESCRIPTION, DescribedVariable, FmuFile

if TYPE_CHECKING:
    from pint import UnitRegistry

#: Base units of pint as FMI names them.
BASE = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A"}
#: What is text for people.
FOR_PEOPLE = {"modelName", "description", "generationTool"}
CHILDREN = ("ModelExchange", "CoSimulation", "UnitDefinitions", "LogCategories", "DefaultExperiment", "ModelVariables",
            "ModelStructure")  # fmt: skip
CLOSE = 1e-12


def compensator_faults(fmu: FmuFile, compensator: Compensator) -> Iterator[str]:
    """Yield what the description of a compensator's FMU says otherwise than compensator.json."""
    yield from _faults(fmu, of_compensator(compensator), compensator, indicators=0)


def plant_faults(fmu: FmuFile, plant: Mapping[str, float], compensator: Compensator) -> Iterator[str]:
    """Yield what the description of a plant's FMU says otherwise than the plant's parameters."""
    yield from _faults(fmu, of_plant(plant), compensator, indicators=3)


def _faults(
    fmu: FmuFile, expected: dict[str, Expected], compensator: Compensator, indicators: int
) -> Iterator[str]:
    for name in sorted(expected.keys() ^ fmu.variables.keys()):
        yield f"{DESCRIPTION}: variable {name} is {'missing' if name in expected else 'too many'}"
    if expected.keys() != fmu.variables.keys():
        return
    if len({each.reference for each in fmu.variables.values()}) < len(fmu.variables):
        yield f"{DESCRIPTION}: two variables have one reference"
    for name, each in expected.items():
        yield from _variable_faults(fmu, name, each, compensator)
    yield from _unit_faults(fmu, expected, compensator)
    yield from _frame_faults(fmu, compensator, indicators)
    yield from _structure_faults(fmu, expected)


def _variable_faults(fmu: FmuFile, name: str, expected: Expected, compensator: Compensator) -> Iterator[str]:
    found = fmu.variables[name]
    others = {"variability": expected.variability, **(expected.others or {})}
    if shown := _shown(compensator, expected):
        others["displayUnit"] = shown[0]
    if state := expected.derivative_of:
        others["derivative"] = str(_key(fmu, state))
    for what, is_there, must_be in (
        ("kind", found.kind, expected.kind),
        ("causality", found.causality, expected.causality),
        ("unit", found.unit or "", expected.unit),
        ("start", _start(found), expected.start),
        *((key, found.others.get(key), others.get(key)) for key in sorted({*others, *found.others})),
    ):
        if is_there != must_be:
            yield f"{DESCRIPTION}: {name} has {what} {is_there}, expected {must_be}"


def _start(variable: DescribedVariable) -> float | str | None:
    text = variable.start
    if text is None or variable.kind == "boolean":
        return None if text is None else {"false": 0.0, "true": 1.0}.get(text, text)
    number = _number(text)
    return text if math.isnan(number) else number


def _number(text: str) -> float:
    """Return a number; of a text that is none NaN, which is equal to no expected number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _key(fmu: FmuFile, name: str) -> int:
    """Return by what the description refers to a variable: it counts them."""
    return 1 + list(fmu.variables).index(name)


def _shown(compensator: Compensator, expected: Expected) -> tuple[str, tuple[float, float]] | None:
    """Return name, factor and offset of the unit that the recordings have of a variable; None where it is the same.

    A command's unit is that of its side: one with a zero of its own falls on the negative one, and is none there.
    """
    units = compensator.valve.recorded_units
    if expected.unit == "m":
        return "mm", (1e3, 0.0)
    if expected.unit == "V" and expected.command and (expected.command > 0 or units.command.at_zero == 0):
        name, scaled = units.command.unit, (units.command.factor, units.command.at_zero)
    elif expected.unit == "A" and units.current:
        name, scaled = units.current.unit, (units.current.factor, 0.0)
    elif expected.unit in ("MPa", "L/min"):
        of_kind = units.pressure if expected.unit == "MPa" else units.flow
        name, scaled = of_kind.unit, (of_kind.factor, 0.0)
    else:
        return None
    return None if name == expected.unit else (name, scaled)


@cache
def _registry() -> "UnitRegistry":
    from pint import UnitRegistry

    return UnitRegistry()


@cache
def _of_base_units(unit: str) -> tuple[float, dict[str, float]]:
    """Return factor and exponents of a unit."""
    text = unit.replace("s2", "s**2").replace("m3", "m**3").replace("^", "**").replace(" ", "*")
    whole = _registry()(f"1.0 * {text}").to_base_units()
    return whole.magnitude, {BASE[name]: float(power) for name, power in whole.unit_items()}


def _unit_faults(fmu: FmuFile, expected: Mapping[str, Expected], compensator: Compensator) -> Iterator[str]:
    used = {each.unit for each in expected.values() if each.unit}
    for name in sorted(used ^ fmu.units.keys()):
        yield f"{DESCRIPTION}: the unit {name} is {'missing' if name in used else 'too many'}"
    for name in sorted(used & fmu.units.keys()):
        unit, (factor, exponents) = fmu.units[name], _of_base_units(name)
        if abs(unit.factor / factor - 1) > CLOSE or unit.offset or dict(unit.exponents) != exponents:
            yield f"{DESCRIPTION}: the unit {name} has factor {unit.factor}, expected {factor:.6g}, or other base units"
        shown = [_shown(compensator, each) for each in expected.values() if each.unit == name]
        if dict(unit.displayed) != dict(each for each in shown if each):
            yield f"{DESCRIPTION}: the unit {name} is displayed by other units or factors than those of the recordings"


def _frame_faults(fmu: FmuFile, compensator: Compensator, indicators: int) -> Iterator[str]:
    """Yield what stands otherwise around the variables: versions, capabilities, default step."""
    document, step_s = fmu.document, 1 / compensator.signals.tick_Hz
    head = {"fmiVersion": "2.0", "variableNamingConvention": "structured", "guid": fmu.token}
    head["numberOfEventIndicators"] = str(indicators)
    if {key: value for key, value in document.attrib.items() if key not in FOR_PEOPLE} != head:
        yield f"{DESCRIPTION}: its own attributes are {', '.join(sorted(document.attrib))}, or have other values"
    if tuple(each.tag for each in document) != CHILDREN:
        yield f"{DESCRIPTION}: its elements are {', '.join(each.tag for each in document)}"
        return
    can = {"modelIdentifier": fmu.identifier, "canNotUseMemoryManagementFunctions": "true"}
    still = {"completedIntegratorStepNotNeeded": str(not indicators).lower()}
    offered = {**can, **still}, {**can, "canHandleVariableCommunicationStepSize": "true"}
    for element, attributes in zip(document, offered, strict=False):
        sources = [each.attrib for each in element.iterfind("SourceFiles/File")]
        if element.attrib != attributes or sources != [{"name": "dz_fmu.c"}]:
            yield f"{DESCRIPTION}: {element.tag} has attributes {element.attrib}, expected {attributes}"
    times = {key: _number(value) for key, value in document[4].attrib.items()}
    if not times.pop("stopTime", 0.0) > 0 or times != {"startTime": 0.0, "stepSize": step_s}:
        yield f"{DESCRIPTION}: DefaultExperiment is {times}, expected steps of {step_s:g} s from 0 on"


def _structure_faults(fmu: FmuFile, expected: Mapping[str, Expected]) -> Iterator[str]:
    """Yield outputs, derivatives and unknowns that follow others than they must."""
    outputs = {name: each.follows for name, each in expected.items() if each.causality == "output"}
    rates = {name: each.follows for name, each in expected.items() if each.derivative_of}
    unknown = {name: None for name in (*outputs, *rates) if expected[name].start is None}
    must: dict[str, Mapping[str, frozenset[str] | None]] = {"Output": outputs, "Derivative": rates, "Initial": unknown}
    found: dict[str, dict[str, frozenset[str] | None]] = {name: {} for name in must}
    tags = {"Outputs": "Output", "Derivatives": "Derivative", "InitialUnknowns": "Initial"}
    names = {str(_key(fmu, name)): name for name in fmu.variables}
    for element in fmu.document[-1]:
        for entry in element:
            follows = entry.get("dependencies")
            name = names.get(entry.get("index", ""), "")
            group = found.get(tags.get(element.tag, ""), {})
            repeated = name in group
            group[name] = None if follows is None else frozenset(names.get(key, "") for key in follows.split())
            if repeated or set(entry.attrib) - {"index", "dependencies"}:
                yield f"{DESCRIPTION}: ModelStructure has {name} twice, or with other attributes"
        if element.tag not in tags:
            yield f"{DESCRIPTION}: ModelStructure has {element.tag}"
    for group_name, variables in must.items():
        for name in sorted(variables.keys() | found[group_name].keys()):
            if name not in variables or found[group_name].get(name, frozenset({""})) != variables[name]:
                yield f"{DESCRIPTION}: ModelStructure has {name} as {group_name} with other dependencies"
