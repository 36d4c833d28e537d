"""The chosen shaper before the plant itself."""
