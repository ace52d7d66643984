"""The dictionaries ours are measured against: cosine waves, and what scikit-learn learns."""

import numpy as np

from demsmith.core.sparse import Dictionary


def overcomplete_waves(count, side):
    """Give overcomplete cosine waves, the long ones first, normalised over the disc.

    As in Aharon, Elad and Bruckstein 2006: one-dimensional waves of ``ceil(sqrt(count))``
    frequencies, sampled ``side`` times, their means taken off, and their products.

    Returns
    -------
    (count, side²) float32 array
    """
    number = int(np.ceil(np.sqrt(count + 1)))
    waves = np.cos(np.outer(np.arange(number), np.arange(side)) * np.pi / number)
    waves[1:] -= waves[1:].mean(axis=1, keepdims=True)
    products = np.einsum("ai,bj->abij", waves, waves).reshape(number**2, side**2)
    order = np.add.outer(np.arange(number) ** 2, np.arange(number) ** 2).ravel()
    chosen = np.argsort(order, kind="stable")[1 : count + 1]
    return Dictionary.of_samples(products[chosen], side, side).samples


def sklearn_atoms(vectors, *, alpha, rounds, whole=False, atoms=128):
    """Learn by scikit-learn; give its atoms as vectors, (atoms, K) float32.

    ``whole``: `DictionaryLearning`, else `MiniBatchDictionaryLearning`.
    """
    from sklearn.decomposition import DictionaryLearning, MiniBatchDictionaryLearning

    common = dict(
        n_components=atoms, alpha=alpha, max_iter=rounds, fit_algorithm="cd", random_state=0,
        transform_algorithm="omp",
    )  # fmt: skip
    if whole:
        learner, vectors = DictionaryLearning(**common), vectors.astype(np.float64)  # needs it
    else:
        learner = MiniBatchDictionaryLearning(batch_size=256, **common)
    return learner.fit(vectors).components_.astype(np.float32)
