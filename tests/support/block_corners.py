"""Calibration blocks at the limits of what a firmware accepts, and just beyond them."""

from dataclasses import replace

from dzdesign.codegen.calibration.acceptance import LARGEST_CODES, LARGEST_DROP
from dzdesign.codegen.calibration.layout import NODE_MASK, SUPPLY_MASK, BuiltFor
from dzdesign.design.current.circuit import LARGEST_ERROR
from dzdesign.design.drive_functions import MOST_FAULT_SAMPLES
from dzdesign.design.signals import WEIGHT_SHIFT

INT32 = 2**31 - 1


def corners(block, built):
    """Blocks at a limit that one changed number alone does not reach: where two numbers hang together."""
    for weight in (0, 1):
        yield rebalanced(with_sides(block, {"weight": weight}))
    yield from law_corners(block, built)
    yield from play_corners(block, built)
    for steps in ({"ramp_up": 0}, {"ramp_down": 0}, {"ramp_up": 1, "ramp_down": 2**31 - 1}, {"ramp_up": 2**31}):
        yield replace(with_sides(block, steps), ramps=1)
    ends = ("low", "zero", "high")
    sensors = {place: block.sensors[place] for place in range(len(built.inputs))}
    for place, sensor in {None: None, **sensors}.items():
        low, zero, high = (getattr(sensor or block, end if sensor else f"command_{end}") for end in ends)
        above, top = min(high + 1, 65535), built.code_max
        for codes in ((low, low, low), (high, high, high), (0, 0, 0), (low, above, high), (zero, low, high),
                      (0, 0, 1), (0, 1, 1), (high - 1, high - 1, high), (high - 1, high, high),
                      (low, zero, min(top + 1, 65535)), (low, zero, top)):  # fmt: skip
            made = dict(zip(ends, codes, strict=True))
            if sensor:
                yield rebalanced(with_sensors(block, {place: made}))
            else:
                yield replace(block, **{f"command_{end}": code for end, code in made.items()})
    yield from (drops(block, LARGEST_DROP + over, turned) for over in (0, 1) for turned in (False, True))
    narrow = with_sensors(block, {1: {"low": 0, "zero": 0, "high": 1}})
    yield rebalanced(with_sides(narrow, {"weight": 65535}))
    yield from (replace(block, fault_samples=samples) for samples in (MOST_FAULT_SAMPLES, MOST_FAULT_SAMPLES + 1))
    yield from spans(block)
    yield replace(block, leave_zero=block.zero_band)
    yield replace(block, leave_zero=block.zero_band + 1)
    yield replace(block, zero_band=0, leave_zero=0)
    if built.code_max > LARGEST_CODES:
        yield from long_commands(block)
    if built.has("CURRENT"):
        yield from current_corners(block)


def spans(block):
    """Sides as long as the rising command, and a code longer."""
    for zero in (block.command_zero, block.command_zero + 5):
        for over in (0, 1):
            span = min(max(block.command_high - zero, 0) + over, 65535)
            ends = {"span": span, "room": max(span - block.zero_band, 0), "band_end": zero + block.zero_band}
            yield with_sides(replace(block, command_zero=zero, play_codes=0), ends)


def long_commands(block):
    """Commands as long as the drive functions can count, and a code longer."""
    for zero, ends in ((32768, ((1, 65535), (0, 65535))), (32767, ((0, 65534), (0, 65535)))):
        for low, high in ends:
            made = replace(block, command_low=low, command_zero=zero, command_high=high)
            made = of_zero_command(made)
            for functions in ({"ramps": 1, "play_codes": 0}, {"ramps": 0, "play_codes": 0}, {"ramps": 0}):
                yield replace(made, **functions)


def of_zero_command(block):
    """The block of two solenoids with the ends of its zero bands where its zero command has them."""
    ends = (block.command_zero + block.zero_band, block.command_zero - block.zero_band)
    return replace(block, sides=tuple(replace(s, band_end=end) for s, end in zip(block.sides, ends, strict=True)))


