"""What a report calls its valve: type and serial number, as the record of the tests has them."""

from collections.abc import Mapping

#: How a record may name them, in the words of those who keep one; case, dashes and blanks do not count.
SERIAL = (
    "serial", "serial number", "serial no", "serial no.", "s/n", "sn", "seriennummer", "serien nr", "serien nr.",
    "fabrik nr", "fabrik nr.",
)  # fmt: skip
TYPE = (
    "type", "valve type", "valve", "model", "part number", "part no", "part no.", "typ", "ventiltyp", "ventil",
    "type code", "typschluessel", "typschlüssel",
)  # fmt: skip


def valve_name(record: Mapping[str, str]) -> str:
    """Return the valve's type and serial number, as far as the record has them; empty if it has neither.

    Examples
    --------
    >>> valve_name({"Serial-No": "4711", "type": "4WRA 10"}), valve_name({"oil": "HLP 46"})
    ('4WRA 10, serial number 4711', '')
    >>> valve_name({"S/N": "4711"}), valve_name({"valve": "bench example"})
    ('Valve, serial number 4711', 'Valve: bench example')
    """
    serial, kind = (_first(record, names) for names in (SERIAL, TYPE))
    if serial:
        return f"{kind or 'Valve'}, serial number {serial}"
    return f"Valve: {kind}" if kind else ""


def _first(record: Mapping[str, str], names: tuple[str, ...]) -> str:
    known = {" ".join(name.lower().replace("-", " ").replace("_", " ").split()): text for name, text in record.items()}
    return next((known[name] for name in names if name in known), "")
