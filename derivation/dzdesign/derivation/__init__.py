"""Derivation: the paper's equations and the theorems enter; verdicts with their derivations, and the law, leave.

`laws/`, `scaling.py` and `plant.py` state once what design, codegen and verify compute by, and `lowering.py` turns it
into functions. `account/` proves statements: its `proof.py` may not know any, its `account.py` puts all of them in
order. `presentation/` writes what was found.
"""
