"""Layers of QGIS as samples: read in the CRS of the output, or named as files."""

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsFeatureRequest,
    QgsProcessingException,
    QgsProviderRegistry,
    QgsRasterLayer,
    QgsVectorLayer,
    QgsVectorLayerFeatureSource,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QMetaType

from demsmith.algorithms.base import file_of
from demsmith.algorithms.parameters import tr

_RASTER, _VECTOR, _TABLE = "raster", "vector", "table"


class SampleLayers:
    """The layers that samples are taken from.

    Made in the main thread, where layers live; read in any.

    Parameters
    ----------
    layers : list of QgsMapLayer
        Points, lines, tables and thinned rasters.
    contours : list of QgsVectorLayer
    **reading
        As in `VectorSource`.

    Attributes
    ----------
    rasters : list of str
        Files of the rasters.
    tables : list of str
        Files of the tables, which have no geometries.
    crs : QgsCoordinateReferenceSystem
        Of the first raster, else of the first layer that has one; invalid if none has.

    Raises
    ------
    QgsProcessingException
        If a layer is of a kind that cannot be read.
    demsmith.core.errors.InputError
        As `VectorSource`.
    """

    def __init__(self, layers, contours, **reading):
        kinds = {kind: [] for kind in (_RASTER, _VECTOR, _TABLE)}
        for layer in layers:
            kinds[_kind(layer)].append(layer)
        for layer in contours:
            if not _has_lines(layer):
                raise QgsProcessingException(
                    tr("CONTOURS: layer '{}' does not hold lines").format(layer.name())
                )
        self.rasters = [file_of(layer, "INPUT") for layer in kinds[_RASTER]]
        self.tables = [_table_of(layer) for layer in kinds[_TABLE]]
        self._vectors = [VectorSource(layer, **reading) for layer in kinds[_VECTOR]]
        self._contours = [VectorSource(layer, **reading) for layer in contours]
        of_layers = [layer.crs() for layer in (*kinds[_RASTER], *kinds[_VECTOR], *contours)]
        found = [crs for crs in of_layers if crs.isValid()]
        self.crs = found[0] if found else QgsCoordinateReferenceSystem()

    def __bool__(self):
        """Tell whether there are any."""
        return bool(self.rasters or self.tables or self._vectors or self._contours)

    def read(self, crs, transforms, progress):
        """Read the vector layers.

        Parameters are those of `VectorSource.read`, which also tells what is raised.

        Returns
        -------
        samples : list of demsmith.core.samples.Samples
        notes : list of str
        """
        from demsmith.core.progress import Span

        sources = [*self._vectors, *self._contours]
        samples, notes = [], []
        for number, source in enumerate(sources):
            part = Span(progress, number / len(sources), (number + 1) / len(sources))
            features = source.read(crs, transforms, part)
            samples.append(_samples(features, source.name, contours=source in self._contours))
            notes += features.notes
        return samples, notes


