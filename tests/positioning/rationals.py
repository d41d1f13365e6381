"""The Kalman update in exact rational arithmetic."""

from fractions import Fraction

import numpy as np


def exact(matrix):
    return [[Fraction(float(value)) for value in row] for row in np.atleast_2d(matrix)]


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in turned(b)]
            for row in a]  # fmt: skip


def turned(a):
    return [list(row) for row in zip(*a, strict=True)]


def total(a, b, sign=1):
    return [[x + sign * y for x, y in zip(r, q, strict=True)] for r, q in zip(a, b, strict=True)]


def inverse(a):
    size = len(a)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(size))] for i, row in enumerate(a)]
    for i in range(size):
        pivot = max(range(i, size), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for k in range(size):
            if k != i and rows[k][i]:
                factor = rows[k][i]
                rows[k] = [u - factor * v for u, v in zip(rows[k], rows[i], strict=True)]
    return [row[size:] for row in rows]


def kalman_step(phi, process, mean, covariance, model, reading):
    """Predict and update with the measurement linearised at the prediction."""
    p = total(product(product(exact(phi), exact(covariance)), turned(exact(phi))), exact(process))
    x = product(exact(phi), turned(exact(mean)))
    at = np.array([float(row[0]) for row in x])
    h = exact(model.jacobian(at))
    s = total(product(product(h, p), turned(h)), exact(model.covariance()))
    gain = product(product(p, turned(h)), inverse(s))
    residual = turned(total(exact(reading), exact(model.mean(at)), -1))
    x = total(x, product(gain, residual))
    p = total(p, product(product(gain, s), turned(gain)), -1)
    return (
        np.array([float(row[0]) for row in x]),
        np.array([[float(value) for value in row] for row in p]),
    )
