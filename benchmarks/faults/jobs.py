"""The commands that write folders or files, each from an old state to a new one."""

import subprocess
from pathlib import Path

from power_cut import PROGRAM, Job

RAMPS = Path(__file__).parents[2] / "examples" / "paper_valve" / "ramps"
#: Two pressure drops of the example, recorded once and once more.
ONCE, ONCE_MORE = (tuple(f"ramps/ramp_dP{dp}_{number}.csv.gz" for dp in (1, 5)) for number in (1, 2))
#: What `codegen` writes, and the options without which it would not.
TARGETS: dict[str, tuple[str, ...]] = {
    "host": (), "f28335": (), "f280049c": (), "cortex-m4": (), "iec61131": (),
    "fmu": ("--plant", "plant.toml"), "matlab": (), "amplifier": ("--device", "west"),
}  # fmt: skip
#: Folders that `demo` writes.
DEMO = ("firmware", "evidence", "example")
#: Commands that write something, but not whole: a recording grows line by line.
LINE_BY_LINE = ("monitor",)


def run(*words: str, folder: Path) -> None:
    """Run a command of dzdesign that must succeed."""
    subprocess.run([PROGRAM, *words], cwd=folder, check=True, capture_output=True)


def fault_jobs(folder: Path) -> list[Job]:
    """Return the jobs; what they start from is made in `folder`."""
    _make_inputs(folder)
    return jobs_in(folder)


def jobs_in(folder: Path) -> list[Job]:
    """Return the jobs whose inputs lie in a folder, or will."""
    return [*_codegen(folder), *_of_one_file(folder), *_of_folders(folder), *_of_lots(folder)]


def _make_inputs(folder: Path) -> None:
    for place, pattern in ((folder / "ramps", "*.csv.gz"), (folder / "lot" / "valve", "ramp_dP[15]_*.csv.gz")):
        place.mkdir(parents=True)
        for path in RAMPS.glob(pattern):
            (place / path.name).write_bytes(path.read_bytes())
        if not any(place.iterdir()):
            raise SystemExit(f"no ramps in {RAMPS}")
    (folder / "plant.toml").write_text("", encoding="utf-8")
    every = sorted(path.name for path in (folder / "ramps").iterdir())
    run("identify", *(f"ramps/{name}" for name in every), "-o", "valve.json", folder=folder)
    for name, transition in (("a", "2 %"), ("b", "1 %")):
        run("design", "valve.json", "--transition", transition, "-o", f"{name}.json", folder=folder)
        run("codegen", f"{name}.json", "--target", "host", "-o", f"firmware_{name}", folder=folder)
        run("codegen", f"{name}.json", "--target", "amplifier", "--device", "west", "-o", f"amplifier_{name}",
            folder=folder)  # fmt: skip


def _codegen(folder: Path) -> list[Job]:
    """Return a job for each target of `codegen`, and for the form with a calibration block."""

    def job(name: str, *options: str) -> Job:
        def words(transition: str) -> tuple[str, ...]:
            return ("codegen", "valve.json", "--transition", transition, *options, "-o", "made", "--replace")

        inputs = (folder / "valve.json", folder / "plant.toml")
        return Job(name=f"codegen {name}", old=words("2 %"), new=words("1 %"), units=("made",), inputs=inputs)

    block = ("--target", "f28335", "--calibration", "block")
    return [*(job(name, "--target", name, *options) for name, options in TARGETS.items()), job("block", *block)]


def _of_one_file(folder: Path) -> list[Job]:
    """Return the jobs of commands that write a file, and perhaps plots, each of which is whole by itself."""
    valve, ramps = folder / "valve.json", folder / "ramps"
    compensators = (folder / "a.json", folder / "b.json")

    def job(old: tuple[str, ...], new: tuple[str, ...], *inputs: Path, refused_again: bool = False) -> Job:
        return Job(name=new[0], old=old, new=new, units=(), inputs=inputs, refused_again=refused_again)

    def of_two(command: str, *options: str) -> Job:
        return job((command, "a.json", *options), (command, "b.json", *options), *compensators)

    assess, plots = ("assess", *ONCE, "--after", *ONCE_MORE, "-o", "made.json"), ("--plots", "plots")
    return [
        job((), ("init", *ONCE, "-o", "made.toml"), ramps, refused_again=True),
        job(("identify", *ONCE, *plots, "-o", "made.json"), ("identify", *ONCE_MORE, *plots, "-o", "made.json"), ramps),
        job(
            ("design", "valve.json", "--transition", "2 %", "-o", "made.json"),
            ("design", "valve.json", "--transition", "1 %", "-o", "made.json"),
            valve,
        ),
        of_two("calibration", "-o", "made.hex"),
        of_two("export", "--to", "csv", "-o", "made.csv"),
        job((*assess, *plots), (*assess, *plots, "--reading-flow", "1 L/min"), ramps),
        job(
            ("report", "firmware_a", "-o", "made.html"),
            ("report", "firmware_b", "-o", "made.html"),
            folder / "firmware_a",
            folder / "firmware_b",
        ),
        job(("derive", "--equation", "5", "-o", "made.txt"), ("derive", "--equation", "18", "-o", "made.txt")),
    ]


def _of_folders(folder: Path) -> list[Job]:
    """Return the jobs of commands that write folders."""

    def verify(kind: str) -> Job:
        return Job(
            name=f"verify {kind}",
            old=("verify", f"{kind}_a", "-o", "made"),
            new=("verify", f"{kind}_b", "-o", "made"),
            units=("made",),
            inputs=(folder / f"{kind}_a", folder / f"{kind}_b"),
        )

    return [
        verify("firmware"),
        verify("amplifier"),
        Job(
            name="simulate",
            old=("simulate", "--dp", "1 MPa", "-o", "made"),
            new=("simulate", "--dp", "5 MPa", "-o", "made"),
            units=("made",),
            inputs=(),
        ),
        Job(name="reproduce", old=(), new=("reproduce", "-o", "made"), units=("made",), inputs=()),
        Job(name="demo", old=(), new=("demo", "made"), units=tuple(f"made/{part}" for part in DEMO), inputs=()),
    ]


def _of_lots(folder: Path) -> list[Job]:
    """Return the jobs of `batch`: of a firmware for each valve, and of blocks and other outputs."""

    def job(name: str, *options: str) -> Job:
        return Job(
            name=name,
            old=("batch", "lot", "--transition", "2 %", *options, "-o", "made"),
            new=("batch", "lot", "--transition", "1 %", *options, "-o", "made"),
            units=("made/valves/valve", "made/lot/firmware"),
            on_the_way=("made/batch.json",),
            inputs=(folder / "lot",),
        )

    return [job("batch"), job("batch of blocks", "--calibration", "block", "--outputs", "iec61131,matlab")]
