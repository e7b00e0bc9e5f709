"""The text of the core's files without a firmware around it."""

from collections.abc import Mapping, Sequence

from dzdesign.core.display import strict_templates


def texts(files: Mapping[str, Mapping[str, object]], banner: Sequence[str] = ()) -> dict[str, str]:
    """Return the text of each file, by name."""
    templates = strict_templates("dzdesign.codegen.core", "dzdesign.codegen", autoescape=False)
    return {name: templates.get_template(f"{name}.jinja").render(banner=banner, **values) for name, values in
            files.items()}  # fmt: skip
