"""Fixed compensation: a certified compensator in, the largest offset that needs no pressure out, and what it leaves."""
