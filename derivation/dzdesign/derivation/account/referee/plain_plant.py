"""The simulation model in plain numbers: the state equation of coil and armature, solved at one s by elimination."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainPlant:
    """Parameters of Eqs. (19)-(24), what they start from, and what acts on them, near 1."""

    K_a: float = 2.0
    K_fi: float = 0.5
    K_i: float = 3.0
    R_c: float = 1.25
    r_p: float = 0.25
    L_c: float = 0.5
    m_e: float = 0.75
    B_e: float = 1.5
    K_et: float = 2.5
    u_step: float = 4.0
    load_step: float = 0.5
    i_init: float = 0.0
    x_init: float = 0.0
    v_init: float = 0.0
    #: The pressure drop falls as exp(-2 a t).
    a: float = 0.0

    def rates(self, i: float, x: float, v: float, u: float, load: float) -> tuple[float, float, float]:
        """Rates of current, travel and speed."""
        voltage = self.K_a * (u - self.K_fi * i) - (self.R_c + self.r_p) * i
        return voltage / self.L_c, v, (self.K_i * i - load - self.B_e * v - self.K_et * x) / self.m_e

    def transforms(self, s: float) -> tuple[float, float]:
        """Transforms of current and travel at one s, after steps of command and load: (s - A) z = z(0) + b/s."""
        columns = [self.rates(*unit, 0.0, 0.0) for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        drive = self.rates(0.0, 0.0, 0.0, self.u_step, self.load_step)
        start = (self.i_init, self.x_init, self.v_init)
        rows = [[(s if n == m else 0.0) - columns[m][n] for m in range(3)] for n in range(3)]
        current, travel, _ = _solve(rows, [start[n] + drive[n] / s for n in range(3)])
        return current, travel


def _solve(rows: list[list[float]], right: list[float]) -> list[float]:
    """Solve linear equations by Gauss's elimination with the largest pivot."""
    size = len(rows)
    table = [[*row, value] for row, value in zip(rows, right, strict=True)]
    for n in range(size):
        pivot = max(range(n, size), key=lambda m: abs(table[m][n]))
        table[n], table[pivot] = table[pivot], table[n]
        for m in range(size):
            if m != n:
                factor = table[m][n] / table[n][n]
                table[m] = [one - factor * other for one, other in zip(table[m], table[n], strict=True)]
    return [table[n][size] / table[n][n] for n in range(size)]


PLANTS = (
    PlainPlant(),
    PlainPlant(load_step=0.0),
    PlainPlant(i_init=0.5, x_init=0.25, v_init=-0.5),
    PlainPlant(load_step=0.0, a=0.25),
)
