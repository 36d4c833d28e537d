"""Modes of a plant from its directional derivatives or differences."""
