"""The report of a tuning, and all other files that `tune` writes."""
