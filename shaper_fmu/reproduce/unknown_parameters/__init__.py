"""Pulses and shapers on plants that differ from the model they were designed for."""
