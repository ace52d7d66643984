"""Draw the pictures of the guides into ``docs/images``.

Run it from anywhere: ``.venv/bin/python docs/make_pictures.py``, with names for some alone, such as
``presets thinned``. Ground is that of public SRTM tiles in ``../shared/data``.
"""

import datetime
import io
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "demo"), str(ROOT / "benchmarks")]

import tiles  # noqa: E402, benchmarks/tiles.py
from mcmd_samples import curve_errors  # noqa: E402
from picture import relief  # noqa: E402, demo/picture.py

import demsmith  # noqa: E402
from demsmith.core import raster  # noqa: E402
from demsmith.core.samples.presets import PRESETS  # noqa: E402
from demsmith.core.validation import punch_voids  # noqa: E402

FOLDER = Path(__file__).resolve().with_name("images")
DPI = 100
PAPER = 0.97
COLOURS = 256


def main(names):
    """Draw the named pictures, or all."""
    import matplotlib

    matplotlib.use("Agg")
    for name in names or PICTURES:
        _save(PICTURES[name](), FOLDER / f"{name}.png")


# --- terrain from samples ------------------------------------------------------------------------


def presets():
    """Draw one sketch as every preset makes terrain of it."""
    side, cell = 257, 30.0
    grid = demsmith.Grid.of_extent((0, 0, side * cell, side * cell), cell)
    lines = _sketched_lines(side * cell)
    figure, axes = _panels(3, 3, width=2.9)
    plain = demsmith.from_samples(demsmith.Samples(lines=lines), grid)
    _show(axes[0], np.where(plain.known[..., None], _gray(plain.values), PAPER), "the sketch")
    _show(axes[1], relief(plain.values, (cell, cell)), "no preset (variant converged)")
    for axis, name in zip(axes[2:], PRESETS, strict=True):
        made = demsmith.from_samples(demsmith.Samples(lines=lines), grid, preset=name, seed=3)
        _show(axis, relief(made.values, (cell, cell)), name)
    return figure


def _sketched_lines(length):
    """Give a ring ridge, two spurs on the diagonals, and the plain at the edge: x, y, z [m]."""
    angle = np.linspace(0, 2 * np.pi, 181)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * length / 4 + length / 2
    lines = [np.column_stack([ring, 900 + 100 * np.sin(3 * angle)])]
    for x, y in ((1, 1), (-1, -1)):
        spur = length / 2 + length * np.outer(np.linspace(0.2, 0.42, 23), (x, y))
        lines.append(np.column_stack([spur, np.linspace(700, 200, 23)]))
    near, far = 0.001 * length, 0.999 * length
    corners = np.array([(near, near), (near, far), (far, far), (far, near), (near, near)])
    lines.append(np.column_stack([corners, np.zeros(5)]))
    return lines


def _gray(values):
    """Give elevations as a painted sketch has them: dark is low."""
    share = (values - values.min()) / np.ptp(values)
    return np.repeat(0.75 - 0.75 * share[..., None], 3, axis=2)


def scratch():
    """Draw terrain from noise alone, and rougher, and by the scheme whose squares show."""
    side, cell = 513, 30.0
    grid = demsmith.Grid.of_extent((0, 0, side * cell, side * cell), cell)
    figure, axes = _panels(1, 3, width=3.3)
    ways = {
        "defaults": {},
        "--h 0.35": {"h": 0.35},
        "--scheme triangle-edge": {"scheme": "triangle-edge"},
    }
    for axis, (title, options) in zip(axes, ways.items(), strict=True):
        made = demsmith.from_samples(None, grid, seed=7, **options)
        _show(axis, relief(made.values, (cell, cell)), title)
    return figure


def curve():
    """Draw the error of each variant as ever fewer cells are known."""
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(7.5, 4.4), dpi=DPI, layout="constrained")
    for label, errors in curve_errors().items():
        ours = "SciPy" not in label
        axis.plot(
            [100 * share for share in errors], list(errors.values()),
            label=label, marker="o", markersize=4, linestyle="-" if ours else "--",
            color=None if ours else "black",
        )  # fmt: skip
    axis.set(
        xscale="log", yscale="log", xlabel="cells kept, chosen at random [%]",
        ylabel="RMSE of the removed cells [m]",
    )  # fmt: skip
    axis.invert_xaxis()
    ticks = (99, 50, 25, 10, 5, 2, 1)
    axis.set_xticks(ticks, [str(tick) for tick in ticks])
    axis.set_xticks([], minor=True)
    axis.set_yticks((2, 5, 10, 20, 40), ("2", "5", "10", "20", "40"))
    axis.grid(which="both", color="0.9")
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False)
    return figure


