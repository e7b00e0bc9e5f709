"""Ceiling of the offset: a certified curve and an allowance in, its exact limit at every difference of codes out."""
