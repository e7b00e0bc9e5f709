"""One reader that is fuzzed: bytes in, nothing out; a refusal is an answer, any other exception a finding."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.errors import InputError

#: Inputs that were findings once, a folder a target: each run begins with them, and so do the tests.
FOUND = Path(__file__).parent / "found"
#: Characters of a refusal.
SHORTEST, LONGEST = 10, 200_000


@dataclass(frozen=True, kw_only=True)
class Target:
    """One reader, and files to begin with; these are made only where the target is run."""

    run: Callable[[bytes], None]
    seeds: Callable[[], Iterable[bytes]]
    #: What the reader raises of an input that it does not take.
    refusals: tuple[type[Exception], ...] = (InputError,)

    def __call__(self, data: bytes) -> None:
        """Read; a refusal must be a sentence of bounded length."""
        try:
            self.run(data)
        except self.refusals as error:
            if not SHORTEST < len(str(error)) < LONGEST:
                raise ValueError(f"a refusal of {len(str(error))} characters") from error


def found_inputs(name: str) -> list[bytes]:
    """Return the inputs that were findings of a target once."""
    return [path.read_bytes() for path in sorted((FOUND / name).glob("*"))]
