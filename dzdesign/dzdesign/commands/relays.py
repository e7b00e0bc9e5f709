"""The commands that hand their arguments to one stage and print its result, one row each in `RELAYS`.

What a stage needs is imported when its command is asked for: the help of one imports no other.
"""

import os
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from dzdesign.core.errors import RequirementError, one_line
from dzdesign.terminal.page import print_json


class Relay:
    """A command: where its arguments and its stage are, lines for the help, and how the result is shown and judged."""

    def __init__(
        self,
        arguments: str,
        stage: str,
        examples: tuple[str, ...],
        show: Callable[[Any, Any], None],
        *,
        holds: Callable[[Any, Any], bool] = lambda result, arguments: True,
        document: Callable[[Any, Any], Any] = lambda result, arguments: result,
        one_valve: tuple[str, ...] = (),
    ) -> None:
        self._arguments, self._stage, self._show, self._holds, self._document = arguments, stage, show, holds, document
        self.EXAMPLES = examples
        #: Options of `identify` that the command does not take: without them a valve would be another one.
        self.ONE_VALVE = one_valve

    @cached_property
    def Arguments(self) -> Any:
        """The class of the command's arguments."""
        return resolve_name(f"dzdesign.{self._arguments}")

    def run(self, arguments: Any, json: bool) -> int:
        """Run the stage and print its result; 1 if that does not hold."""
        result = resolve_name(f"dzdesign.{self._stage}")(arguments)
        if json:
            print_json(self._document(result, arguments))
        else:
            self._show(result, arguments)
        return 0 if self._holds(result, arguments) else 1


def _written(arguments: Any) -> None:
    plots = f", plots in {arguments.plots}" if getattr(arguments, "plots", None) else ""
    print(one_line(f"Written: {arguments.output}{plots}"))


def _show_valve(valve: Any, arguments: Any) -> None:
    from dzdesign.terminal.tables import print_valve

    print_valve(valve)
    _written(arguments)
    if len(valve.sides) == 2:
        print("Next, for commands of both signs; state the signal at your converter (and --config, if you use it):")
        print(one_line(f'  dzdesign design {arguments.output} --command-signal "-10..10 V x 0.12 + 1.5 V"'))


def _show_compensator(compensator: Any, arguments: Any) -> None:
    from dzdesign.design.redesign import hysteresis_choices
    from dzdesign.terminal.choices_table import print_choices
    from dzdesign.terminal.tables import print_compensator

    print_compensator(compensator)
    read_at = compensator.valve.recorded_units.text(compensator.reading_flow_L_min, ".2f L/min")
    print_choices(hysteresis_choices(compensator), read_at, dithered=compensator.valve.dither is not None)
    _written(arguments)


def _show_verification(verification: Any, arguments: Any) -> None:
    from dzdesign.report.valve_report import REPORT_NAME
    from dzdesign.terminal.verification_tables import print_output_verification, print_verification
    from dzdesign.verify.evidence import OutputEvidence
    from dzdesign.verify.verification import Verification

    output, to_read = Path(arguments.output or ""), REPORT_NAME
    if isinstance(verification, Verification):
        print_verification(verification)
    else:
        print_output_verification(verification)
        to_read = OutputEvidence.FILE_NAME
    print(one_line(f"Evidence written to {output}; start with {output / to_read}"))


def _show_assessment(found: Any, arguments: Any) -> None:
    from dzdesign.terminal.assessment_tables import print_assessment

    print_assessment(found)
    _written(arguments)


def _show_simulated(made: Any, arguments: Any) -> None:
    tests = "test" if len(made.files) == 1 else "tests"
    print(one_line(f"Written: {len(made.files)} simulated ramp {tests} in folder '{arguments.output}'"))


def _show_lot(summary: Any, arguments: Any) -> None:
    from dzdesign.batch.printing import print_lot

    print_lot(summary, Path(arguments.output))


def _document_of_lot(summary: Any, arguments: Any) -> dict[str, Any]:
    from dzdesign.core.artefact_types import as_document
    from dzdesign.report.valve_report import REPORT_NAME

    return {**as_document(summary), "report": os.fspath(Path(arguments.output) / REPORT_NAME)}


def _holds(result: Any, arguments: Any) -> bool:
    return bool(result.holds)


def _whole_lot(summary: Any, arguments: Any) -> bool:
    """Return True; raise if any valve could not be calibrated."""
    if summary.failed:
        raise RequirementError(
            f"{len(summary.failed)} of {summary.valves} valves are not calibrated; their reasons are in "
            f"'{Path(arguments.output) / 'valves.csv'}'"
        )
    return True


def _show_reproduction(made: Any, arguments: Any) -> None:
    from dzdesign.terminal.reproduction_tables import print_reproduction

    print_reproduction(made)
    print(f"Figures, parameters and artefacts: {arguments.output}")


RELAYS: Mapping[str, Relay] = {
    "identify": Relay(
        "stages.identify:IdentifyArguments", "stages.identify:identify",
        (
            'dzdesign identify ramps/*.csv --meter-lag "0.1 s"',
            "dzdesign identify ramps/*.csv --config dzdesign.toml --plots plots",
            'dzdesign identify ramp.csv --dp "1 MPa" --columns "u=AO0:V, Q=Flow (L/min)"',
        ),
        _show_valve,
    ),
    "design": Relay(
        "stages.design:DesignArguments", "stages.design:design",
        ("dzdesign design valve.json", "dzdesign design valve.json --hysteresis play --target cortex-m4"),
        _show_compensator,
    ),
    "verify": Relay(
        "stages.verify:VerifyArguments", "stages.verify:verify",
        (
            "dzdesign verify firmware",
            "dzdesign verify plc -o plc_evidence",
            'dzdesign verify calibrated/lot/firmware --blocks "calibrated/valves/*/calibration.bin"',
            "dzdesign verify firmware --machine-code",
        ),
        _show_verification, holds=_holds, document=lambda made, arguments: made.evidence,
    ),
    "assess": Relay(
        "stages.assess:AssessArguments", "stages.assess:assess",
        (
            'dzdesign assess before/*.csv --after after/*.csv --limits "dead_zone_opening = 5 %"',
            "dzdesign assess before/*.csv --after after/*.csv --config dzdesign.toml --plots plots",
        ),
        _show_assessment, holds=_holds,
    ),
    "simulate": Relay(
        "stages.simulate:SimulateArguments", "stages.simulate:simulate",
        (
            'dzdesign simulate --dp "1 MPa" --dp "5 MPa" -o ramps',
            "dzdesign simulate --firmware firmware -o after",
        ),
        _show_simulated, document=lambda made, arguments: made.manifest,
    ),
    "batch": Relay(
        "batch.arguments:BatchArguments", "stages.batch:batch",
        (
            'dzdesign batch lot -o calibrated --jobs 4 --meter-lag "0.1 s"',
            'dzdesign batch lot -o calibrated --meter-lag "0.1 s" --calibration block',
            "dzdesign batch lot.csv -o calibrated --verify --dask tcp://10.0.0.5:8786",
        ),
        _show_lot, holds=_whole_lot, document=_document_of_lot, one_valve=("low_flow",),
    ),
    "reproduce": Relay(
        "stages.reproduce:ReproduceArguments", "stages.reproduce:reproduce",
        ("dzdesign reproduce -o reproduction",), _show_reproduction, holds=_holds,
    ),
}  # fmt: skip
