"""Modes from a measured response."""
