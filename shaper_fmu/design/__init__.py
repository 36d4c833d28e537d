"""Designing in Python: sequences and motions as objects, optimal shapers, mode selection, proofs; above the kernels."""
