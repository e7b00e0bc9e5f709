"""What generated files say of a lot setting: of how many valves it is, and whose recordings it shows."""

from dataclasses import dataclass

from dzdesign.codegen.comment_text import printable_name
from dzdesign.design.compensator import Compensator


@dataclass(frozen=True, slots=True, kw_only=True)
class LotInWords:
    """The same in one line of a banner, in a paragraph of Markdown and in a sentence beside the certificate."""

    #: The valve that compensator.json holds.
    carrier: str
    banner: str
    readme: str
    certificate: str


def lot_in_words(compensator: Compensator) -> LotInWords | None:
    """Return the words on a lot setting; None of a valve's own."""
    count = len(compensator.lot)
    if not count:
        return None
    digest = compensator.valve_json_sha256
    names = [printable_name(each.name) for each in compensator.lot if each.valve_sha256 == digest]
    carrier = f"Valve {names[0]}" if names else "One valve"
    return LotInWords(
        carrier=carrier,
        banner=f"LOT SETTING of {count} valves, lot SHA-256 {compensator.lot_sha256}.",
        readme=f"**This is a lot setting of {count} valves**, not one valve's own.\n"
        f"Lot SHA-256: {compensator.lot_sha256}. Recordings and certificate that these files name are those of one\n"
        f"of them, the carrier: {carrier[0].lower()}{carrier[1:]}. `../compensator.json` lists all under `lot`.",
        certificate=f"The certificate is that of one of the {count} valves of this lot setting, "
        f"{carrier[0].lower()}{carrier[1:]}; of the others codegen proved the same under their own bounds.",
    )
