"""The serial line: what the frames of the telemetry say, and when a block is taken: at zero command, the output held.

A frame, its most significant octets first: sync, version, octets of the payload; ticks, start of the compensator's
hash, codes, beta, compare values and status; CRC-16/IBM-3740 of all but sync. A request to load a block is alike.
"""

from binascii import crc_hqx
from struct import Struct, pack

from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.hardware.model import Bench, Due, Step, Trace

FRAME, FRAME_BEGINS, FRAMES_HZ = Struct(">HBBI10H"), b"\xa5\x5a\x03\x16", 100
NAMES = (
    "origin", "command", "pressure A", "pressure B", "pressure C", "beta", "compare value A", "compare value B",
    "status",
)  # fmt: skip
RELEASED = 0x0080
#: Nominal bits per second, what a receiver bears, and the bits of an octet.
BAUD, BAUD_ERROR, OCTET_BITS = 115_200, 0.02, 10
#: Begins a load; a reply says so with a bit more. Reasons to refuse it: the drive moves, the command is not zero.
REQUEST_BEGINS, REPLY_BEGINS, TAKEN, REFUSED = b"\xc3\x3c\x01\x01", b"\xc3\x3c\x81\x01", {0}, {5, 6}
REASON_AT = 5


def _crc(octets: bytes) -> int:
    return crc_hqx(octets[2:], 0xFFFF)


def load_begins(bench: Bench, at_us: float) -> list[Step]:
    """Return the steps of a PC that begins to load a block, the one of the firmware; the last octet comes then."""
    if not bench.block:
        return []
    request = REQUEST_BEGINS + pack(">BH", 10, len(bench.block) // 2) + bench.block[-4:] + bytes(4)
    request += pack(">H", _crc(request))
    octet_us = 1e6 * OCTET_BITS / BAUD
    return [
        Step(at_us - place * octet_us, "octet", octet, bench.board["SCI_RX_GPIO"])
        for place, octet in enumerate(reversed(request))
    ]


def _reply(octets: bytes) -> tuple[int, set[int]]:
    """Return the place of the reply to a load's begin, -1 without one, and its reason."""
    reply = octets.find(REPLY_BEGINS)
    return reply, set(octets[reply + REASON_AT : reply + REASON_AT + 1]) if reply >= 0 else set()


def load_fault(bench: Bench, trace: Trace, asked_us: float) -> str:
    """Return what is wrong in a run at zero command where a load begins at a time, just after an interrupt, or nothing.

    Memory is erased before the reply, and the interrupt can't read a flash that is being erased: it holds the output
    first.
    """
    sent = [each for each in trace.events if each[1:3] == ("octet", bench.board["SCI_TX_GPIO"])]
    reply, reason = _reply(bytes(each.two for each in sent))
    if reason != TAKEN:
        return "a calibration block is not taken at zero command"
    replied, asked = sent[reply].at, trace.count_at(asked_us)
    if not any(asked < at < replied for at in trace.times("interrupt")):
        return "the memory for a calibration block is erased before the interrupt holds the output"
    for gpio in bench.pins:
        if trace.pin(gpio).not_low_from(replied, trace.end) is not None:
            return f"GPIO{gpio} is not low while a calibration block is loaded"
    return ""


def line_fault(bench: Bench, trace: Trace, due: list[Due]) -> str:
    """Return what is wrong on the line of a run, with what was due at each interrupt, or nothing."""
    gpio = bench.board["SCI_TX_GPIO"]
    sent, paces = ([each.two for each in trace.events if each[1:3] == (word, gpio)] for word in ("octet", "pace"))
    if not sent:
        return f"the telemetry does not leave on GPIO{gpio}"
    for pace in paces:
        baud = OCTET_BITS * trace.clock_Hz / pace
        if abs(baud / BAUD - 1) > BAUD_ERROR:
            return f"an octet takes as long as {OCTET_BITS} bits at {baud:.0f} bit/s, expected {BAUD} bit/s"
    octets = bytes(sent)
    if bench.block and not _reply(octets)[1] & REFUSED:
        return "a calibration block is not refused while the valve is driven"
    laws = {sign: ExactLaw(bench.compensator, sign) for sign in bench.compensator.signals.signs}
    frames, at = 0, octets.find(FRAME_BEGINS)
    while 0 <= at <= len(octets) - FRAME.size:
        frame = octets[at : at + FRAME.size]
        _, _, _, ticks, *says, crc = FRAME.unpack(frame)
        if crc != _crc(frame[:-2]) or not 0 < ticks <= len(due):
            return f"frame {frames + 1} of the telemetry has a wrong CRC or time"
        known = due[ticks - 1]
        command, *pressures = known.codes
        pair = bench.compensator.signals.negative_pair if known.side < 0 else "AB"
        law = laws[known.side or 1].answer(command, *(pressures["ABC".index(name)] for name in pair))
        pressures += [0] * (3 - len(pressures))
        state = (known.status | law.status) << 8 | RELEASED * known.released
        expected = (bench.origin, command, *pressures, law.beta, *known.compares, state)
        for name, said, wanted in zip(NAMES, says, expected, strict=True):
            if said != wanted:
                return f"the telemetry says {name} {said} after {ticks} interrupts, expected {wanted}"
        frames, at = frames + 1, octets.find(FRAME_BEGINS, at + FRAME.size)
    fewest = int((trace.end - trace.start) / trace.clock_Hz * FRAMES_HZ) - 1
    return (
        "" if frames >= fewest else f"{frames} frames in {trace.ms_of(trace.end):.1f} ms, expected {FRAMES_HZ} a second"
    )
