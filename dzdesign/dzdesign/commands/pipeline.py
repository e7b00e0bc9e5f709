"""The commands: read, call one room, write the artefact whole, print what a person wants to know."""

import argparse
import re
from pathlib import Path
from typing import Any

from dzdesign.command_line.identify_options import identify_options, record_of
from dzdesign.core.artefact_files import (
    TOOL,
    check_file_may_be_written,
    check_folder_may_be_written,
    parse_document,
    read_bytes,
    sha256_of,
    to_json,
    write_file,
    write_files,
    write_folder,
)
from dzdesign.core.artefact_types import as_document, schema_of
from dzdesign.core.errors import InputError, one_line
from dzdesign.core.units import parse_quantity
from dzdesign.recordings import check_plots, read_recordings, refuse_copies
from dzdesign.regeneration import with_regenerated
from dzdesign.terminal.progress import say, stages, with_bar


def _seed(text: str) -> int:
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise InputError(f"--seed is '{text}', expected a whole number of zero or more, such as 1")
    return int(text)


def run_identify(args: argparse.Namespace) -> int:
    """Identify a valve from ramp tests."""
    from dzdesign.identify.identification import identify_sides
    from dzdesign.identify.valve.model import SCHEMA
    from dzdesign.terminal.tables import print_valve

    options, record = identify_options(args), record_of(args.record)
    check_file_may_be_written(Path(args.output), SCHEMA)
    check_plots(args.plots, Path(args.output))
    tests = read_recordings(
        args.ramps, u_max=options.u_max, columns=args.columns, dp=args.dp, skip_rows=args.skip_rows
    )
    refuse_copies(tests)
    with stages() as stage:
        stage(f"fitting {len(tests)} recording{'s' if len(tests) > 1 else ''}")
        found = identify_sides(tests, options, record)
    document = found.model.to_document()
    write_file(Path(args.output), to_json(document), SCHEMA)
    if args.plots:
        from dzdesign.identify.plots.valve_plots import plot_files

        with stages() as stage:
            stage("drawing")
            drawn = plot_files(found)
        write_files(Path(args.plots), drawn, "--plots")
    if args.json:
        print(to_json(document), end="")
    else:
        print_valve(found.model)
        print(one_line(f"Written: {args.output}" + (f", plots in {args.plots}" if args.plots else "")))
    return 0


def _design(valve_path: Path, content: bytes, args: argparse.Namespace) -> "Compensator":  # noqa: F821
    from dzdesign.codegen.project import target_named
    from dzdesign.command_line.design_options import design_options
    from dzdesign.design.designing import design
    from dzdesign.identify.valve.valve_file import valve_from_document

    options = design_options(args, target_named(args.target).inputs())
    return design(valve_from_document(content, str(valve_path)), options, content)


def run_design(args: argparse.Namespace) -> int:
    """Design the compensator of a valve."""
    from dzdesign.codegen.project import target_named
    from dzdesign.design.compensator_file import SCHEMA, compensator_document
    from dzdesign.terminal.tables import print_compensator

    path = Path(args.valve)
    target_named(args.target)
    check_file_may_be_written(Path(args.output), SCHEMA)
    compensator = _design(path, read_bytes(path, "valve file"), args)
    document = compensator_document(compensator)
    write_file(Path(args.output), to_json(document), SCHEMA)
    if args.json:
        print(to_json(document), end="")
    else:
        print_compensator(compensator)
        print(one_line(f"Written: {args.output}"))
    return 0


