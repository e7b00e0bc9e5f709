"""Sections of the report: tables and sentences."""
