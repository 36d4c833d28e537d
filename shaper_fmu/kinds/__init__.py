"""Enumerations and dispatch functions of shapers, profiles and pulse designs, generated from the methods' records."""
