"""The text of the core's files without a firmware around it."""

from collections.abc import Mapping, Sequence

from dzdesign.codegen.core.constants import CoreFile
from dzdesign.core.strict_templates import strict_templates


def texts(files: Mapping[str, CoreFile], banner: Sequence[str] = ()) -> dict[str, str]:
    """Return the text of each file, by name."""
    templates = strict_templates("dzdesign.codegen.core", "dzdesign.codegen", autoescape=False)
    return {name: templates.get_template(file.template).render(banner=banner, **file.values) for name, file in
            files.items()}  # fmt: skip
