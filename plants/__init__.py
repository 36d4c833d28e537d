"""Plant components, one file each."""
