"""Two-part profiles."""
