"""Calibration files read and written by the document of their format alone: no code of dzdesign, and not by bincopy."""

import struct
import zlib

#: Word at which a member begins, and how struct reads it; from docs/reference/calibration.md.
MEMBERS = {
    "magic": (0, "4s"), "layout": (2, "<H"), "length": (3, "<H"), "shape": (4, "<H"), "code_max": (5, "<H"),
    "compare_max": (6, "<H"), "sample_Hz": (7, "<H"), "tick_Hz": (8, "<H"), "sha256": (10, "32s"),
    "serial": (26, "24s"), "record": (38, "48s"), "u_max_uV": (62, "<I"), "a_span_Pa": (64, "<I"),
    "a_full": (66, "<H"), "command_zero": (84, "<H"),
}  # fmt: skip


def hex_memory(text: str, *, of_words: bool) -> dict[int, int]:
    """Return address -> octet of Intel HEX; of words twice the word's address and one more for its high octet."""
    memory, upper, rows = {}, 0, text.splitlines()
    assert rows[-1] == ":00000001FF"
    for row in rows[:-1]:
        record = bytes.fromhex(row.removeprefix(":"))
        assert row.startswith(":") and sum(record) % 256 == 0 and len(record) == record[0] + 5
        at, kind, data = int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
        if kind == 4:
            upper = int.from_bytes(data, "big") << 16
            continue
        assert kind == 0 and at + len(data) // (2 if of_words else 1) <= 1 << 16
        for place, octet in enumerate(data):
            address = 2 * (upper + at) + (place ^ 1) if of_words else upper + at + place
            assert address not in memory
            memory[address] = octet
    return memory


def hex_text(*runs: tuple[int, bytes]) -> str:
    """Return Intel HEX of runs of octets, each with its address."""

    def record(at: int, kind: int, data: bytes) -> str:
        octets = bytes((len(data), *at.to_bytes(2, "big"), kind, *data))
        return f":{octets.hex()}{-sum(octets) % 256:02x}\n".upper()

    rows = [(begin + at, octets[at : at + 16]) for begin, octets in runs for at in range(0, len(octets), 16)]
    lines = (record(0, 4, (at >> 16).to_bytes(2, "big")) + record(at % (1 << 16), 0, row) for at, row in rows)
    return "".join((*lines, ":00000001FF\n"))


def members_of(octets: bytes) -> dict[str, object]:
    """Return some members of a block, whose CRC-32 must be right."""
    *_, crc = struct.unpack(f"<{len(octets) - 4}sI", octets)
    assert zlib.crc32(octets[:-4]) == crc
    found = {name: struct.unpack_from(form, octets, 2 * at)[0] for name, (at, form) in MEMBERS.items()}
    return {name: value.rstrip(b"\0") if isinstance(value, bytes) else value for name, value in found.items()}
