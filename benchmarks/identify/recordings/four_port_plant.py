"""A valve with four ports on a bench, both of its edges metering: no code shared with the product."""

from collections.abc import Sequence

import numpy as np
from bench_loggers import Rows
from bench_plant import Segment, commanded, lagged, ramp, with_play

#: Volts at which the valve's sides open and close, whatever the unit of the command.
OPENS, CLOSES = {"positive": 4.66, "negative": 3.26}, {"positive": 4.54, "negative": 3.14}
GAIN, PLAY = 3.5, 0.12
BOTH_WAYS = (*ramp(), *ramp(top=-10.0))


def bench(
    command: Sequence[Segment],
    *,
    edge: float = 1.0,
    seed: int = 1,
    rate_Hz: float = 50.0,
    noise: float = 0.1,
    command_noise: float = 0.003,
    rise_s: float = 0.0,
    floor: float = 0.0,
    positive: bool = True,
    load_MPa: float = 0.0,
) -> Rows:
    """Return what stands on a bench: time (s), command (V), pressures of the ports (MPa), flow (L/min).

    Inlet and outlet edge of a side open alike; each takes `edge` MPa of the shut valve, and less under flow, when the
    supply and the lines take their share. A load between the working ports takes `load_MPa`; with none they are joined,
    as for a test of both directions. `rise_s` is the time constant of the spool and the flow, `floor` the meter's.
    """
    rng = np.random.default_rng([seed, 77])
    time, u = commanded(command, rate_Hz)
    spool = with_play(u, PLAY)
    if rise_s:
        spool = lagged(spool, rise_s * rate_Hz)
    right = np.maximum(spool - (OPENS["positive"] - PLAY / 2), 0)
    left = np.maximum(-spool - (OPENS["negative"] - PLAY / 2), 0)
    opened = np.minimum(right + left, 4.6)
    drop = edge / (1 + 0.06 * (opened / 4) ** 2)
    flow = GAIN * opened * np.sqrt(drop)
    tank = 0.3 + 0.0005 * flow**2
    load = load_MPa + 0.002 * flow**2
    supply = tank + 2 * drop + load
    inlet, outlet = supply - drop, tank + drop
    forwards = u >= 0
    read = (flow if positive else flow * np.where(forwards, 1, -1)) + noise * rng.standard_normal(u.size)
    if floor:
        read = np.where(np.abs(read) < floor, 0.0, read)
    ports = {"P": supply, "A": np.where(forwards, inlet, outlet), "B": np.where(forwards, outlet, inlet), "T": tank}
    noisy = {f"p{port}": value + 0.003 * rng.standard_normal(u.size) for port, value in ports.items()}
    noisy["dP"] = drop + 0.004 * rng.standard_normal(u.size)
    return {"t": time, "u": u + command_noise * rng.standard_normal(u.size), "Q": read, **noisy}
