"""Closed loop: the compiled core with the CasADi plant; ramps, scenarios, tolerances."""
