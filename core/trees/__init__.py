"""Construction trees: terrain as a continuous function put together from nodes."""

from demsmith.core.trees.atoms import Atoms
from demsmith.core.trees.frame import Frame
from demsmith.core.trees.lattice import PatchLattice
from demsmith.core.trees.node import (
    FULL,
    NOTHING,
    Bounds,
    Detail,
    Joint,
    JointNode,
    Limits,
    Node,
)
from demsmith.core.trees.operators import Add, Blend
from demsmith.core.trees.raster_node import RasterNode
from demsmith.core.trees.tree import ConstructionTree

__all__ = [
    "FULL",
    "NOTHING",
    "Add",
    "Atoms",
    "Blend",
    "Bounds",
    "ConstructionTree",
    "Detail",
    "Frame",
    "Joint",
    "JointNode",
    "Limits",
    "Node",
    "PatchLattice",
    "RasterNode",
]
