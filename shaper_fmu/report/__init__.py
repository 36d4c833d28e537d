"""Writes reports with tables and figures."""
