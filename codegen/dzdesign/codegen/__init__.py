"""Codegen: a `Compensator` and a target enter, a folder of C with its manifest leaves.

One folder a target; the core `dz_comp` is common to all of them. A new target is a folder with `__init__.py`, a
`target.py` that has a `TARGET`, and `templates/`; its three rows in pyproject.toml; and its goldens (`make goldens`).
"""
