"""Readers of `verify` for outputs: Structured Text, XML for PLC tools, MATLAB, files for amplifiers."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from target import Target

from dzdesign.codegen.amplifier.device import DEVICE_NAMES, device_named
from dzdesign.codegen.amplifier.files import amplifier_file
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.codegen.other_targets import Output, generate_output
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.compensator import Compensator
from dzdesign.design.fixed_offset import dead_zones
from dzdesign.verify.outputs.amplifier import file_checks as amplifier_checks
from dzdesign.verify.outputs.amplifier_files import READERS
from tests.support.golden_firmware import golden_compensator

TESTS = Path(__file__).parents[2] / "tests"
#: Codes that a function in MATLAB is tried with, and numbers that a function block is.
CODES = np.array([[0, 0, 0], [2048, 900, 600], [4095, 4095, 0], [65535, 1, 65535]])
NUMBERS = np.array([0, 1, -1, 5000, -(2**31), 2**31 - 1], dtype=np.int32)
REFUSALS = (RequirementError, ValueError)
BLOCK_SETTINGS = {"interface": "plc", "dialect": "twincat", "cycle_time": ""}


@cache
def compensator(folder: str = "goldens") -> Compensator:
    """Return the compensator of the goldens."""
    return golden_compensator(root=TESTS / folder)


@cache
def _made(target: str) -> Output:
    of = compensator()
    return generate_output(of, target, {"iec61131": BLOCK_SETTINGS}.get(target, {}))


def _output(target: str) -> Mapping[str, bytes]:
    return _made(target).files


def output_manifest() -> bytes:
    """Return the manifest of an output."""
    return to_json_bytes(_made("iec61131").manifest)


def _amplifier(data: bytes) -> None:
    for name in READERS:
        amplifier_checks(name, data, compensator(), _stated())


@cache
def _stated() -> dict[int, list[tuple[float, Mapping[str, float]]]]:
    """Return what is stated of the dead zones."""
    made = compensator()
    found = amplifier_setting(made, device_named("csv")).characteristics
    return {sign: [(row.dp_MPa, row.fixed) for row in dead_zones(made, drives, sign)] for sign, drives in found.items()}


def _amplifier_seeds() -> Iterator[bytes]:
    for name in DEVICE_NAMES:
        try:
            yield amplifier_file(amplifier_setting(compensator(), device_named(name)), compensator(), "0" * 64)
        except InputError:  # the device has no setting for this valve
            continue


def _read_all(faults: Iterator[str]) -> None:
    for fault in faults:
        fault.encode()


@cache
def _place(name: str) -> Path:
    return Path(tempfile.mkdtemp(prefix="dzdesign-fuzz-")) / name


def _of_output(target: str, *names: str) -> Callable[[], list[bytes]]:
    return lambda: [_output(target)[name] for name in names]


TARGETS = {
    "amplifier": Target(run=_amplifier, seeds=lambda: list(_amplifier_seeds())),
}
