"""Codegen: a `Compensator` and a target enter, a folder of C with its manifest leaves.

One folder a target; the core `dz_comp` is common to all of them. A new target is a folder with `__init__.py`, a
`target.py` that has a `TARGET`, and `templates/`; its three rows in pyproject.toml; and its goldens (`make goldens`).
"""

if __name__ != "dzdesign.codegen":
    raise ImportError("import this room as dzdesign.codegen: a top-level 'codegen' may be another package")
