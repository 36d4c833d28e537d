"""The report of a tuned shaper, and all that `tune` writes."""
