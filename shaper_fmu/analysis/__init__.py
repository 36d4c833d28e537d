"""Numbers from responses: residual vibration and its relatives."""
