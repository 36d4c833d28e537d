"""The report of a sweep, with one file per figure."""
