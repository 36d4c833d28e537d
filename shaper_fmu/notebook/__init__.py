"""What objects show of themselves in a notebook and at the prompt: short texts, small tables, plots."""
