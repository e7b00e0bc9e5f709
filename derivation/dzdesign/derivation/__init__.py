"""Derivation: the paper's equations and the theorems enter; verdicts with their derivations, and the law, leave.

`law.py`, `scaling.py` and `plant.py` state once what design, codegen and verify compute by, and `lowering.py` turns it
into functions. `proof.py` judges statements and may not know any; a new one goes beside its like, and `account.py` puts
all of them in order.
"""
