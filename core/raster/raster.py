"""A raster band in memory, with all that must survive from input to output."""

from dataclasses import dataclass, field

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster.grid import Grid


@dataclass(frozen=True)
class BandMeta:
    """What a file says of a band besides its values and its place.

    Attributes
    ----------
    dtype : numpy.dtype
        Data type of the stored values.
    nodata : float or int or None
        The stored value tagged as nodata.
    scale, offset : float
        A stored value ``v`` means ``v * scale + offset``.
    unit : str
        Unit of the values (``m``, ``ft``); empty if unknown.
    description : str
        Name of the band.
    area_or_point : str
        ``Area`` or ``Point``, whether a value stands for its cell or for the cell's centre;
        empty if the file does not tell. The geotransform is of cells either way.
    dataset_metadata, band_metadata : dict
        The file's and the band's metadata items, without statistics.
    color_table : dict
        Colours (red, green, blue, alpha; 0 to 255) by value; empty if there is none.
    categories : tuple of str
        Names of the values 0, 1, ...
    epoch : float
        Coordinate epoch of a dynamic CRS in years; 0 if none.
    gcps : tuple of (row, column, x, y, z)
        Ground control points, of a raster that has no geotransform.
    gcp_crs : str
        WKT of their coordinates.
    rpc : dict
        Rational polynomial coefficients.
    """

    dtype: np.dtype = np.dtype(np.float32)
    nodata: float | int | None = None
    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""
    description: str = ""
    area_or_point: str = ""
    dataset_metadata: dict = field(default_factory=dict)
    band_metadata: dict = field(default_factory=dict)
    color_table: dict = field(default_factory=dict)
    categories: tuple = ()
    epoch: float = 0.0
    gcps: tuple = ()
    gcp_crs: str = ""
    rpc: dict = field(default_factory=dict)

    def real(self, stored):
        """Tell what stored values mean: scaled and offset, in the band's unit.

        Examples
        --------
        >>> BandMeta(scale=0.1, offset=100.0).real(50)
        105.0
        """
        return stored * self.scale + self.offset


@dataclass(frozen=True)
class Raster:
    """A band's values, its voids and its place.

    Attributes
    ----------
    values : ndarray, shape (rows, columns)
        As stored, in the band's own data type; scale and offset are not applied.
    void : ndarray of bool, same shape
        Cells without a known value.
    grid : Grid
        Where the cells lie.
    meta : BandMeta
        What else the file says.
    notes : tuple of str
        Warnings for the user: odd things found while reading, one sentence each.
    source : str
        Path it was read from; empty if it was not.
    """

    values: np.ndarray
    void: np.ndarray
    grid: Grid
    meta: BandMeta = field(default_factory=BandMeta)
    notes: tuple = ()
    source: str = ""

    def __post_init__(self):
        """Check that values, voids and grid have one shape."""
        if not self.values.shape == self.void.shape == tuple(self.grid.shape):
            raise InputError(
                f"values {self.values.shape}, voids {self.void.shape} and grid "
                f"{tuple(self.grid.shape)} differ in shape"
            )
