"""The modes of a plant: from experiments with its FMU, its linearization, or a measured response."""
