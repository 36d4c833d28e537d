"""Identifies the modes of a plant: by experiments on its FMU, by linearization, or from a measured response."""
