"""Linear programmes for impulse sequences, and the methods that refine their solutions to exact ones."""
