"""A compensator in, a function block in Structured Text out, and the same as PLCopen XML."""
