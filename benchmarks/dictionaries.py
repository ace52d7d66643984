"""Dictionaries: K-SVD against scikit-learn, and the Sparse paper's Table 1.

Run all with ``.venv/bin/python benchmarks/dictionaries.py`` (half an hour, most of it
scikit-learn's); with ``--write`` the section goes into ``benchmarks/RESULTS.md``. ``--only`` runs
one part, ``--quick`` a small version that only shows that everything works.
"""

import argparse
import statistics
import sys
import time
import warnings

import numpy as np
import tiles
from dictionaries_peers import overcomplete_waves, sklearn_atoms
from results import provenance, table, write_section

from demsmith.core import raster
from demsmith.core.codec import patch_base
from demsmith.core.sparse import Dictionary, decompose, gather, ksvd, learn, pursue, refine
from demsmith.core.sparse.learning import cosine_waves
from demsmith.core.sparse.metric import Metric
from demsmith.core.sparse.patches import PatchGrid
from demsmith.core.sparse.weighted import decompose_weighted

ATOMS, SIDE, SPARSITIES = 128, 10, (1, 2, 8)
DISCS = 10_000
CROP = np.s_[344:856, 344:856]
LEARNED_ON = ("pyrenees_raw", "rainier_raw", "sierra_nevada", "white_mountains")
SWEEPS = 4


def main():
    """Run the parts asked for and print or write the section."""
    parts = {"ksvd": against_sklearn, "table1": table_1}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--only", choices=parts, help="run this part alone")
    parser.add_argument("--quick", action="store_true", help="less ground, fewer tiles")
    arguments = parser.parse_args()
    if arguments.write and (arguments.only or arguments.quick):
        parser.error("only the whole section is written: leave --only and --quick out")
    warnings.filterwarnings("ignore", module="sklearn")
    names = [arguments.only] if arguments.only else list(parts)
    text = "\n\n".join([heading(), *(parts[name](arguments.quick) for name in names)]) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say when and where this was measured."""
    return (
        "## Dictionaries\n\n"
        f"{provenance('numpy', 'numba', 'scikit-learn')} "
        "Repeat with `.venv/bin/python benchmarks/dictionaries.py`. Two threads, kernels warm, "
        f"seed 0. {ATOMS} atoms, discs of {SIDE} × {SIDE} cells, {SIDE // 2} apart."
    )


def ground(name, crop=None):
    """Read a tile, or a window of it: float32 elevations and voids."""
    if name == "large":
        values = tiles.large()[0]
        return values, np.zeros(values.shape, bool)
    tile = raster.read(tiles.DATA / (tiles.RAW | tiles.VOID_FREE)[name])
    crop = crop or np.s_[:]
    return np.ascontiguousarray(tile.values[crop], np.float32), tile.void[crop].copy()


def disc_samples(values, void, most=DISCS):
    """Give the samples of so many whole discs."""
    patches = gather(values, void, PatchGrid(values.shape))
    whole = np.flatnonzero(patches.counts == patches.counts.max())
    if whole.size > most:
        whole = np.sort(np.random.default_rng(0).choice(whole, most, replace=False))
    return patches.samples[whole]


# --- K-SVD ---------------------------------------------------------------------------------------


def against_sklearn(quick):
    """Learn from the same samples by K-SVD and by scikit-learn."""
    names, crop = (LEARNED_ON[:1], np.s_[:200, :200]) if quick else (LEARNED_ON, CROP)
    metric = Metric("even", SIDE, SIDE)
    _learn(metric.vectors(disc_samples(*ground(names[0], np.s_[:150, :150]))), 2)  # warms up
    found = {}
    for name in names:
        vectors = metric.vectors(disc_samples(*ground(name, crop)))
        vectors /= np.sqrt((vectors**2).mean())
        for sparsity in SPARSITIES:
            seconds, atoms = _timed(_learn, vectors, sparsity)
            _note(found, "Demsmith K-SVD", sparsity, seconds, _error(vectors, atoms, sparsity))
        for label, options in sklearn_methods(quick).items():
            seconds, atoms = _timed(sklearn_atoms, vectors, **options)
            for sparsity in SPARSITIES:
                _note(found, label, sparsity, seconds, _error(vectors, atoms, sparsity))
    rows = []
    for label, by_sparsity in found.items():
        cells = [label]
        for sparsity in SPARSITIES:
            seconds, errors = zip(*by_sparsity[sparsity], strict=True)
            cells += [f"{statistics.median(errors):.4f}", f"{statistics.median(seconds):.1f}"]
        rows.append(cells)
    ratios = []
    for sparsity in SPARSITIES:
        ours = [error for _, error in found["Demsmith K-SVD"][sparsity]]
        others = [
            min(found[label][sparsity][tile][1] for label in found if label != "Demsmith K-SVD")
            for tile in range(len(names))
        ]
        worst = max(a / b for a, b in zip(ours, others, strict=True))
        ratios.append(f"{worst:.3f} (s = {sparsity})")
    head = ["method"]
    for sparsity in SPARSITIES:
        head += [f"error, s = {sparsity}", "CPU s"]
    return (
        "### K-SVD against scikit-learn\n\n"
        f"Median over 512² windows of {', '.join(f'`{name}`' for name in names)}; {DISCS:,} discs "
        "each at most, the mean taken off, all samples together scaled to a root mean square of "
        "1 for scikit-learn's `alpha`. Seconds are the processor's, of both threads. Error: root "
        "mean square of what orthogonal matching pursuit by s atoms leaves. scikit-learn learns by "
        "LASSO; s is its transform's, so one "
        "fit serves all s.\n\n" + table(head, rows) + "\n\n"
        "Error of K-SVD ÷ the best of scikit-learn's, on the worst tile: "
        + ", ".join(ratios) + "."
    )  # fmt: skip


def sklearn_methods(quick):
    """Give scikit-learn's learners with what they are told."""
    rounds = 2 if quick else 10
    return {
        "scikit-learn MiniBatch, alpha 1": dict(alpha=1, rounds=rounds),
        "scikit-learn MiniBatch, alpha 5": dict(alpha=5, rounds=rounds),
        "scikit-learn DictionaryLearning, alpha 5": dict(alpha=5, rounds=rounds, whole=True),
    }