def run_codegen(args: argparse.Namespace) -> int:
    """Generate the firmware of a compensator."""
    from dzdesign.codegen.project import DEFAULT_TARGET, generate, target_named, write_firmware
    from dzdesign.command_line.design_options import given_design_options
    from dzdesign.design.compensator_file import SCHEMA as COMPENSATOR_SCHEMA
    from dzdesign.design.compensator_file import compensator_from_document
    from dzdesign.design.firmware_manifest import FirmwareManifest
    from dzdesign.design.redesign_check import prove_derived, refuse_unsaid
    from dzdesign.identify.valve.model import SCHEMA as VALVE_SCHEMA
    from dzdesign.terminal.tables import print_firmware

    if args.list_targets:
        return _list_targets(args)
    if args.source is None:
        raise InputError("codegen needs a COMPENSATOR.json or a VALVE.json; see `dzdesign codegen --help`")
    target_named(args.target or DEFAULT_TARGET)
    check_folder_may_be_written(Path(args.output), schema_of(FirmwareManifest))
    path = Path(args.source)
    content = read_bytes(path, "compensator file")
    document = parse_document(content, str(path), (COMPENSATOR_SCHEMA, VALVE_SCHEMA))
    if document["schema"] == VALVE_SCHEMA:
        args.target = args.target or DEFAULT_TARGET
        firmware = generate(_design(path, content, args), args.target)
    else:
        for option in given_design_options(args):
            raise InputError(f"{option} is an option of the design, and '{path}' is designed; use `dzdesign design`")
        compensator = compensator_from_document(content, str(path))
        refuse_unsaid(compensator, str(path))
        try:
            prove_derived(compensator)
        except InputError as error:
            raise InputError(f"'{path}': {error}") from error
        firmware = generate(compensator, args.target, content)
    firmware = write_firmware(firmware, Path(args.output))
    if firmware.note:
        say(firmware.note)
    if args.json:
        print(to_json(as_document(firmware.manifest)), end="")
    else:
        print_firmware(firmware, args.output)
    return 0


def _list_targets(args: argparse.Namespace) -> int:
    """Print name and description of every target."""
    from dzdesign.codegen.project import targets

    if args.json:
        listing = [{"name": target.name, "description": target.description} for target in targets()]
        print(to_json({"targets": listing}), end="")
        return 0
    width = max(len(target.name) for target in targets())
    for target in targets():
        print(f"{target.name:{width}}  {target.description}")
    return 0


def run_verify(args: argparse.Namespace) -> int:
    """Verify a firmware folder and write the evidence."""
    from dzdesign.report.valve_report import REPORT_NAME, with_report
    from dzdesign.terminal.tables import print_firmware_mutants, print_verification
    from dzdesign.verify.closed_loop.plant import read_plant
    from dzdesign.verify.closed_loop.tolerances import read_tolerances
    from dzdesign.verify.firmware.c2000ware import check_against_c2000ware, with_check
    from dzdesign.verify.verification import SCHEMA, evidence_files, verify

    output = Path(args.output)
    check_folder_may_be_written(output, SCHEMA)
    plant = read_plant(Path(args.plant), say) if args.plant else None
    source = Path(args.plant).name if args.plant else ""
    digest = sha256_of(read_bytes(Path(args.plant), "plant file")) if args.plant else None
    tolerances = read_tolerances(Path(args.tolerances)) if args.tolerances else None
    include = [Path(place) for place in args.include or ()]
    firmware = Path(args.firmware)
    ware = check_against_c2000ware(firmware, Path(args.c2000ware), say) if args.c2000ware else None
    with stages() as stage:
        verification = verify(
            firmware, plant, source, digest, tolerances=tolerances, include=include, say=stage, watch=stage.each
        )
    verification = with_regenerated(verification, firmware)
    added = [ware] if ware else []
    if args.machine_code:
        from dzdesign.verify.analysis.machine_code import machine_code_checks

        with stages() as stage:
            stage("comparing the machine code of other processors with the exact law, in simulators")
            added += machine_code_checks(firmware, verification.inputs)
    if args.proof:
        from dzdesign.verify.analysis.frama_c import proof_check

        with stages() as stage:
            stage("reading the core's C for all inputs, with Frama-C: some minutes")
            added.append(proof_check(firmware))
    mutants = _firmware_mutants(firmware) if args.mutate else None
    if mutants:
        from dzdesign.verify.analysis.mutation import mutation_check

        added.append(mutation_check(mutants))
    for check in added:
        verification = with_check(verification, check)
    if mutants:
        verification.document["mutants"] = mutants
    manifest = {"schema": SCHEMA, "tool": TOOL, "made_from": verification.document["made_from"]}
    write_folder(output, with_report(evidence_files(verification), firmware, output), manifest)
    if args.json:
        print(to_json(verification.document), end="")
    else:
        print_verification(verification)
        if mutants:
            print_firmware_mutants(mutants)
        print(one_line(f"Evidence: {output}, to be read: {output / REPORT_NAME}"))
    return 0 if verification.holds else 1


