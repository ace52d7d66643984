"""Inverse procedural modelling: which family of noise follows mountains best (the paper's Fig. 8).

Run it with ``.venv/bin/python benchmarks/procedural.py``; with ``--write`` it puts its section into
``benchmarks/RESULTS.md``, with ``--picture`` it draws ``docs/images/procedural.png`` instead.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import tiles
from results import provenance, table, write_section

from demsmith.core import raster
from demsmith.core.noise import FAMILIES
from demsmith.core.procedural import ProceduralizeOptions, proceduralize, select
from demsmith.core.procedural.functions import random_functions, sampled
from demsmith.core.sparse import PatchGrid, constrained, gather, pursue

MOUNTAINS = ("sierra_nevada", "white_mountains", "pyrenees_raw", "rainier_raw")
SPARSITIES = (1, 2, 4)
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "procedural.png"


def main():
    """Run all parts, print each, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--picture", action="store_true", help="draw docs/images/procedural.png")
    arguments = parser.parse_args()
    if arguments.picture:
        draw()
        return
    parts = []
    for part in (heading, families, choosing, speed):
        parts.append(part())
        print(parts[-1], end="\n\n", flush=True)
    if arguments.write:
        write_section("\n\n".join(parts) + "\n")


def heading():
    options = ProceduralizeOptions()
    return (
        f"## Inverse procedural modelling\n\n{provenance('numpy', 'numba', 'scipy')} "
        "`benchmarks/procedural.py`. Dictionaries of "
        f"{options.atoms} functions, chosen among {options.candidates}; discs of 5 cells' radius, "
        "step 5. PSNR of the blended surface over all known cells, against the tile's range."
    )


def tile(name):
    """Read a tile's elevations and voids."""
    path = {**tiles.VOID_FREE, **tiles.RAW}[name]
    source = raster.read(tiles.DATA / path)
    return source.values.astype(np.float32), source.void, tuple(source.grid.pixel_size_m())


def psnr(values, void, model):
    error = (model - values)[~void].astype(np.float64)
    return 20 * np.log10(np.ptp(values[~void]) / np.sqrt(np.mean(error**2)))


def families():
    """Every family on every mountain tile, drawn and chosen alike."""
    rows = []
    for name in MOUNTAINS:
        values, void, sizes = tile(name)
        for sparsity in SPARSITIES:
            scores = []
            for family in (*FAMILIES, "mixed"):
                terrain = proceduralize(
                    values, void, family=family, sparsity=sparsity, pixel_size=sizes
                )
                scores.append(psnr(values, void, terrain.evaluate()))
            rows.append((f"`{name}`", sparsity, *(f"{score:.2f}" for score in scores),
                         f"{scores[1] - scores[0]:+.2f}"))  # fmt: skip
            print(*rows[-1], flush=True)
    head = ("tile", "s", *FAMILIES, "mixed", "ridged against perlin [dB]")
    return "### Families of noise: PSNR [dB]\n\n" + table(head, rows)


def choosing():
    """The greedy choice against the paper's alternation, from the same candidates."""
    values, void, _ = tile("sierra_nevada")
    grid = PatchGrid(values.shape)
    options = ProceduralizeOptions()
    functions = random_functions(
        options.candidates, families=options.families(), terms=options.terms, grid=grid, seed=0
    )
    candidates = sampled(functions, grid).samples
    patches = gather(values, void, grid, np.arange(0, grid.count, 8))
    samples = patches.samples[patches.counts == patches.counts.max()]
    rows = []
    for sparsity in SPARSITIES[:2]:
        begin = time.perf_counter()
        greedy = candidates[select(samples, candidates, options.atoms, sparsity)]
        middle = time.perf_counter()
        learned = constrained(samples, candidates, options.atoms, sparsity, iterations=10)
        end = time.perf_counter()
        alternated = candidates[learned.chosen]
        for what, atoms, seconds in (
            ("greedy", greedy, middle - begin), ("constrained, 10 rounds", alternated, end - middle)
        ):  # fmt: skip
            rows.append((sparsity, what, f"{rmse(samples, atoms, sparsity):.2f}", f"{seconds:.1f}"))
    head = ("s", "choice", "RMSE of the discs [m]", "seconds")
    return (
        f"### Choice of the dictionary (`sierra_nevada`, {len(samples)} discs, ridged)\n\n"
        + table(head, rows)
    )


def rmse(samples, atoms, sparsity):
    indices, coefficients = pursue(samples, atoms, sparsity)
    rest = samples - np.einsum("ns,nsk->nk", coefficients, atoms[indices])
    return np.sqrt(np.mean(rest**2))


def speed():
    """Seconds to model a tile, and cells evaluated a second."""
    values, void, sizes = tile("sierra_nevada")
    proceduralize(values[:50, :50], candidates=100).evaluate(scale=1.5)  # compiles
    begin = time.perf_counter()
    terrain = proceduralize(values, void, pixel_size=sizes)
    rows = [("model 1201² cells", f"{time.perf_counter() - begin:.1f} s")]
    for scale in (1, 2):
        seconds = []
        for _ in range(3):
            begin = time.perf_counter()
            cells = terrain.evaluate(scale=scale).size
            seconds.append(time.perf_counter() - begin)
        rows.append((f"evaluate at scale {scale}", f"{cells / min(seconds) / 1e6:.2f} M cells/s"))
    return "### Speed (s = 2)\n\n" + table(("what", "measured"), rows)


def draw():
    """Draw mountains, and what is left of them in noises of two families, two a disc."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    values, void, sizes = tile("sierra_nevada")
    part = np.s_[800:1200, 500:900]  # the steepest mountains; dictionaries are chosen for them
    values, void, sizes = values[part], void[part], tuple(size[part[0]] for size in sizes)
    window = np.s_[80:240, 60:260]
    light = matplotlib.colors.LightSource(315, 45)
    figure, axes = pyplot.subplots(2, 3, figsize=(11, 6.2), layout="constrained")
    pictures = {"SRTM, Sierra Nevada": values}
    for family in ("perlin", "ridged"):
        model = proceduralize(values, void, family=family, sparsity=2, pixel_size=sizes).evaluate()
        score = psnr(values, void, model)
        pictures[f"{family}, s = 2: {score:.2f} dB"] = model
    for ax, (title, ground) in zip(axes[0], pictures.items(), strict=True):
        shade = light.hillshade(ground[window], vert_exag=1, dx=73, dy=92)
        ax.imshow(shade, cmap="gray", vmin=0, vmax=1)
        ax.set_title(title)
    for ax, ground in zip(axes[1], pictures.values(), strict=True):
        if ground is values:
            shown = ax.imshow(values[window], cmap="terrain")
            figure.colorbar(shown, ax=ax, label="elevation [m]", shrink=0.8)
        else:
            shown = ax.imshow((ground - values)[window], cmap="RdBu", vmin=-40, vmax=40)
            figure.colorbar(shown, ax=ax, label="error [m]", shrink=0.8)
    for ax in axes.ravel():
        ax.set_xticks([])
        ax.set_yticks([])
    figure.savefig(PICTURE, dpi=90)


if __name__ == "__main__":
    main()
