"""Tunes shapers for plants: identifies modes by experiments on FMUs or from measured responses, and chooses a shaper."""
