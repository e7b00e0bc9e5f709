"""Derivation: the paper's premises enter; re-derived equations with verdicts, and the law, leave.

The law (14)/(18) is stated here once (`law.py`); design, codegen's documentation and verify take it from
here. `proof.py` judges statements and may not know any; new ones go into `premises.py`, `equations.py` or
`theorems.py`.
"""

if __name__ != "dzdesign.derivation":
    raise ImportError("import this room as dzdesign.derivation: a top-level 'derivation' may be another package")
