"""The covariance of a raster's ground, as weights of squared differences and a noise.

Ground is taken as a Gaussian Markov field whose energy is a sum of squares of differences of all
orders from 1 to 4, along rows, columns and mixed, plus white noise on known cells. The weights are
those of greatest likelihood given the mean power spectrum of the ground (Whittle 1954, "On
stationary processes in the plane", Biometrika 41; Rue and Held 2005, "Gaussian Markov random
fields", ch. 2.6 and 5). A sum of squares has a smooth surface of least energy in every void, of
any outline, and is that field's expectation there.
"""

from dataclasses import dataclass

import numpy as np

HIGHEST = 4
_ORDERS = [(i, order - i) for order in range(1, HIGHEST + 1) for i in range(order, -1, -1)]
_SIDE = 128
_LEAST_SIDE = 32
_MOST_VOID = 0.15
_LOWEST = 3  # a taper smears what has fewer waves than this over its neighbours
_STEPS = 300
_NOISY = 0.05


@dataclass(frozen=True)
class Covariance:
    """A field's weights and noise.

    Attributes
    ----------
    weights : (5, 5) float64 array
        Of the squared difference of order i down and j across [1/m²].
    noise : float
        Variance of the noise of a known cell [m²]; 0 where it would change nothing.
    dx, dy : float
        Ground metres per cell for which the weights hold.
    """

    weights: np.ndarray
    noise: float
    dx: float
    dy: float

    def at(self, dx, dy):
        """Give the (N, 5, 5) weights at N rows with other ground metres per cell."""
        order = np.arange(HIGHEST + 1)
        down = (self.dy / np.asarray(dy)[:, None]) ** (2 * order)
        across = (self.dx / np.asarray(dx)[:, None]) ** (2 * order)
        return self.weights * down[:, :, None] * across[:, None, :]


def learn_covariance(windows):
    """Learn the covariance of the ground of some windows.

    Parameters
    ----------
    windows : list of (values, void, dx, dy)
        Elevations (h, w) without gaps, where they were voids, and ground metres per cell.

    Returns
    -------
    Covariance
        Of least bending, where there is too little ground to learn from.
    """
    dx = float(np.mean(np.concatenate([dx for _, _, dx, _ in windows])))
    dy = float(np.mean(np.concatenate([dy for _, _, _, dy in windows])))
    side = _SIDE
    while side >= _LEAST_SIDE:
        power = _mean_power(windows, side, (dy / dx) ** 2)
        if power is not None:
            return _most_likely(power, dx, dy)
        side //= 2
    aspect = (dy / dx) ** 2
    weights = np.zeros((HIGHEST + 1, HIGHEST + 1))
    weights[2, 0], weights[1, 1], weights[0, 2] = 1, 2 * aspect, aspect**2
    weights[1, 0], weights[0, 1] = 0.01, 0.01 * aspect
    return Covariance(weights, 0.0, dx, dy)


def _mean_power(windows, side, aspect):
    """Give the mean power of the Laplacian over square blocks, (side/2+1)² by frequency, or None.

    The Laplacian's spectrum is far flatter than the ground's, so less leaks through the taper.
    """
    taper = np.hanning(side + 1)[:side]
    taper = np.outer(taper, taper)
    taper /= np.sqrt((taper**2).mean())
    half = side // 2 + 1
    total, count = np.zeros((half, half)), 0
    for z, void, _, _ in windows:
        bent = np.zeros(z.shape)
        bent[1:-1, 1:-1] = (
            z[2:, 1:-1] + z[:-2, 1:-1] - 2 * (1 + aspect) * z[1:-1, 1:-1]
            + aspect * (z[1:-1, 2:] + z[1:-1, :-2])
        )  # fmt: skip
        for row, column in _corners(z.shape, side):
            block = slice(row, row + side), slice(column, column + side)
            if void[block].mean() > _MOST_VOID:
                continue
            wave = np.fft.rfft2((bent[block] - bent[block].mean()) * taper)
            power = wave.real**2 + wave.imag**2
            total[0] += power[0]
            total[half - 1] += power[half - 1]
            total[1 : half - 1] += (power[1 : half - 1] + power[: half - 1 : -1]) / 2
            count += 1
    return total / count / side**2 if count and total.any() else None


def _corners(shape, side):
    """Spread blocks over a window, within its outermost cells."""
    return [
        (row, column)
        for row in _begins(shape[0] - 2, side)
        for column in _begins(shape[1] - 2, side)
    ]


def _begins(length, side):
    if length < side:
        return []
    parts = -(-length // side)
    return [1 + round(k * (length - side) / max(parts - 1, 1)) for k in range(parts)]


def _most_likely(power, dx, dy):
    from scipy.optimize import minimize

    side = 2 * (power.shape[0] - 1)
    turn = 2 - 2 * np.cos(2 * np.pi * np.arange(power.shape[0]) / side)
    down, across = turn[:, None], turn[None, :]
    distance = np.hypot(*np.indices(power.shape))
    used = distance >= _LOWEST
    bend = (down + (dy / dx) ** 2 * across) ** 2
    observed = power[used] / bend[used]
    basis = np.array([(down**i * across**j)[used] for i, j in _ORDERS])
    share = 1 / distance[used]  # every octave counts about the same
    share /= share.sum()

    # einsum, for matrix products as small as these cost more in threads that wait for each other.
    def deviance(logs):
        weights, noise = np.exp(logs[:-1]), np.exp(logs[-1])
        energy = np.einsum("k,kf->f", weights, basis)
        expected = 1 / energy + noise
        slope = share * (1 / expected - observed / expected**2)
        value = float((share * (np.log(expected) + observed / expected)).sum())
        descent = -np.einsum("kf,f->k", basis, slope / energy**2) * weights
        return value, np.append(descent, slope.sum() * noise)

    sums = observed * basis.sum(axis=0)
    level = np.log(np.median(sums) + 1e-9 * sums.mean())  # half of them may be 0
    least = np.percentile(observed, 1) + 1e-9 * observed.mean()  # which is not 0
    start = np.append(np.full(len(_ORDERS), -level), np.log(0.3 * least))
    found = minimize(
        deviance, start, jac=True, method="L-BFGS-B", options=dict(maxiter=_STEPS),
        bounds=[(x - 25, x + 12) for x in start],
    )  # fmt: skip
    weights = np.zeros((HIGHEST + 1, HIGHEST + 1))
    weights[tuple(np.transpose(_ORDERS))] = np.exp(found.x[:-1])
    noise = float(np.exp(found.x[-1]))
    return Covariance(weights, noise if noise * weights.sum() > _NOISY else 0.0, dx, dy)
