"""Checks the native plant: scenes in, its distance from CasADi's integrator out; shares no code with its motion."""
