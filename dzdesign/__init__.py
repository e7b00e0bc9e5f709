"""Dead-zone compensators for proportional valves without a spool-position sensor."""

__version__ = "0.1.0"