# --- thinning, filling ---------------------------------------------------------------------------


def thinned():
    """Draw what two detectors keep of a mountain range, and what is rebuilt from it."""
    from matplotlib import pyplot

    ground, sizes = tiles.void_free("sierra_nevada")
    window = np.s_[920:1040, 720:870]
    cell = _cell(sizes, window)
    figure, axes = pyplot.subplot_mosaic(
        [["true", "kept ridges", "built ridges"], ["true", "kept sobel", "built sobel"]],
        figsize=(10.2, 7.0), dpi=DPI, layout="constrained",
    )  # fmt: skip
    true = relief(ground[window], cell)
    _show(axes["true"], true, "original", cell)
    for detector in ("ridges", "sobel"):
        kept = demsmith.thin(ground, share=0.05, detector=detector, pixel_size=sizes).kept
        built = demsmith.fill_voids(ground, ~kept, pixel_size=sizes).values
        error = np.sqrt(np.mean((built - ground)[~kept] ** 2))
        shown = np.where(kept[window][..., None], true, PAPER)
        _show(axes[f"kept {detector}"], shown, f"kept by {detector}: 5 %", cell)
        title = f"rebuilt: RMSE of the tile {error:.0f} m"
        _show(axes[f"built {detector}"], relief(built[window], cell), title, cell)
    return figure


def roughness():
    """Draw large voids filled, and filled with natural roughness."""
    ground, sizes = tiles.void_free("white_mountains")
    void = punch_voids(ground, seed=0)
    window = np.s_[750:930, 690:910]  # around Mount Washington
    cell = _cell(sizes, window)
    figure, axes = _panels(1, 3, width=3.6, aspect=1.15)
    surfaces = {
        "true ground, voids outlined": ground,
        "filled": demsmith.fill_voids(ground, void, pixel_size=sizes).values,
        "filled with --natural-roughness": demsmith.fill_voids(
            ground, void, pixel_size=sizes, natural_roughness=True
        ).values,
    }
    for axis, (title, values) in zip(axes, surfaces.items(), strict=True):
        _show(axis, relief(values[window], cell), title, cell)
    axes[0].contour(void[window], [0.5], colors="crimson", linewidths=0.8)
    return figure


# --- drainage ------------------------------------------------------------------------------------


def drainage():
    """Draw a range's upstream area by two methods, and its streams by order."""
    from matplotlib.collections import LineCollection

    ground, sizes = tiles.void_free("sierra_nevada")
    window = np.s_[880:1180, 700:1000]
    cell = _cell(sizes, window)
    blues = dict(cmap="Blues", vmin=3.8, vmax=8.5)
    figure, axes = _panels(1, 3, width=3.6, aspect=1.25)
    ways = {method: demsmith.drainage_area(ground, pixel_size=sizes, method=method)
            for method in ("d8", "mfd")}  # fmt: skip
    for axis, (method, drained) in zip(axes, ways.items(), strict=False):
        _show(axis, drained.log()[window], f"upstream area: {method}", cell, **blues)
    streams = ways["d8"].streams()
    _show(axes[2], relief(ground[window], cell), "streams by Strahler's order", cell)
    top_left = window[0].start, window[1].start
    lines = np.split(streams.cells - top_left, streams.first_cell[1:-1])
    axes[2].add_collection(LineCollection(
        [line[:, ::-1] for line in lines], linewidths=0.5 * streams.order, colors="navy",
        capstyle="round",
    ))  # fmt: skip
    axes[2].set(xlim=(-0.5, 299.5), ylim=(299.5, -0.5))
    return figure


# --- sunlight ------------------------------------------------------------------------------------


