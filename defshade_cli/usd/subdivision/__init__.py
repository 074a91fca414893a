"""Subdivision surfaces as sparse matrices: made once for a topology, applied to the points of every frame.

    topology ── base ── cage ─┬─ refinement ── limit
                              └─ facevarying

NumPy arrays in, sparse weights out; nothing here knows USD's API.
"""

from defshade_cli.usd.subdivision.facevarying import LinearInterpolation, refine_face_varying
from defshade_cli.usd.subdivision.limit import Limit, limit
from defshade_cli.usd.subdivision.refinement import Refinement, refine
from defshade_cli.usd.subdivision.stencil import Stencils
from defshade_cli.usd.subdivision.topology import Topology

__all__ = [
    "Limit",
    "LinearInterpolation",
    "Refinement",
    "Stencils",
    "Topology",
    "limit",
    "refine",
    "refine_face_varying",
]
