"""Design of impulse sequences, one method a file; kernel functions over arrays `amplitude` [-] and `delay` [s]."""
