"""UsdSkel: surfaces that a skeleton bends and blend shapes mould.

SkelRoot ── binding ──→ Deformer          who is bound to which skeleton, with which animation
Skeleton + SkelAnimation ── animation ──→ Pose          joint matrices and blend weights at a time
rest Surface ── blendshapes ── skinning ──→ Surface

USD resolves bindings, orders of joints and poses, which are few; points are deformed here, in NumPy.
"""

from defshade_cli.usd.skel.binding import Rig, Rigs, why_unbent
from defshade_cli.usd.skel.deformer import Deformer

__all__ = ["Deformer", "Rig", "Rigs", "why_unbent"]
