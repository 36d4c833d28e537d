"""Pulses and shapers on plants that are not what they were designed for."""
