"""The C by which a drive takes a calibration block over its serial line."""

from collections.abc import Callable, Sequence

from dzdesign.codegen.loading.protocol import protocol_context
from dzdesign.core.strict_templates import strict_templates

SOURCES = ("dz_load.c", "dz_load_requests.c", "dz_load_reply.c", "dz_load_frame.c", "dz_slots.c")
HEADERS = ("dz_load.h", "dz_load_steps.h", "dz_load_frame.h", "dz_slots.h")
#: Where the blocks are kept: RAM, until the user writes their memory's.
STORE = ("dz_store.c", "dz_store.h")
LOAD_FILES = (*SOURCES, *HEADERS, *STORE)


def load_texts(tick_Hz: int, banner: Callable[[str], Sequence[str]]) -> dict[str, str]:
    """Return the text of each file by name, for a tick of so many a second; `banner` gives a file's first lines."""
    templates = strict_templates("dzdesign.codegen.loading", "dzdesign.codegen", autoescape=False)
    values = protocol_context(tick_Hz)
    texts = {}
    for name in LOAD_FILES:
        texts[name] = templates.get_template(f"{name}.jinja").render(banner=banner(name), **values)
    return texts
