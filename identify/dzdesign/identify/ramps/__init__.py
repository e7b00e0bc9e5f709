"""Ramps: recordings enter; ramps parted at the turning points, in branches and bins, pooled by pressure drop, leave."""
