"""Fitting: knees of all tests enter; the constrained fits (CasADi) and the certified bounds leave."""
