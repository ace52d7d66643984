"""Maps: parameters of MCMD that change from cell to cell."""

from dataclasses import dataclass, fields

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.options import specifications


@dataclass(frozen=True, kw_only=True)
class Maps:
    """Parameters of `McmdOptions` by cell: each an (H, W) array, or None for the option's number.

    Cells that are NaN or masked have the option's number. Cells of the lattice beyond the raster
    have the value of the raster's nearest cell.

    Attributes
    ----------
    l, l_bu : (H, W) array or None
        Curves of the top-down and bottom-up passes, read where an elevation arrives: at the
        midpoint from above, at the ascendant from below.
    h, r_s, r_t : (H, W) array or None
        Exponent, strength and shift of the displacements, read at the displaced cell. A map of
        ``r_s`` turns displacements on, whatever the option says.

    Examples
    --------
    Ground that is rough in the east only:

    >>> r_s = np.zeros((4, 6))
    >>> r_s[:, 3:] = 0.2
    >>> Maps(r_s=r_s).over(McmdOptions(h=0.4), (4, 6)).h
    0.4
    """

    l: np.ndarray | None = None  # noqa: E741, the paper's name
    l_bu: np.ndarray | None = None
    h: np.ndarray | None = None
    r_s: np.ndarray | None = None
    r_t: np.ndarray | None = None

    def refuse_curves(self, variant):
        """Raise `InputError` if ``l`` or ``l_bu`` bends, for a variant that has no such curve."""
        if np.any(self.l) or np.any(self.l_bu):
            raise InputError(
                f"l and l_bu bend the variants 'weighted' and 'paper'; '{variant}' has no such "
                "curve"
            )

    def over(self, options, shape):
        """Lay the maps over the numbers of options.

        Parameters
        ----------
        options : McmdOptions
        shape : (int, int)
            The raster's.

        Returns
        -------
        Maps
            Each field a number, or a float64 array without NaN.

        Raises
        ------
        InputError
            If a map is not of numbers or of another shape, or a value is out of its option's
            range.
        """
        laid = {}
        for spec in _mapped():
            laid[spec.name] = getattr(options, spec.name)
            values = getattr(self, spec.name)
            if values is not None:
                laid[spec.name] = _in_range(spec, _numbers(spec, values, shape), laid[spec.name])
        return Maps(**laid)


MAP_NAMES = tuple(field.name for field in fields(Maps))


def as_map(parameter, shape):
    """Make ready for kernels a parameter that is one number or a map.

    Parameters
    ----------
    parameter : float or (H, W) array
    shape : (int, int)
        The raster's.

    Returns
    -------
    float, or (H, W) float64 array in C order

    Raises
    ------
    InputError
        If a map is of another shape.
    """
    values = np.asarray(parameter, np.float64, order="C")
    if values.ndim == 0:
        return float(values)
    _check_shape("a map", values, shape)
    return values


def _mapped():
    """List the specifications of the parameters that may be maps."""
    return [spec for spec in specifications(McmdOptions) if spec.name in MAP_NAMES]


def _numbers(spec, values, shape):
    values = np.ma.asarray(values)
    if values.dtype.kind not in "biuf":
        raise InputError(f"the map of {spec.name} is of type {values.dtype}; give real numbers")
    _check_shape(f"the map of {spec.name}", values, shape)
    return values.astype(np.float64, order="C").filled(np.nan)


def _check_shape(what, values, shape):
    if values.shape != tuple(shape):
        raise InputError(f"{what} has shape {values.shape}, the raster {tuple(shape)}")


def _in_range(spec, values, number):
    """Put the option's number where a map has none, and refuse what the option would."""
    values[np.isnan(values)] = number
    out = (values < spec.minimum) | (values > spec.maximum)
    if out.any():
        row, column = (int(index) for index in np.unravel_index(out.argmax(), out.shape))
        raise InputError(
            f"the map of {spec.name} is {values[row, column]:g} at row {row}, column {column}; "
            f"it must be from {spec.minimum:g} to {spec.maximum:g}"
        )
    return values
