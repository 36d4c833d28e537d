"""Computes residual vibration and other figures of merit from responses."""
