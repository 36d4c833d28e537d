"""The fastest move without vibration: a linear programme on a grid, its dual as proof, and exact switches."""
