"""Robustness sweeps: study, engines and store."""
