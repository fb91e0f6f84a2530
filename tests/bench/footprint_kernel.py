#!/usr/bin/env python3
"""Fits the table of libglint/query/detail/pyramid/footprint_kernel.h and prints its rows.

The NDF images of a level are weighed by a kernel of the distance d between a place and the centre of an image. Distances are in
gaps between centres, and the kernel is 0 from d = 2 on. An image sees a Gaussian footprint, so the weighed sum of images sees a
sum of Gaussians. The fit makes this sum as near as possible to the Gaussian that was asked for: it minimises the squared
difference of both on the plane, averaged over places.

The kernel has one polynomial for d in [0, 1] and one for d - 1 in [0, 1]. It is not negative, its slope is continuous, and the
weights of the four centres around a place sum to 1.
"""

import numpy as np
from scipy.optimize import minimize

TERMS = 6  # of a polynomial
NODES = 17  # variances that are fitted
NODES_PER_VARIANCE = 8
GAP = np.sqrt(12) / 1.5 / np.sqrt(2)  # deviations of a footprint in a gap, at an overlap of sqrt(2)
PLACES = (np.arange(24) + 0.5) / 24


def powers(t):
    return np.array([np.power(t, k) for k in range(TERMS)])


def weights(polynomials, t):
    """Weights of the four centres around a place at t in [0, 1] between the middle two: [4][places]."""
    inner, outer = polynomials[:TERMS], polynomials[TERMS:]
    return np.array([outer @ powers(t), inner @ powers(t), inner @ powers(1 - t), outer @ powers(1 - t)])


def squared_error(polynomials, sigma):
    """Squared relative error on the plane, mean over places; images have deviation 1, the footprint has `sigma`."""

    def product(distance, variance):  # integral of the product of two Gaussians
        return np.exp(-distance * distance / (2 * variance)) / np.sqrt(2 * np.pi * variance)

    w = weights(polynomials, PLACES)
    centres = np.arange(-1, 3) * GAP
    images = product(centres[:, None] - centres[None, :], 2.0)
    own = np.einsum("it,ij,jt->t", w, images, w).mean()
    cross = (w * product(centres[:, None] - PLACES[None, :] * GAP, 1 + sigma * sigma)).sum(0).mean()
    asked = product(0, 2 * sigma * sigma)
    return (own * own - 2 * cross * cross + asked * asked) / asked**2


def constraints():
    """Rows and right sides of the equations that polynomials satisfy."""
    zero, value0, slope0 = np.zeros(TERMS), powers(0.0), np.eye(TERMS)[1]
    value1, slope1 = powers(1.0), np.arange(TERMS) * 1.0
    rows = [np.tile(powers(t) + powers(1 - t), 2) for t in np.linspace(0, 0.5, 4)]  # the sum is 1
    rows += [np.r_[zero, value1], np.r_[value1, -value0]]  # 0 at d = 2, continuous at d = 1
    rows += [np.r_[slope0, zero], np.r_[slope1, -slope0], np.r_[zero, slope1]]  # slopes at d = 0, 1 and 2
    return np.array(rows), np.r_[np.ones(4), np.zeros(5)]


def fitted(variance):
    """Polynomials for a footprint whose variance exceeds that of the images by `variance` squares of the gap."""
    rows, right = constraints()
    _, values, basis = np.linalg.svd(rows)
    free = basis[(values > 1e-10).sum() :].T
    fixed = np.linalg.lstsq(rows, right, rcond=None)[0]
    zero, t = np.zeros(TERMS), np.linspace(0, 1, 33)
    kernel = np.array([np.r_[powers(x), zero] for x in t] + [np.r_[zero, powers(x)] for x in t])
    start = np.r_[4 / 6, 0, -1, 0.5, 0, 0, 1 / 6, -0.5, 0.5, -1 / 6, 0, 0]  # the cubic B-spline
    sigma = np.sqrt(1 + variance * GAP * GAP)
    result = minimize(
        lambda x: squared_error(fixed + free @ x, sigma),
        free.T @ (start - fixed),
        constraints=[{"type": "ineq", "fun": lambda x: kernel @ (fixed + free @ x), "jac": lambda x: kernel @ free}],
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-12},
    )
    return fixed + free @ result.x


def main():
    for node in range(NODES):
        kernel = np.reshape(fitted(node / NODES_PER_VARIANCE), (2, TERMS)).T + 0.0
        pairs = [f"{{{inner:.7f}f, {outer:.7f}f}}".replace("-0.0000000", "0.0000000") for inner, outer in kernel]
        print(f"      {{{', '.join(pairs[:3])},\n       {', '.join(pairs[3:])}}},")


if __name__ == "__main__":
    main()
