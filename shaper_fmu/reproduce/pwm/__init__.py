"""Pulse-width modulated commands."""
