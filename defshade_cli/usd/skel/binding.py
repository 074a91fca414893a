"""Which prims a SkelRoot's skeletons deform."""

from __future__ import annotations

from typing import NamedTuple

from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel

from defshade_cli.usd.skel.deformer import Deformer


class Rig(NamedTuple):
    """A SkelRoot, where it stands in the subtree that is walked.

    root: the prim on the stage; for one in a prototype its proxy, since instances inherit animations.
    """

    root: Usd.Prim
    root_from_rig: Gf.Matrix4d
    in_world: bool

    def place(self, skeleton: Usd.Prim, xforms: UsdGeom.XformCache) -> tuple[Gf.Matrix4d, bool]:
        """(4, 4) where a skeleton stands in the subtree, and whether that is world space."""
        if not skeleton.GetPath().HasPrefix(self.root.GetPath()):
            return xforms.GetLocalToWorldTransform(skeleton), True
        rig_from_skeleton, resets = xforms.ComputeRelativeTransform(skeleton, self.root)
        return (rig_from_skeleton, True) if resets else (rig_from_skeleton * self.root_from_rig, self.in_world)


def why_unbent(prim: Usd.Prim) -> str | None:
    """Why the joints that influence a prim below a SkelRoot, as it says, do not move it; None where they may.

    prim: on the stage, or the proxy of one in a prototype.
    """
    if not prim.HasAPI(UsdSkel.BindingAPI):
        return "SkelBindingAPI is not applied to it"
    return None if UsdSkel.BindingAPI(prim).GetInheritedSkeleton() else "no skeleton is bound to it"


class Rigs:
    """The skinned prims of a stage. Skinning is enabled below SkelRoots only, as their schema says."""

    def __init__(self) -> None:
        self._cache = UsdSkel.Cache()
        self._known: set[Sdf.Path] = set()
        self._deformers: dict[Sdf.Path, Deformer | None] = {}
        self._holds_rig: dict[Sdf.Path, bool] = {}

    def deformer(self, rig: Rig, prim: Usd.Prim) -> Deformer | None:
        """What deforms a prim below the rig's root; None where nothing is bound to it."""
        path = prim.GetPath()
        if path not in self._deformers:
            self._populate(rig.root)
            self._deformers[path] = self._make_deformer(prim)
        return self._deformers[path]

    def animation_of(self, instance: Usd.Prim) -> Sdf.Path | None:
        """The animation that skeletons inside an instance inherit; None where there are no such."""
        if not self._is_rigged(instance):
            return None
        animation = UsdSkel.BindingAPI(instance).GetInheritedAnimationSource()
        return animation.GetPath() if animation else None

    def _is_rigged(self, instance: Usd.Prim) -> bool:
        if instance.IsA(UsdSkel.Root):
            return True
        prototype = instance.GetPrototype()
        path = prototype.GetPath()
        if path not in self._holds_rig:
            inside = Usd.PrimRange(prototype, Usd.TraverseInstanceProxies())
            self._holds_rig[path] = any(prim.IsA(UsdSkel.Root) for prim in inside)
        return self._holds_rig[path]

    def _populate(self, root: Usd.Prim) -> None:
        if root.GetPath() not in self._known:
            self._known.add(root.GetPath())
            self._cache.Populate(UsdSkel.Root(root), Usd.TraverseInstanceProxies())

    def _make_deformer(self, prim: Usd.Prim) -> Deformer | None:
        skinning = self._cache.GetSkinningQuery(prim)
        if not skinning or not (skinning.HasJointInfluences() or skinning.HasBlendShapes()):
            return None
        skeleton = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
        if not skeleton:
            return None
        return Deformer(skinning, self._cache.GetSkelQuery(skeleton), skeleton.GetPrim())