def _learn(vectors, sparsity):
    """Learn as `learn` does."""
    waves = Metric("even", SIDE, SIDE).vectors(cosine_waves(SIDE, SIDE)[: int(0.6 * ATOMS)])
    start = waves if sparsity > 1 else None
    return ksvd(vectors, ATOMS, sparsity, start=start, threads=2).atoms


def _error(vectors, atoms, sparsity):
    indices, coefficients = pursue(vectors, atoms, sparsity)
    rest = vectors - np.einsum("ij,ijk->ik", coefficients, atoms[indices])
    return float(np.sqrt((rest.astype(np.float64) ** 2).mean()))


def _note(found, label, sparsity, seconds, error):
    print(label, sparsity, f"{seconds:.1f} s, {error:.4f}", file=sys.stderr, flush=True)
    found.setdefault(label, {}).setdefault(sparsity, []).append((seconds, error))


def _timed(work, *arguments, **options):
    """Give the processor's seconds, of all threads, which others on the machine change least."""
    begin = time.process_time()
    result = work(*arguments, **options)
    return time.process_time() - begin, result


# --- Table 1 -------------------------------------------------------------------------------------


def table_1(quick):
    """Measure the paper's settings, on our tiles, beside a DCT's and scikit-learn's atoms."""
    grounds = {
        f"{name} 512²": (name, CROP) for name in ("sierra_nevada", "pyrenees_raw", "rainier_raw")
    }
    if not quick:
        grounds |= {name: (name, None) for name in ("pyrenees_raw", "rainier_raw", "large")}
    else:
        grounds = {"pyrenees_raw 200²": ("pyrenees_raw", np.s_[:200, :200])}
    rows, gains = [], []
    for label, (name, crop) in grounds.items():
        values, void = ground(name, crop)
        peers = _peer_dictionaries(values, void, quick)
        for sparsity in SPARSITIES:
            row, gain = _table_1_row(values, void, sparsity, peers)
            rows.append([label, sparsity, *row])
            print(*rows[-1], file=sys.stderr, flush=True)
            gains.append(gain)
    head = [
        "terrain", "s", "ρ, 2s + 2 [%]", "ρ, 2s [%]", "paper's pursuit: DCT", "K-SVD",
        "weighted: DCT", "scikit-learn", "K-SVD", "refined: DCT", "scikit-learn", "K-SVD",
        "bytes [%]", "PSNR", "learning [CPU s]",
    ]  # fmt: skip
    least = [min(column) for column in zip(*gains, strict=True)]
    return (
        "### The paper's Table 1\n\n"
        "PSNR [dB] of the blended surface against the terrain's range, voids left out. ρ counts "
        "values by cells, with `n(2s + 2)` and with `2ns` as the paper's figures do. DCT: the "
        "better of 128 overcomplete cosine waves and the complete 99. scikit-learn: MiniBatch, "
        f"10 rounds, the better of alpha 1 and 5. Both learners: the same {DISCS:,} discs. "
        "Paper's pursuit: all of a disc alike, K-SVD learned so. Weighted: learning and pursuit "
        "in the blend's metric, for all dictionaries alike; K-SVD's is polished. Refined: and then "
        f"{SWEEPS} steps of joint least squares (`refine`). Bytes: coded tree and dictionary of "
        "the refined K-SVD (`patch_base.encode`, steps of the RMSE), as share of 2 bytes a cell, "
        "with its PSNR once decoded.\n\n" + table(head, rows) + "\n\n"
        f"K-SVD's least gain over DCT and scikit-learn: weighted {least[0]:+.2f} and "
        f"{least[1]:+.2f} dB, refined {least[2]:+.2f} and {least[3]:+.2f} dB, paper's pursuit "
        f"over DCT {least[4]:+.2f} dB.\n\n"
        "The paper, other terrain: Alps 512² s = 1, 2, 8: 14.9, 20.0, 50.9 % and 23.7, 26.4, "
        "31.1 dB; Italy 3600²: 4.9, 9.7, 38.0 % and 31.7, 34.2, 39.2 dB. Its ratios only fit "
        "the second counting."
    )  # fmt: skip


