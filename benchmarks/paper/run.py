"""Benchmark of the account's mutants and of `dzdesign reproduce` as a whole; ``run.py [--quick]``.

CI tries a drawn part of the mutants, and writes some of the figures; here all of them are. Exit status 1 if a limit is
missed.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]

from scoreboard import Row, print_rows, run_parts, say  # noqa: E402

#: Of each way: fewer would mean that a way is no longer tried.
LEAST = {"formulas": 3000, "scopes": 80, "grounds": 400}


def print_mutants(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of the account's mutants."""
    from dzdesign.derivation.account.account import verify_statements
    from tests.derivation.account.mutants import score_mutations

    verdicts = verify_statements()
    share = 0.1 if quick else 1.0
    say(f"wrong statements: {'a tenth' if quick else 'all'} of them, seed {seed}")
    start = perf_counter()
    found = score_mutations(verdicts, share, seed)
    seconds = perf_counter() - start
    for score in found:
        for survivor in score.survivors:
            print(f"{score.changed} of {score.number} survives: {survivor}")
    tried = {way: sum(one.mutants for one in found if one.changed == way) for way in LEAST}
    missed = {way: sum(len(one.survivors) for one in found if one.changed == way) for way in LEAST}
    rows = [
        Row(what="mutants that are not caught", value=missed["formulas"] + missed["grounds"], limit=0),
        # A case or a scope less leaves a statement true, where what is left out holds as well.
        Row(what="changes of scope that are not caught", value=missed["scopes"], note=f"of {tried['scopes']}"),
        Row(what="time", value=seconds, unit="s"),
    ]
    for way, least in LEAST.items():
        missing = 0 if quick else max(0, least - tried[way])
        rows.append(Row(what=f"mutants too few: {way}", value=missing, limit=0, note=f"{tried[way]} tried"))
    print_rows("the account of the paper", rows)
    return rows


def print_reproduction(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of the whole command, run twice; there is nothing quicker, and nothing is drawn."""
    from dzdesign.stages.reproduce import ReproduceArguments, reproduce

    with TemporaryDirectory() as temporary:
        start = perf_counter()
        made = reproduce(ReproduceArguments(output=Path(temporary) / "first"))
        seconds = perf_counter() - start
        reproduce(ReproduceArguments(output=Path(temporary) / "second"))
        first, second = (
            {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
            for folder in (Path(temporary) / "first", Path(temporary) / "second")
        )
    for number in (unexplained := [number for number in made.law if not number.holds]):
        print(f"{number.valve}: {number.quantity} at {number.dp_MPa} MPa is explained by nothing")
    faults = sum(len(each.faults) for each in made.product)
    rows = [
        Row(what="numbers explained by nothing, and faults of the product", value=len(unexplained) + faults, limit=0),
        Row(what="files that a second run has otherwise", value=len(first.items() ^ second.items()), limit=0),
        Row(what="figures missing", value=7 - sum(name.suffix == ".svg" for name in first), limit=0),
        Row(what="time", value=seconds, unit="s"),
    ]
    print_rows("the paper's numbers and figures", rows)
    return rows


PARTS = {"reproduction": (print_reproduction, 0), "mutants": (print_mutants, 20261123)}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    return run_parts(__doc__.splitlines()[0], PARTS, "a tenth of the mutants", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
