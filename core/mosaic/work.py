"""The steps of a mosaic: plan, find voids, fill them, write tiles, tell of it."""

import os
from dataclasses import dataclass

import numpy as np

from demsmith.core.mosaic import tasks
from demsmith.core.mosaic.layout import Layout, chunk_side, chunks_of
from demsmith.core.mosaic.schedulers import Task
from demsmith.core.mosaic.summary import summarise
from demsmith.core.mosaic.workplace import Workplace, load
from demsmith.core.progress import Span, checkpoint
from demsmith.core.reconstruction.doubts import FoundVoids
from demsmith.core.reconstruction.options import ReconstructOptions
from demsmith.core.reconstruction.pipeline import divided, joined
from demsmith.core.reconstruction.plan import make_plan
from demsmith.core.reconstruction.training import gathered_counts


@dataclass(frozen=True)
class Work:
    """One mosaic in the making.

    Attributes
    ----------
    layout : Layout
    options : ReconstructOptions
    auxiliaries : sequence of path
    creation_options : tuple of str
    place : Workplace
        Open. Tasks whose results are there are not done again.
    crew : InThisProcess, Processes or DaskCluster
    """

    layout: Layout
    options: ReconstructOptions
    auxiliaries: tuple
    creation_options: tuple
    place: Workplace
    crew: object

    def do(self, begin, progress):
        """Make it.

        Parameters
        ----------
        begin : float
            `time.perf_counter` when all began.
        progress : Progress

        Returns
        -------
        MosaicResult
        """
        tiles, side = self.layout.tiles, chunk_side(self.layout.tiles)
        chunks = chunks_of(tiles, side)
        counts = self._survey(chunks, Span(progress, 0, 0.05))
        plan = make_plan(
            tiles, counts, self.options, auxiliaries=self.auxiliaries,
            progress=Span(progress, 0.05, 0.15),
        )  # fmt: skip
        extents, outliers = self._find_voids(plan, chunks, Span(progress, 0.15, 0.25))
        parts, large = divided(tiles, plan, extents, np.arange(len(extents)), side)
        patches = self._fill(plan, parts, Span(progress, 0.25, 0.75))
        written = self._write(extents, outliers, parts, patches, Span(progress, 0.75, 0.97))
        result = summarise(self, plan, extents, patches, written, large, begin)
        checkpoint(progress, 1.0)
        return result

    def _survey(self, chunks, progress):
        tiles = self.layout.tiles
        seen = [
            self._task(_named(chunk), tasks.survey, (tiles, *chunk), f"counts-{number}.npz")
            for number, chunk in enumerate(chunks)
        ]
        counts = [load(path, "row", "column", "counts") for path in self._run(seen, progress)]
        return gathered_counts(tiles.shape, counts, chunks)

    def _find_voids(self, plan, chunks, progress):
        tiles = self.layout.tiles
        found = [
            self._task(_named(chunk), tasks.scan, (tiles, plan, *chunk), f"runs-{number}.npz")
            for number, chunk in enumerate(chunks)
        ]
        results = self._run(found, Span(progress, 0, 0.8))
        chunks_found = [FoundVoids(**load(path)) for path in results]
        outliers = np.concatenate([each.outliers for each in chunks_found])
        return joined(chunks_found, progress=Span(progress, 0.8, 1)), outliers

    def _fill(self, plan, parts, progress):
        filled = [
            self._task(
                f"the voids of {_named((part.rows, part.columns))}", tasks.fill,
                (self.layout.tiles, plan, part), f"patch-{number}.npz",
            )
            for number, part in enumerate(parts)
        ]  # fmt: skip
        return self._run(filled, progress)

    def _write(self, extents, outliers, parts, patches, progress):
        tiles = self.layout.tiles
        part_of = np.full(len(extents), -1)
        for number, part in enumerate(parts):
            part_of[part.voids] = number
        written = []
        for number, (tile, paths) in enumerate(zip(tiles.tiles, self.layout.outputs, strict=True)):
            meeting = np.unique(part_of[extents.meeting(tile.rows, tile.columns)])
            outputs = tasks.TileOutputs(
                paths, self.place.path(f"tile-{number}"), self.creation_options
            )
            needed = [patches[part] for part in meeting[meeting >= 0]]
            written.append(
                self._task(
                    f"'{tile.path}'", tasks.write,
                    (tiles, tile, needed, _within(outliers, tile), self.options, outputs),
                    f"tile-{number}.json",
                )
            )  # fmt: skip
        return self._run(written, progress)

    def _task(self, name, function, args, result):
        path = self.place.path(result)
        return Task(name, function, (*args, path), path)

    def _run(self, wanted, progress):
        """Do the tasks whose results are not there; give all results' paths."""
        missing = [task for task in wanted if not os.path.exists(task.result)]
        self.crew.run(missing, stop=self.place.stop, progress=progress)
        return [task.result for task in wanted]


def _within(places, tile):
    """Give the places, by row and column, that lie in a tile."""
    (row, column), (rows, columns) = places.T, (tile.rows, tile.columns)
    inside = (row >= rows.start) & (row < rows.stop)
    return places[inside & (column >= columns.start) & (column < columns.stop)]


def _named(window):
    rows, columns = window
    return f"rows {rows.start} to {rows.stop}, columns {columns.start} to {columns.stop}"
