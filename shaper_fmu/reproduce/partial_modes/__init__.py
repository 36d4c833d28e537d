"""Shaping only part of the modes."""
