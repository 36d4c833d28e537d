"""Rest-to-rest profiles of unit distance, one a file; kernel functions of the time since the start."""
