"""The report of a lot of valves."""
