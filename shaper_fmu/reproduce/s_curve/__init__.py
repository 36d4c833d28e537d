"""S-curve profiles."""
