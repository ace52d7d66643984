"""Synthetic ground and void masks with known properties, for the tests of filling."""

import numpy as np


def fractal(shape=(257, 257), *, seed=0, relief=1000.0, exponent=2.0):
    """Fractal ground by spectral synthesis, float64 from 0 to ``relief``.

    The amplitude of a wave falls with the power ``exponent`` of its frequency: 2 is a surface of
    Hurst exponent 1, as smooth as high mountains are at 90 m.
    """
    rng = np.random.default_rng(seed)
    side = 2 * max(shape)  # the half that is cut off would wrap around
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    frequency[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal((side, side))) / frequency**exponent
    ground = np.fft.irfft2(spectrum, (side, side))[: shape[0], : shape[1]]
    return (ground - ground.min()) * (relief / np.ptp(ground))


def plane(shape, slope=(3.0, -2.0), height=500.0):
    """A plane that rises by ``slope`` a row and a column."""
    return height + np.add.outer(slope[0] * np.arange(shape[0]), slope[1] * np.arange(shape[1]))


def holed(shape, *boxes):
    """A mask with rectangular voids: (first row, end row, first column, end column) each."""
    void = np.zeros(shape, bool)
    for top, bottom, left, right in boxes:
        void[top:bottom, left:right] = True
    return void


def disc(shape, centre, radius):
    """A mask with one round void."""
    row, column = np.ogrid[: shape[0], : shape[1]]
    return (row - centre[0]) ** 2 + (column - centre[1]) ** 2 <= radius**2


def diagonal_stripes(shape, *, spacing=25, width=4):
    """Narrow parallel gaps, such as those of a Landsat 7 scene after its scan line corrector."""
    row, column = np.indices(shape)
    return (row + column // 4) % spacing < width


def river(shape, *, seed=0):
    """One void a cell wide that wanders from the first row to the last."""
    rng = np.random.default_rng(seed)
    void = np.zeros(shape, bool)
    column = shape[1] // 2
    for row in range(shape[0]):
        to = int(np.clip(column + rng.integers(-2, 3), 1, shape[1] - 2))
        void[row, min(column, to) : max(column, to) + 1] = True
        column = to
    return void


def circle_and_segments(levels=7, *, low=0.0, medium=500.0, high=1000.0):
    """The paper's figures 5 and 8: a circle on the middle and four segments on the diagonals.

    Only the ground of the circle (``high``), of the segments (``medium``) and of the frame
    (``low``) is known. One segment stands a cell beside its diagonal.

    Returns
    -------
    values, known : (2**levels + 1) squared arrays
    """
    side = 2**levels + 1
    middle = side // 2
    row, column = np.indices((side, side)) - middle
    circle = np.rint(np.hypot(row, column)) == side // 4
    reach = np.hypot(row, column)
    segment = (reach > 0.32 * side) & (reach < 0.42 * side)
    diagonal = (abs(row) == abs(column)) & segment
    upper_left = diagonal & (row < 0) & (column < 0)
    diagonal = (diagonal & ~upper_left) | np.roll(upper_left, -1, axis=1)
    values = np.full((side, side), low)
    values[diagonal] = medium
    values[circle] = high
    known = circle | diagonal
    known[[0, -1]] = known[:, [0, -1]] = True
    return values, known
