"""`dzdesign demo DIR`: the main job on the bundled example, from ramp tests to checked C."""

import argparse
from pathlib import Path

from dzdesign.core.artefact_files import check_folder_may_be_written, sha256_of, to_json, write_file, write_folder
from dzdesign.core.artefact_types import as_document
from dzdesign.core.errors import InputError
from dzdesign.core.units import parse_quantity
from dzdesign.example import example_folder
from dzdesign.regeneration import with_regenerated
from dzdesign.terminal.progress import say, stages

#: The flow meter of the bundled recordings, as their first lines tell it.
METER_LAG, METER_FLOOR = "0.1 s", "0.6 L/min"
RECORD = {"valve": "simulated by dzdesign, no measurement"}


def run_demo(args: argparse.Namespace) -> int:
    """Run the pipeline on the bundled ramp tests and print the closing table."""
    from dzdesign.codegen.project import DEFAULT_TARGET, generate, target_named
    from dzdesign.core.artefact_types import to_json_bytes
    from dzdesign.derivation.account.account import verify_statements
    from dzdesign.design.compensator_file import compensator_document
    from dzdesign.design.designing import design
    from dzdesign.design.option_texts import options_of
    from dzdesign.identify.identification import identify
    from dzdesign.identify.options import IdentifyOptions
    from dzdesign.identify.reading.ramp_files import read_ramp_file
    from dzdesign.report.valve_report import with_report
    from dzdesign.terminal.tables import print_demo
    from dzdesign.verify.closed_loop.plant import read_plant
    from dzdesign.verify.verification import evidence_files, evidence_manifest, verify

    folder = Path(args.folder)
    for part in ("firmware", "evidence"):
        check_folder_may_be_written(folder / part)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder '{folder}' can't be made: {error.strerror}") from error
    with stages() as stage:
        stage("re-deriving the paper's equations")
        verdicts = verify_statements()
        expected = sum(verdict.as_expected for verdict in verdicts)
        say(f"derivation: {expected} of {len(verdicts)} statements have the verdict expected of them")
        example = example_folder()
        tests = [read_ramp_file(path) for path in sorted((example / "ramps").glob("*.csv.gz"))]
        plant = read_plant(example / "plant.toml")
        digest = sha256_of((example / "plant.toml").read_bytes())
        meter = IdentifyOptions(
            meter_lag=parse_quantity(METER_LAG, "time", "lag"),
            meter_floor=parse_quantity(METER_FLOOR, "flow", "floor"),
        )
        stage(f"identifying the valve from {len(tests)} simulated ramp tests")
        valve = identify(tests, meter, RECORD)
        valve_json = to_json_bytes(valve)
        write_file(folder / "valve.json", valve_json)
        stage("designing the compensator")
        options = options_of({}, target_named(DEFAULT_TARGET).inputs())
        compensator = design(valve, options, valve_json)
        compensator_json = to_json(compensator_document(compensator))
        write_file(folder / "compensator.json", compensator_json)
        firmware = generate(compensator, DEFAULT_TARGET, compensator_json.encode())
        write_folder(folder / "firmware", firmware.files, firmware.manifest)
        source = "plant.toml of the example"
        verification = verify(folder / "firmware", plant, source, digest, say=stage, watch=stage.each)
    verification = with_regenerated(verification, folder / "firmware")
    manifest = evidence_manifest(verification.evidence)
    evidence = with_report(evidence_files(verification), folder / "firmware", folder / "evidence")
    write_folder(folder / "evidence", evidence, manifest)
    if args.json:
        print(to_json(as_document(verification.evidence)), end="")
    else:
        print_demo(valve, verification, str(folder))
    return 0 if verification.holds and expected == len(verdicts) else 1
