"""Coil, sensor and supply in, the integers of a current loop and its margins out."""