class VectorSource:
    """A vector layer as it stood in the main thread, to be read in any other.

    Filters, edits not yet saved, joined and virtual attributes count as QGIS shows them.

    Parameters
    ----------
    layer : QgsVectorLayer
    field : str or None
        Attribute that holds the elevations; by default as in
        `demsmith.core.raster.read_features`.
    selected_only : bool
        Whether to read only the selected features of a layer that has some.

    Raises
    ------
    demsmith.core.errors.InputError
        If the layer has no such attribute.
    """

    def __init__(self, layer, *, field=None, selected_only=False):
        from demsmith.core.raster.parts import elevation_field

        self.name = layer.name()
        self.crs = layer.crs()
        fields = layer.fields()
        readable = [each.name() for each in fields if _readable(each)]
        self._field = elevation_field(fields.names(), readable, field, self.name)
        self._index = -1 if self._field is None else fields.indexOf(self._field.name)
        self._features = QgsVectorLayerFeatureSource(layer)
        self._request = QgsFeatureRequest()
        self._request.setSubsetOfAttributes([] if self._field is None else [self._index])
        self._count = layer.featureCount()
        if selected_only and layer.selectedFeatureCount():
            self._request.setFilterFids(layer.selectedFeatureIds())
            self._count = layer.selectedFeatureCount()

    def read(self, crs, transforms, progress):
        """Read the features.

        Parameters
        ----------
        crs : QgsCoordinateReferenceSystem
            To bring them to; elevations stay as they are.
        transforms : QgsCoordinateTransformContext
            The project's choice of ways from one CRS to another.
        progress : demsmith.core.progress.Progress

        Returns
        -------
        demsmith.core.raster.features.Features

        Raises
        ------
        QgsProcessingException
            If there is no way to ``crs``, or no feature lies where it reaches.
        demsmith.core.errors.InputError
            If nothing has an elevation.
        demsmith.core.errors.Cancelled
        """
        from demsmith.core.raster.parts import read_wkb_parts, to_features

        transform = self._way_to(crs, transforms)
        unreached = []
        parts = read_wkb_parts(self._in(transform, unreached), self._count, progress)
        if unreached and not len(parts.lengths):
            raise QgsProcessingException(
                tr("no feature of layer '{}' can be brought from {} to {}: {}").format(
                    self.name, _known_as(self.crs), _known_as(crs), unreached[0]
                )
            )
        notes = []
        if unreached:
            notes.append(
                tr("{} of {} features lie where the CRS asked for does not reach "
                   "and were left out").format(len(unreached), self._count)
            )  # fmt: skip
        if crs.isValid() and not self.crs.isValid():
            notes.append(tr("it has no CRS; its coordinates are taken to be the output's"))
        return to_features(parts, self._field, self.name, notes=notes)

    def _way_to(self, crs, transforms):
        """Give the transform to a CRS, which changes nothing where either is unknown."""
        transform = QgsCoordinateTransform(self.crs, crs, transforms)
        if self.crs.isValid() and crs.isValid() and not transform.isValid():
            raise QgsProcessingException(
                tr("layer '{}': there is no way from its CRS {} to {}").format(
                    self.name, _known_as(self.crs), _known_as(crs)
                )
            )
        return transform

    def _in(self, transform, unreached):
        """Yield the geometry of each feature as WKB, and its attribute as a number.

        What the transform refuses goes to the list ``unreached``.
        """
        from demsmith.core.raster.parts import number_in

        for feature in self._features.getFeatures(self._request):
            geometry = feature.geometry()
            if geometry.isEmpty():
                continue
            try:
                geometry.transform(transform)
            except QgsCsException as error:
                unreached.append(" ".join(str(error).split()))
                continue
            value = None if self._field is None else feature.attribute(self._index)
            yield geometry.asWkb().data(), number_in(value)


def _kind(layer):
    if isinstance(layer, QgsRasterLayer):
        return _RASTER
    if not isinstance(layer, QgsVectorLayer):
        raise QgsProcessingException(
            tr("INPUT: layer '{}' is neither a vector nor a raster layer").format(layer.name())
        )
    return _VECTOR if layer.isSpatial() else _TABLE


def _has_lines(layer):
    lines = (QgsWkbTypes.GeometryType.LineGeometry, QgsWkbTypes.GeometryType.PolygonGeometry)
    return isinstance(layer, QgsVectorLayer) and layer.geometryType() in lines


def _table_of(layer):
    """Name the file of a layer without geometries, to be read as a table of points."""
    if layer.providerType() != "ogr":
        raise QgsProcessingException(
            tr("INPUT: layer '{}' has no geometries; make points of its table first, for example "
               "with 'Create points layer from table'").format(layer.name())
        )  # fmt: skip
    return QgsProviderRegistry.instance().decodeUri("ogr", layer.source())["path"]


def _samples(features, name, *, contours):
    from demsmith.core.errors import InputError
    from demsmith.core.samples import Samples

    if not contours:
        return Samples(features.points, features.lines)
    try:
        return Samples(contours=features.lines)
    except InputError as error:
        raise InputError(f"'{name}': {error}") from None


def _readable(field):
    return field.isNumeric() or field.type() == QMetaType.Type.QString


def _known_as(crs):
    return crs.authid() or crs.description()
