"""Command generator components, one file each."""
