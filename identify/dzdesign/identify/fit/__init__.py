"""Fit: thresholds of the single ramps enter; per branch a curve over the pressure drop and its certified bound leave.

One statement holds them together: the offset is the largest that no threshold allowed by data and premise contradicts.
A premise about the curve, a constant of the tests of scatter, or a row of the programme is changed in one place each.
"""
