"""Analysis: Frama-C, mutants, other machine code, state kept between calls."""
