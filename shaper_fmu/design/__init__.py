"""Designs commands in Python: sequences and motions as objects, optimal shapers, mode selection and proven bounds."""
