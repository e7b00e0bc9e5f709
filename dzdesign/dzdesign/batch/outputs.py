"""Outputs of a lot's valves beside the C firmware: which are wanted, and one made and verified for a valve."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.batch.arguments import BatchArguments
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import DzdesignError, InputError, nearest
from dzdesign.core.options import flag_of
from dzdesign.report.lot.summary import DOES_NOT_HOLD, HOLDS, NOT_MADE, NOT_VERIFIED, OutputVerdict, ValveOutput
from dzdesign.stages.generate import chosen_of_outputs

if TYPE_CHECKING:
    from dzdesign.design.compensator import Compensator
    from dzdesign.identify.valve.model import ValveModel

#: Behind the name of an output's folder: that of its evidence.
OF_EVIDENCE = "_evidence"


@dataclass(frozen=True, slots=True, kw_only=True)
class WantedOutput:
    """An output that each valve is to have: target, its settings as a manifest has them, and folder."""

    target: str
    settings: Mapping[str, str]
    folder: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ForOutputs:
    """What the outputs of one valve are made and checked of; `place` is the folder of the valve."""

    compensator: "Compensator"
    valve: "ValveModel"
    recordings: Sequence[Path]
    place: Path
    verify: bool


def wanted_outputs(args: BatchArguments) -> tuple[WantedOutput, ...]:
    """Return the outputs that ``--outputs`` names, in its order.

    An unknown target, one that is named twice, and an option of an output that is not wanted are an `InputError`.
    """
    from dzdesign.codegen.other_targets import OTHER_TARGETS, folder_of, settings_of

    names = _names(args.outputs)
    of_outputs = dict.fromkeys(option for each in OTHER_TARGETS.values() for option in each.options)
    for option in (name for name in of_outputs if getattr(args, name) is not None):
        owners = [each.name for each in OTHER_TARGETS.values() if option in each.options]
        if not set(owners) & set(names) and not (option == "plant" and args.verify):
            raise InputError(f"{flag_of(option)} needs the output {' or '.join(owners)}; add --outputs {owners[0]}"
                             f"{' or --verify' if option == 'plant' else ''}, or leave it out")  # fmt: skip
    given = chosen_of_outputs(args)  # which reads files
    return tuple(
        WantedOutput(
            target=name,
            settings=settings_of(name, {option: given[option] for option in OTHER_TARGETS[name].options}, "--outputs"),
            folder=folder_of(name),
        )
        for name in names
    )


def _names(text: str | None) -> list[str]:
    from dzdesign.codegen.other_targets import OTHER_TARGETS
    from dzdesign.codegen.project import TARGET_NAMES

    names = [] if text is None else [name.strip() for name in text.split(",")]
    for name in names:
        if name in TARGET_NAMES:
            raise InputError(f"--outputs: '{name}' is a microcontroller; give it with --target")
        if name not in OTHER_TARGETS:
            raise InputError(f"--outputs: there is no output '{name[:40]}'{nearest(name, OTHER_TARGETS)}; expected "
                             f"{', '.join(OTHER_TARGETS)}, with commas between them")  # fmt: skip
        if names.count(name) > 1:
            raise InputError(f"--outputs names {name} twice; name it once")
    return names


def make_output(wanted: WantedOutput, of: ForOutputs) -> ValveOutput:
    """Write an output of a valve into its folder, and verify it if asked for; return what came of it.

    No failure is an exception: its reason stands in the result.
    """
    from dzdesign.codegen.other_targets import generate_output

    verdict: OutputVerdict = NOT_MADE
    try:
        output = generate_output(of.compensator, wanted.target, wanted.settings)
        write_folder(of.place / wanted.folder, output.contents, output.manifest)
        verdict = NOT_VERIFIED
        return _verified(wanted, of) if of.verify else _found(wanted, verdict)
    except DzdesignError as error:
        return _found(wanted, verdict, str(error))
    except Exception as error:  # as of a firmware: a fault of ours must not stop the batch
        return _found(wanted, verdict, f"unexpected {type(error).__name__}: {error}")


def may_end_otherwise(output: ValveOutput) -> bool:
    """Tell whether the next run should try an output again: a tool may be there then that was not, or room."""
    return bool(output.reason) and output.verdict in (NOT_MADE, NOT_VERIFIED)


def _verified(wanted: WantedOutput, of: ForOutputs) -> ValveOutput:
    from dzdesign.stages.verify import VerifyArguments, verify_output_folder

    folder = of.place / wanted.folder
    arguments = VerifyArguments(folder, ramps=of.recordings, output=of.place / (wanted.folder + OF_EVIDENCE))
    evidence = verify_output_folder(folder, arguments, of.valve).evidence
    inputs = sum(tried.inputs for tried in evidence.inputs)
    missed = [check for check in evidence.checks if not check.holds]
    if not missed:
        return _found(wanted, HOLDS, inputs=inputs)
    first = min(missed, key=lambda check: check.holds is None)  # what does not hold, before what was not checked
    verdict: OutputVerdict = NOT_VERIFIED if first.holds is None else DOES_NOT_HOLD
    return _found(wanted, verdict, f"{first.name}: {first.text}", inputs)


def _found(wanted: WantedOutput, verdict: OutputVerdict, reason: str = "", inputs: int = 0) -> ValveOutput:
    return ValveOutput(
        target=wanted.target, folder=wanted.folder, verdict=verdict, reason=" ".join(reason.split()), inputs=inputs
    )


def reason_of_outputs(outputs: Sequence[ValveOutput]) -> str:
    """Return the reasons of the outputs that are not as they were wanted, each after its output's name."""
    return "; ".join(f"output {each.target}: {each.reason}" for each in outputs if each.reason)
