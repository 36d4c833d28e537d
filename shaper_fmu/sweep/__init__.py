"""Robustness sweeps: study, store, engine."""
