"""Modes of a plant from experiments with its FMU."""
