"""Linear equations in a flat array, for kernels."""

from __future__ import annotations


def solve_linear(matrix, size: int) -> bool:
    """Solve the `size` equations in `matrix`, rows of size + 1 numbers with the right side last; it is overwritten.

    The solution is left in the last number of each row. False if the matrix is singular.
    """
    width = size + 1
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i * width + k]) > abs(matrix[pivot * width + k]):
                pivot = i
        if not abs(matrix[pivot * width + k]) > 0.0:
            return False
        for j in range(k, width):
            kept = matrix[k * width + j]
            matrix[k * width + j] = matrix[pivot * width + j]
            matrix[pivot * width + j] = kept
        for i in range(size):
            if i != k:
                factor = matrix[i * width + k] / matrix[k * width + k]
                for j in range(k, width):
                    matrix[i * width + j] -= factor * matrix[k * width + j]
    for k in range(size):
        matrix[k * width + size] /= matrix[k * width + k]
    return True
