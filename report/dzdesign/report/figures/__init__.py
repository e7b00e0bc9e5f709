"""Figures of the report: SVG that takes its colours from the page."""