def _peer_dictionaries(values, void, quick):
    """Give cosine waves of two kinds, and what scikit-learn learns with two weights of its norm."""
    metric = Metric("blend", SIDE, SIDE)
    vectors = metric.vectors(disc_samples(values, void))
    vectors /= np.sqrt((vectors**2).mean())
    rounds = 2 if quick else 10
    learned = [sklearn_atoms(vectors, alpha=alpha, rounds=rounds) for alpha in (1, 5)]
    complete = Dictionary.of_samples(cosine_waves(SIDE, SIDE), SIDE, SIDE).samples
    return [overcomplete_waves(ATOMS, SIDE), complete, *map(metric.samples, learned)]


def _table_1_row(values, void, sparsity, peers):
    """Measure one sparsity; give the table's cells, and K-SVD's gains."""
    options = dict(sparsity=sparsity)
    counted = dict(atoms=ATOMS, most_discs=DISCS, **options)
    even = learn(values, void, weighting="even", **counted).dictionary.samples
    seconds, learned = _timed(learn, values, void, **counted)
    ours = learned.dictionary.samples
    paper = [
        _psnr(values, void, decompose(values, void, dictionary=each, **options).evaluate())
        for each in [*peers[:2], even]
    ]
    weighted, refined = [], []
    for atoms in [*peers, ours]:
        tree = decompose_weighted(values, void, dictionary=atoms, **options)
        weighted.append(_psnr(values, void, tree.evaluate()))
        tree = refine(values, void, tree=tree, sweeps=SWEEPS)
        refined.append(_psnr(values, void, tree.evaluate()))
    share, decoded = _coded(values, void, tree)
    paper = [max(paper[:2]), paper[2]]
    weighted, refined = (
        [max(row[:2]), max(row[2:4]), row[4]] for row in (weighted, refined)
    )  # fmt: skip
    gains = [row[-1] - other for row in (weighted, refined, paper) for other in row[:-1]]
    cells = [
        f"{100 * (ATOMS * SIDE**2 + tree.grid.count * per_disc + 1) / values.size:.1f}"
        for per_disc in (2 * sparsity + 2, 2 * sparsity)
    ]
    for row in (paper, weighted, refined):
        cells += [*(f"{psnr:.2f}" for psnr in row[:-1]), f"**{row[-1]:.2f}**"]
    return [*cells, f"{100 * share:.2f}", f"{decoded:.2f}", f"{seconds:.1f}"], gains


def _coded(values, void, tree):
    """Code a tree; give its bytes by those of the raster, and its PSNR."""
    error = np.sqrt(np.mean((tree.evaluate() - values)[~void].astype(np.float64) ** 2))
    params, sections = patch_base.encode(values, void, tree=tree, step=float(error), sweeps=0)
    size = sum(len(part) for parts in sections.values() for part in parts)
    base = patch_base.PatchBase(params, lambda section, index: sections[section][index])
    return size / (2 * values.size), _psnr(values, void, base.tree().evaluate())


def _psnr(values, void, found):
    known = ~void
    error = np.sqrt(np.mean((values[known].astype(np.float64) - found[known]) ** 2))
    return 20 * np.log10((values[known].max() - values[known].min()) / error)


if __name__ == "__main__":
    main()
