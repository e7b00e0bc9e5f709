"""The commands that write folders or files, each from an old state to a new one."""

import subprocess
from pathlib import Path

from power_cut import PROGRAM, Job

RAMPS = Path(__file__).parents[2] / "examples" / "paper_valve" / "ramps"


def run(*words: str, folder: Path) -> None:
    """Run a command of dzdesign that must succeed."""
    subprocess.run([PROGRAM, *words], cwd=folder, check=True, capture_output=True)


def fault_jobs(folder: Path) -> list[Job]:
    """Return the jobs; what they start from is made in `folder`."""
    ramps = folder / "ramps"
    ramps.mkdir()
    for path in RAMPS.glob("*.csv.gz"):
        (ramps / path.name).write_bytes(path.read_bytes())
    if not any(ramps.iterdir()):
        raise SystemExit(f"no ramps in {RAMPS}")
    run("identify", *(f"ramps/{path.name}" for path in sorted(ramps.iterdir())), "-o", "valve.json", folder=folder)
    for name, transition in (("a", "2 %"), ("b", "1 %")):
        run("design", "valve.json", "--transition", transition, "-o", f"{name}.json", folder=folder)
        run("codegen", f"{name}.json", "--target", "host", "-o", f"firmware_{name}", folder=folder)
    compensators = (folder / "a.json", folder / "b.json")

    def codegen(target: str) -> Job:
        def words(name: str) -> tuple[str, ...]:
            return ("codegen", f"{name}.json", "--target", target, "-o", "made", "--replace")

        return Job(name=f"codegen {target}", old=words("a"), new=words("b"), units=("made",), inputs=compensators)

    return [
        codegen("f28335"),
        codegen("iec61131"),
        codegen("fmu"),
        Job(
            name="design",
            old=("design", "valve.json", "--transition", "2 %", "-o", "compensator.json"),
            new=("design", "valve.json", "--transition", "1 %", "-o", "compensator.json"),
            units=(),
            inputs=(folder / "valve.json",),
        ),
        Job(
            name="simulate",
            old=("simulate", "--dp", "1 MPa", "-o", "made"),
            new=("simulate", "--dp", "5 MPa", "-o", "made"),
            units=("made",),
            inputs=(),
        ),
        Job(
            name="verify",
            old=("verify", "firmware_a", "-o", "made"),
            new=("verify", "firmware_b", "-o", "made"),
            units=("made",),
            inputs=(folder / "firmware_a", folder / "firmware_b"),
        ),
        Job(
            name="batch",
            old=("batch", "lot", "--transition", "2 %", "-o", "made"),
            new=("batch", "lot", "--transition", "1 %", "-o", "made"),
            units=("made/valves/ramps",),
            on_the_way=("made/batch.json",),
            inputs=(_lot(folder),),
        ),
    ]


def _lot(folder: Path) -> Path:
    lot = folder / "lot"
    lot.mkdir()
    (folder / "ramps").rename(lot / "ramps")
    return lot
