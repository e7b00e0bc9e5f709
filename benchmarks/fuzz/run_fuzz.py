"""Fuzz every reader for some time: `python benchmarks/fuzz/run_fuzz.py --seconds 60`.

With atheris (the extra `fuzz`) the mutations are led by coverage of dzdesign's own lines; without it they are blind. A
finding is written to the working folder as ``crash-...`` and ends the run with status 1; the same file as an argument
after the target's name tries it again. Once it is corrected, keep the file in ``found/TARGET/``.
"""

import argparse
import contextlib
import importlib.util
import random
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # for what tests support

#: One input takes no longer, s; no input is longer, bytes; and no reader takes more memory, MB.
SLOWEST_S, LONGEST, MEMORY_MB = 5, 65536, 2048
NAMES = (
    "text", "recording", "low-flow", "valve", "compensator", "artefacts", "curves",
    "options", "plant", "words",
    "amplifier", "telemetry", "loading-frames", "loading", "calibration-file", "calibration-block",
)  # fmt: skip
#: How libFuzzer says how many inputs it tried.
EXECUTED = re.compile(r"stat::number_of_executed_units:\s*(\d+)")


def with_coverage(name: str, seconds: int, seed: int) -> None:
    """Fuzz one target in this process, which atheris ends."""
    import atheris  # pyright: ignore[reportMissingModuleSource, reportMissingImports]: of `make fuzz`

    with atheris.instrument_imports(include=["dzdesign"]):
        from target import found_inputs
        from targets import TARGETS

    target = TARGETS[name]
    with tempfile.TemporaryDirectory() as corpus:
        for number, content in enumerate([*target.seeds(), *found_inputs(name)]):
            (Path(corpus) / str(number)).write_bytes(content)
        limits = [f"-timeout={SLOWEST_S}", f"-max_len={LONGEST}", f"-rss_limit_mb={MEMORY_MB}"]
        options = [f"-max_total_time={seconds}", f"-seed={seed}", "-verbosity=0", "-print_final_stats=1"]
        atheris.Setup([sys.argv[0], *options, *limits, corpus], target)
        atheris.Fuzz()


def blind(name: str, seconds: float, seed: int) -> int:
    """Fuzz one target without coverage; return how many inputs were tried."""
    from target import found_inputs
    from targets import TARGETS

    target, chance = TARGETS[name], random.Random(f"{seed} {name}")
    seeds = [*target.seeds(), *found_inputs(name)]
    end, tried = time.monotonic() + seconds, 0
    while time.monotonic() < end or not tried:
        data = bytearray(chance.choice(seeds))
        for _ in range(chance.randrange(1, 6)):
            at = chance.randrange(len(data) + 1)
            size = chance.randrange(1, 32)
            match chance.randrange(4):
                case 0:
                    del data[at : at + size]
                case 1:
                    data[at:at] = chance.randbytes(size)
                case 2:
                    data[at : at + 1] = chance.choice((b"\0", b"\xff", b'"', b"\n", b"9" * 400, b"[" * 60, b"-", b"e9"))
                case 3:
                    data[at:at] = data[at : at + size]
        begin = time.monotonic()
        try:
            target(bytes(data))
            if (took := time.monotonic() - begin) > SLOWEST_S:
                raise TimeoutError(f"one input took {took:.0f} s, expected at most {SLOWEST_S} s")
        except BaseException:
            place = Path(f"crash-{name}-{seed}-{tried}")
            place.write_bytes(data)
            print(f"{name}: seed {seed}, input {tried}, written to {place}")
            raise
        tried += 1
    return tried


def main() -> int:
    """Fuzz all targets, or one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", nargs="?", choices=NAMES)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--seconds", type=int, default=60, help="for all targets together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.file:
        from targets import TARGETS

        TARGETS[args.target](args.file.read_bytes())
        return 0
    if args.alone:
        with_coverage(args.target, args.seconds, args.seed)
    led = importlib.util.find_spec("atheris") is not None
    print(f"seed {args.seed}; {'led by coverage (atheris)' if led else 'blind: install the extra fuzz for coverage'}")
    names = [args.target] if args.target else NAMES
    found = 0
    for name in names:
        seconds = max(args.seconds // len(names), 1)
        begin = time.monotonic()
        if led:
            command = [sys.executable, __file__, name, "--alone", f"--seconds={seconds}", f"--seed={args.seed}"]
            done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
            wrong, said = done.returncode != 0, done.stdout + done.stderr
            tried = sum(map(int, EXECUTED.findall(said)))
        else:
            wrong, said, tried = False, "", 0
            with contextlib.suppress(KeyboardInterrupt):
                tried = blind(name, seconds, args.seed)
        found += wrong
        spent = time.monotonic() - begin
        print(f"{name:18} {spent:6.0f} s {tried:9} inputs  {'FINDING' if wrong else 'nothing found'}", flush=True)
        if wrong:
            print(said[-4000:])
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
