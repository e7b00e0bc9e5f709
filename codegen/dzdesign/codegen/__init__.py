"""Codegen: a `Compensator` and a target enter, a folder of C with its manifest leaves.

One folder per target; `core/` holds what all of them share. A new target is a folder with `__init__.py`, a `target.py`
that has a `TARGET`, and `templates/`: docs/howto/add-target.md adds one.
"""
