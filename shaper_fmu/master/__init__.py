"""Couples FMUs: the system, its stepping loop and its results."""
