"""Builds FMUs from components."""
