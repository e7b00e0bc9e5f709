"""Plots of an identified valve."""
