"""The choice of a shaper: candidates, bounds of their residual vibration, and reasons."""
