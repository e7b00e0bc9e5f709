"""Calibration blocks: a `Compensator` enters, the integers of its firmware leave as one block of data with a CRC."""