def _firmware_mutants(firmware: Path) -> dict[str, Any]:
    """Make the firmware's core wrong in every place, and return what verify says to each."""
    from dzdesign.verify.analysis.mutation import MutationBench, all_mutants, judge_all, mutation_document

    bench = MutationBench(firmware)
    mutants = all_mutants(bench)
    say(f"checking the core with {len(mutants)} faults, one at a time")
    bench.check_original()
    return mutation_document(judge_all(bench, mutants, lambda work: with_bar(work, "mutants")))


def run_simulate(args: argparse.Namespace) -> int:
    """Write ramp tests of a simulated valve."""
    check_folder_may_be_written(Path(args.output))
    files, manifest = simulate(args)
    write_folder(Path(args.output), files, manifest)
    said = one_line(f"Written: {len(files)} simulated ramp tests in {args.output}")
    print(to_json(manifest) if args.json else said)
    return 0


def simulate(args: argparse.Namespace) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return recordings by the names of their files, and the manifest of their folder.

    Parameters
    ----------
    args : argparse.Namespace
        ``plant``, ``firmware``, ``dp``, ``ramp_time`` and ``seed`` of the command.
    """
    from dzdesign.verify.closed_loop.plant import Plant, read_plant
    from dzdesign.verify.closed_loop.simulation import Bench, simulated_files

    plant = read_plant(Path(args.plant), say) if args.plant else Plant()
    texts = args.dp or ["0.5 MPa", "1 MPa", "2 MPa", "3 MPa", "4 MPa", "5 MPa"]
    pressures = [parse_quantity(text, "pressure", "--dp") / 1e6 for text in texts]
    if len({f"{dp_MPa:g}" for dp_MPa in pressures}) < len(pressures):  # one file each, named by it
        raise InputError(f"--dp repeats a pressure drop ({', '.join(texts)}); give each of them once")
    ramp_s = parse_quantity(args.ramp_time, "time", "--ramp-time")
    bench = Bench(seed=_seed(args.seed))
    firmware = Path(args.firmware) if args.firmware else None
    with stages() as stage:
        return simulated_files(plant, pressures, ramp_s, bench, say=stage, firmware=firmware)


def run_derive(args: argparse.Namespace) -> int:
    """Re-derive the paper's equations; 1 if one of those shown is not found as a correct account finds it."""
    from dzdesign.derivation.account import account
    from dzdesign.derivation.presentation.report import check_format, closure, render

    format = "json" if args.json else args.format
    check_format(args.format)
    if args.output:
        check_file_may_be_written(Path(args.output))
    if args.mutate:
        if args.equation:
            raise InputError("--mutate counts over all equations; leave out --equation")
        return _run_mutations(args)
    shown = closure(account.STATEMENTS, args.equation) if args.equation else None
    with stages() as stage:
        stage("re-deriving the paper's equations")
        verdicts = account.verify_statements()
    text = render(verdicts, format, shown)
    if args.output:
        write_file(Path(args.output), text)
    else:
        print(text, end="")
    wrong = [verdict for verdict in verdicts if not verdict.as_expected and (shown is None or verdict.number in shown)]
    return 1 if wrong else 0


def _run_mutations(args: argparse.Namespace) -> int:
    """Count the wrong equations that the account catches; 1 if one of them is not caught."""
    from dzdesign.derivation.account.account import verify_statements
    from dzdesign.derivation.account.mutation import mutation_document, score_mutations
    from dzdesign.terminal.tables import print_mutations

    with stages() as stage:
        stage("making every equation wrong in every small way")
        document = mutation_document(score_mutations(verify_statements()))
    if args.output:
        write_file(Path(args.output), to_json(document))
    elif args.json:
        print(to_json(document), end="")
    else:
        print_mutations(document)
    return 0 if document["caught"] == document["mutants"] else 1