def drops(block, drop: int, turned: bool):
    """The block with codes whose largest pressure drop, of one direction, is just this."""
    for a in range(3000, 0, -1):
        rest = drop - (a << WEIGHT_SHIFT)
        for b in range(max(rest // 65535, 1), 3000):
            if 0 < rest <= b * 65535 and rest % b == 0:
                zero_a, zero_b = (500 + a, 500) if turned else (500, 500 + b)
                codes = {
                    0: {"low": 500, "zero": zero_a, "high": 500 + a},
                    1: {"low": 500, "zero": zero_b, "high": 500 + b},
                }
                return rebalanced(with_sides(with_sensors(block, codes), {"weight": rest // b}))
    raise ValueError(f"no codes have the drop {drop}")


def current_corners(block):
    """The same of the current controller."""
    numbers = block.current
    for change in ({"integral_limit": 0, "release": 0}, {"release": numbers.integral_limit + 1},
                   {"integral_limit": 65535 << numbers.gain_shift}, {"supply_high": numbers.supply_low},
                   {"integral_limit": (65535 << numbers.gain_shift) + 1}, {"current_gain": 65535, "current_shift": 15},
                   {"open_sum": numbers.over_sum}, {"over_sum": numbers.short_sum}, {"open_sum": numbers.over_sum - 1},
                   {"over_sum": numbers.short_sum - 1}, {"offset_low": numbers.offset_nominal},
                   {"offset_high": numbers.offset_nominal}, {"offset_low": numbers.offset_nominal + 1},
                   {"offset_high": max(numbers.offset_nominal - 1, 0)}):  # fmt: skip
        yield replace(block, current=replace(numbers, **change))
    yield replace(block, current=replace(numbers, supply_high=numbers.supply_low + 1))
    ordered = replace(numbers, open_sum=1, over_sum=2)
    for shift in range(1, 7):
        half = 1 << shift >> 1
        for over in range(-1, half):  # the largest current, and one beyond it that only its rounding makes
            for short, gain in factors(((LARGEST_ERROR + 1) << shift) - half + over):
                made = {"short_sum": short, "current_gain": gain, "current_shift": shift}
                yield replace(block, current=replace(ordered, **made))
    yield replace(block, current=replace(ordered, short_sum=3, current_gain=1, current_shift=15))
    yield replace(block, current=replace(ordered, over_sum=65534, short_sum=65535, current_gain=1))
    nodes = tuple(range(16384, 16384 + len(numbers.supply)))
    for shift in (0, 1, 5, 9):
        ends = ((SUPPLY_MASK + 1) << shift, len(nodes) << shift)  # one node too many, and one beyond the table
        for place in (ends[0] - 1, *ends):
            for top in (place, 65535):
                measured = {"supply_low": top - place, "supply_high": top, "supply_shift": shift}
                yield replace(block, current=replace(numbers, supply=nodes, **measured))
    for last in (1, 2, len(nodes) - 1):
        for node in (last - 1, last, last + 1):
            zero = tuple(int(index != node) for index in range(len(nodes)))
            measured = {"supply_low": 0, "supply_high": last, "supply_shift": 0} if last == 1 else {
                "supply_low": 0, "supply_high": (last << 2) - 1, "supply_shift": 2}  # fmt: skip
            yield replace(block, current=replace(numbers, supply=zero, **measured))

    for gain in ("proportional", "integral", "feed_forward"):
        for value in (8191, 8192):
            yield replace(block, current=replace(numbers, **{gain: value}))
    for shift in range(18):
        for integral in (0, 65535 << shift, (65535 << shift) + 1):
            changed = {"gain_shift": shift, "integral_limit": min(integral, 2**32 - 1), "release": 0}
            yield replace(block, current=replace(numbers, **changed))
        yield replace(block, current=replace(numbers, supply_shift=shift))
        yield replace(block, current=replace(numbers, current_shift=shift))
        yield replace(block, current=replace(numbers, gain_shift=shift))
        yield replace(block, current=replace(numbers, current_shift=shift, current_gain=1))


def factors(product: int):
    """Two numbers of 16 bits that have this product, the first at least 3; nothing where there are none."""
    for left in range(65535, 2, -1):
        if product % left == 0 and product // left <= 65535:
            yield left, product // left
            return


def law_corners(block, built):
    """Laws of one beta and nothing else: each number at its limit, and one beyond."""
    count = max(side.node_count for side in block.sides)
    nothing = {"slope": 0, "offset": 1, "transition": 0, "linear": 0, "half": 0, "beta_factor": 0, "beta_shift": 0,
               "quotient_limit": 0, "reciprocal": 1, "reciprocal_shift": 0}  # fmt: skip

    def law(node: int, at_zero: int | None = None, **changes):
        zero = node if at_zero is None else at_zero
        nodes = (node, zero) * count + (0, 0) * (NODE_MASK - count) + (node, zero) * 2
        return with_sides(block, {"node_count": count, "nodes": nodes, **nothing, **changes})

    most = INT32 // built.beta_step
    yield from (law(node) for node in (0, 1, most, most + 1))
    for node, shift in ((65535, 6), (65536, 6), (1, 63), (1, 64)):
        yield law(node, beta_factor=1, beta_shift=shift)
    for node in (0, 1, count - 1):  # the one that is the largest
        nodes = tuple(65536 if index == 2 * node else 1 for index in range(2 * (NODE_MASK + 2)))
        yield law(1, beta_factor=1, beta_shift=6, nodes=nodes)
    for shift in (31, 32):
        yield law(1, reciprocal_shift=shift)
    limit = block.compare_limit
    for counts in (limit, limit + 1):
        yield law(1, quotient_limit=counts * 2, reciprocal=2**31)
        yield law(max(limit // 8, 1), offset=INT32, quotient_limit=counts * 2, reciprocal=2**31)
    yield law(1, quotient_limit=INT32, reciprocal=0)
    yield law(1, quotient_limit=INT32 + 1, reciprocal=0)
    for tested in (2**30 - 1, 2**30):
        yield law(1, tested_to=tested)
    span = max(side.span for side in block.sides) * block.transition_codes
    for slope in (INT32 // span, INT32 // span + 1):
        yield law(1, slope=slope, offset=0)
        yield law(1, slope=-slope % 2**32, offset=0, linear=slope * built.beta_step)
        yield law(1, slope=-slope % 2**32, offset=0, linear=max(slope * built.beta_step - 1, 0))
        yield law(1, slope=slope, offset=max(INT32 - slope * span, 0))
        yield law(1, slope=slope, offset=max(INT32 - slope * span + 1, 0))
    for offset in (INT32, INT32 + 1):
        yield law(1, offset=offset)
    codes = block.transition_codes
    for lowered in (0, 1):
        yield law(1, offset=5 * codes, transition=5 + lowered)
    yield law(most, 1, offset=1, transition=INT32 // codes)
    falling = {"slope": -(INT32 // span) % 2**32, "offset": INT32, "reciprocal": 2**31}
    yield law(max(limit // 16, 1), quotient_limit=2 * limit, **falling)
    for over in (0, 1):
        yield law(1, half=2**63 - 1 - built.beta_step + over)
        of_beta = most * built.beta_step * INT32
        yield law(most, offset=INT32, half=2**63 - 1 - of_beta + over)
        yield law(1, offset=0, linear=2**32 - 1, half=2**63 - 1 - (2**32 - 1) * span + over)
        yield law(1, offset=0, linear=(2**63 - 1) // span + over)
        yield law(1, offset=0, linear=((2**31 - 1 + over) << 32) // span + over)


def play_corners(block, built):
    """Plays of a short command: travel, width and nodes at their limits."""
    room = min(side.span for side in block.sides if side.span)

    def play(codes: int = 8, transition: int = 1, span: int = room, width: int = 5, **changes):
        made = replace(block, zero_band=0, leave_zero=0, transition_codes=transition, play_codes=codes,
                       play_shift=(codes * transition).bit_length() - 1, play_step_shift=12, play_noise=0)  # fmt: skip
        sides = {"span": span, "room": span, "band_end": block.command_zero, "play": (width,) * 17, "transition": 0}
        return replace(with_sides(made, sides), **changes)

    yield from (play(codes) for codes in (1, 2, 31, 32, 33, 64))
    yield play(width=0)
    yield from (play(play_noise=noise) for noise in (4095, 4096))
    yield from (play(play_step_shift=shift, span=min(16 << shift, room)) for shift in range(17))
    yield from (play(play_step_shift=shift, span=min((17 << shift) - 1, room)) for shift in range(8))
    yield from (play(play_step_shift=shift, span=min(17 << shift, room)) for shift in range(8))
    yield from (play(1, play_shift=shift) for shift in (0, 1, 31, 32))
    yield from (play(play_shift=shift) for shift in (2, 4, 3 + 32))
    for place in (0, 1, 8, 16):
        for width in (32767, 32768):
            wide = play(32, 2048)  # which a short command has no room for: the law's bit is set too
            widths = (0,) * place + (width,) + (0,) * (16 - place)
            made = with_sides(wide, {"play": widths})
            yield from (made, replace(made, sides=(made.sides[0], block.sides[1])))


def with_sides(block, change):
    """The block with every side changed alike."""
    return replace(block, sides=tuple(replace(side, **change) for side in block.sides))


def with_sensors(block, changes):
    """The block with some of its sensors changed, by their places."""
    sensors = enumerate(block.sensors)
    return replace(block, sensors=tuple(replace(sensor, **changes.get(place, {})) for place, sensor in sensors))


def sensors_of(block, sign):
    """The sensors ahead and behind, for one sign of command."""
    built = BuiltFor(shape=block.shape, code_max=0, compare_max=0, sample_Hz=0, tick_Hz=0, beta_step=0, samples=0)
    return tuple(block.sensors["ABC".index(name)] for name in built.pair(sign))


def rebalanced(block):
    """The block with what the differences of its sides are without pressures."""
    sides = []
    for sign, side in zip((1, -1), block.sides, strict=True):
        ahead, behind = sensors_of(block, sign)
        sides.append(replace(side, balance=((ahead.zero << 12) - behind.zero * side.weight) % 2**32))
    return replace(block, sides=tuple(sides))
