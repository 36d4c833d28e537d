"""Worker processes that do parts of a tuning's experiments."""
