"""One contender on all machines: a `Measured`, which is a row of the table."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import on_avr
import on_cortex_m4
import on_x86
from building import Counts
from contender import Contender
from tried_inputs import Codes, exact_rows_header

from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What was measured of a contender.

    Attributes
    ----------
    contender : Contender
        Which.
    x86, cortex_m4, avr : Counts
        Instructions, instructions, cycles.
    code_bytes : tuple of int
        Code and constants on the three, in that order.
    inputs : int
        How many pairs of codes were compared with the exact law on the host.
    wrong_host, largest_error : int
        Of those, wrong compare values and the largest error in counts, on the host.
    wrong_cortex_m4 : int or None
        The same by the machine code of the Cortex-M4; None where that takes hours.
    wrong_tried : tuple of int
        Wrong compare values of the inputs that were counted, on the three.
    """

    HEADINGS: ClassVar[tuple[str, ...]] = (
        "core",
        "x86-64 instructions",
        "Cortex-M4F instructions",
        "AVR cycles",
        "bytes x86 / M4 / AVR",
        "wrong of all inputs, host",
        "on M4",
        "wrong of the counted, x86 / M4 / AVR",
        "largest error, counts",
    )

    contender: Contender
    x86: Counts
    cortex_m4: Counts
    avr: Counts
    code_bytes: tuple[int, int, int]
    inputs: int
    wrong_host: int
    largest_error: int
    wrong_cortex_m4: int | None
    wrong_tried: tuple[int, int, int]

    def cells(self) -> list[str]:
        """Return the row's cells, in the order of `HEADINGS`."""
        ranges = [f"{each.least}-{each.most}" for each in (self.x86, self.cortex_m4, self.avr)]
        return [
            self.contender.name,
            *ranges,
            " / ".join(map(str, self.code_bytes)),
            f"{self.wrong_host} of {self.inputs}",
            "" if self.wrong_cortex_m4 is None else str(self.wrong_cortex_m4),
            " / ".join(map(str, self.wrong_tried)),
            str(self.largest_error),
        ]


def measure(
    contender: Contender, compensator: Compensator, inputs: Sequence[Codes], expected: Sequence[int], folder: Path
) -> Measured:
    """Count and check one contender everywhere."""
    machines = {"x86": on_x86, "cortex_m4": on_cortex_m4, "avr": on_avr}
    counted = {name: machine.count(contender, inputs, folder / name) for name, machine in machines.items()}
    sizes = [machine.code_bytes(contender, folder / f"{name}-bytes") for name, machine in machines.items()]
    rows_header = exact_rows_header(compensator)
    tried, wrong, largest = on_x86.check_all(contender, rows_header, folder / "all")
    wrong_m4 = None
    if contender.fast:
        tried_m4, wrong_m4, largest_m4 = on_cortex_m4.check_all(contender, rows_header, folder / "all-m4")
        if tried_m4 != tried:
            raise RuntimeError(f"the Cortex-M4 tried {tried_m4} inputs, the host {tried}")
        largest = max(largest, largest_m4)
    return Measured(
        contender=contender,
        **counted,
        code_bytes=tuple(sizes),
        inputs=tried,
        wrong_host=wrong,
        largest_error=largest,
        wrong_cortex_m4=wrong_m4,
        wrong_tried=tuple(
            sum(found != right for found, right in zip(each.compares, expected, strict=True))
            for each in counted.values()
        ),
    )
