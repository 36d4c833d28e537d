"""Verifies the chosen shaper on the plant itself."""
