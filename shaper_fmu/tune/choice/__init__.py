"""The choice of a shaper: candidates, what each may leave, and the reasons."""
