"""A lot: many valves' models enter; one setting that over-compensates none of them leaves, with each valve's margin."""
