"""Amplifier parameters: a certified compensator and a device file enter, the device's own text leaves.

A device is one file in `devices/`: its limits, its unit and where these are stated. A new one needs no code where its
format is there already.
"""
