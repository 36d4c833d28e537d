"""The report of a sweep: one file a figure."""
