"""Declared coil, supply, sensors and oil enter; by what they lower the offset, and the table of it, leave."""