def solar():
    """Draw mountains in the light of a December day, its hours, and a morning's shadows."""
    tile = raster.read(tiles.DATA / tiles.VOID_FREE["sierra_nevada"])
    window = np.s_[850:1080, 480:800]
    cell = _cell(tile.grid.pixel_size_m(), window)
    day = datetime.date(2024, 12, 21)
    light = demsmith.solar_irradiance(tile.values, grid=tile.grid, days=[day])
    morning = datetime.datetime(2024, 12, 21, 8, 30, tzinfo=datetime.UTC)
    shadow = demsmith.solar_irradiance(tile.values, grid=tile.grid, instant=morning).shadow
    figure, axes = _panels(2, 2, width=4.4, aspect=0.88)
    ground = relief(tile.values[window].astype(float), cell)
    _show(axes[0], ground, "the ground", cell)
    layers = (light.total / 1000, "21 December: light [kWh/m²]", "inferno"), (
        light.hours, "21 December: hours of sun", "cividis",
    )  # fmt: skip
    for axis, (layer, title, colours) in zip(axes[1:], layers, strict=False):
        _show(axis, layer[window], title, cell, cmap=colours)
        figure.colorbar(axis.images[0], ax=axis, shrink=0.8, pad=0.01)
    shaded = np.where(shadow[window][..., None], 0.35 * ground + np.array([0, 0, 0.12]), ground)
    _show(axes[3], shaded, "21 December, 8:30 UTC: shadows", cell)
    return figure


# --- compression ---------------------------------------------------------------------------------


def rate_distortion():
    """Draw error by bytes against the peers."""
    from compression_pictures import draw_curves  # benchmarks/compression_pictures.py
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(10, 4.6), dpi=DPI, layout="constrained")
    draw_curves(axes)
    return figure


def error_map():
    """Draw a compressed window's ground and its error without and with the residual layer."""
    from compression_pictures import ERROR, TILE, WINDOW, error_maps

    grid = raster.read(tiles.DATA / tiles.VOID_FREE[TILE]).grid
    cell = _cell(grid.pixel_size_m(), WINDOW)
    ground, base, held, bits = error_maps()
    figure, axes = _panels(1, 3, width=3.9, aspect=1.05)
    _show(axes[0], relief(ground.astype(float), cell), "the ground", cell)
    layers = (base, "error without the residual layer [m]"), (
        held, f"with it: at most {ERROR} m, {bits:.2f} bits per cell",
    )  # fmt: skip
    span = dict(cmap="RdBu_r", vmin=-2 * ERROR, vmax=2 * ERROR)
    for axis, (error, title) in zip(axes[1:], layers, strict=True):
        _show(axis, error, title, cell, **span)
    figure.colorbar(axes[2].images[0], ax=axes[1:], shrink=0.8, pad=0.01)
    return figure


def _cell(sizes, window):
    """Give the ground metres per cell in a window's middle, east-west and north-south."""
    return tuple(float(size[window[0]].mean()) for size in sizes)


# --- panels --------------------------------------------------------------------------------------


def _panels(rows, columns, *, width, aspect=1.0):
    """Give a figure of so many equal panels, and these in a row; width in inches each."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        rows, columns, figsize=(columns * width, rows * (aspect * width + 0.25)), dpi=DPI,
        layout="constrained",
    )  # fmt: skip
    return figure, axes.ravel()


def _show(axis, image, title, cell=(1, 1), **how):
    axis.imshow(image, aspect=cell[1] / cell[0], interpolation="antialiased", **how)
    axis.set_title(title, fontsize=10)
    axis.set_axis_off()


def _save(figure, path):
    """Save a figure with few colours: reliefs are large files otherwise."""
    from matplotlib import pyplot
    from PIL import Image

    drawn = io.BytesIO()
    figure.savefig(drawn)
    pyplot.close(figure)
    Image.open(drawn).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE).save(
        path, optimize=True
    )


PICTURES = {
    "presets": presets,
    "scratch": scratch,
    "curve": curve,
    "thinned": thinned,
    "roughness": roughness,
    "solar": solar,
    "drainage": drainage,
    "rate-distortion": rate_distortion,
    "error-map": error_map,
}

if __name__ == "__main__":
    main(sys.argv[1:])
