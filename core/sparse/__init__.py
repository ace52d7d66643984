"""Terrain as a blend of discs, each a few atoms of a dictionary (Guérin et al. 2016).

The sources are E. Guérin, J. Digne, É. Galin and A. Peytavie, "Sparse representation of terrains
for procedural modeling", Computer Graphics Forum 35(2), 2016, here "the paper".
"""

from demsmith.core.sparse.atoms import CutAtoms, FunctionAtoms, Provenance, SampledAtoms
from demsmith.core.sparse.dictionary import Dictionary
from demsmith.core.sparse.dictionary_file import read_dictionary, write_dictionary
from demsmith.core.sparse.job import LearnResult, learn_file
from demsmith.core.sparse.ksvd import LearnedAtoms, constrained, ksvd
from demsmith.core.sparse.learning import Learned, learn
from demsmith.core.sparse.options import LearnOptions
from demsmith.core.sparse.patch_tree import PatchTree, decompose
from demsmith.core.sparse.patches import Patches, PatchGrid, gather
from demsmith.core.sparse.pursuit import pursue
from demsmith.core.sparse.refinement import refine
from demsmith.core.sparse.weighted import decompose_weighted

__all__ = [
    "CutAtoms",
    "Dictionary",
    "FunctionAtoms",
    "LearnOptions",
    "LearnResult",
    "Learned",
    "LearnedAtoms",
    "PatchGrid",
    "PatchTree",
    "Patches",
    "Provenance",
    "SampledAtoms",
    "constrained",
    "decompose",
    "decompose_weighted",
    "gather",
    "ksvd",
    "learn",
    "learn_file",
    "pursue",
    "read_dictionary",
    "refine",
    "write_dictionary",
]
