"""What a UsdRenderPass leaves out of the picture: its collections prune and renderVisibility."""

from __future__ import annotations

from pxr import Sdf, Usd, UsdRender

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.scene import Unsupported

_UNANSWERED = ("cameraVisibility", "matte")


@dataclass(frozen=True, slots=True)
class PassRules:
    """prune: prims whose subtrees are as if they were not there.  visibility: what is drawn and gives light itself."""

    prune: Usd.CollectionMembershipQuery
    visibility: Usd.CollectionMembershipQuery

    def prunes(self, path: Sdf.Path) -> bool:
        """Whether the pass leaves out the prim at this path."""
        return bool(self.prune.IsPathIncluded(path))

    def shows(self, path: Sdf.Path) -> bool:
        """Whether the pass lets the camera see the prim at this path."""
        return bool(self.visibility.IsPathIncluded(path))


def read_pass(stage: Usd.Stage, path: str | None) -> PassRules | None:
    """The rules of the RenderPass at `path`; None for any other prim."""
    prim = stage.GetPrimAtPath(path) if path and path.startswith("/") else None
    if not prim or not prim.IsA(UsdRender.Pass):
        return None
    return PassRules(_query(prim, "prune"), _query(prim, "renderVisibility"))


def pass_issues(stage: Usd.Stage, path: str | None) -> tuple[Unsupported, ...]:
    """The collections of a pass that are authored and not followed."""
    if read_pass(stage, path) is None:
        return ()
    prim = stage.GetPrimAtPath(path)
    authored = (name for name in _UNANSWERED if prim.GetAuthoredPropertiesInNamespace(f"collection:{name}"))
    return tuple(Unsupported(str(prim.GetPath()), f"its collection {name} is not followed") for name in authored)


def _query(prim: Usd.Prim, name: str) -> Usd.CollectionMembershipQuery:
    return Usd.CollectionAPI(prim, name).ComputeMembershipQuery()
