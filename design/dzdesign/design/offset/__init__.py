"""Certified curves, dither and machine in; what may be put out at every pressure code, and the table of beta, out.

All of it is exact: whole numbers over whole numbers, from the decimals of valve.json.
"""
