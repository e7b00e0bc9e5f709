"""Rendering of templates: a name without a value fails, and blocks leave no blank lines."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2


def strict_templates(*packages: str, **syntax: Any) -> "jinja2.Environment":
    """Return a renderer of the folders `templates` of some packages, the first one first.

    `syntax` goes to Jinja: escaping, delimiters, the filter of what is printed.
    """
    import jinja2

    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, "templates") for name in packages]),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        **syntax,
    )
