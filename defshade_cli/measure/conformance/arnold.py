"""What Arnold's reader makes of a stage by rules of its own, as opinions of the session layer.

arnold-usd, libs/translator/reader/read_geometry.cpp: meshes are not subdivided, unless
`primvars:arnold:subdiv_iterations` asks for it; `primvars:arnold:visibility:camera` hides prims from the camera.
A light that it hides shines on.
"""

from __future__ import annotations

from typing import Any

_ITERATIONS = "primvars:arnold:subdiv_iterations"
_SEEN = "primvars:arnold:visibility:camera"


def read_as_arnold(stage: Any) -> None:
    """stage: Usd.Stage"""
    stage.SetEditTarget(stage.GetSessionLayer())
    for prim in stage.Traverse():
        if prim.GetTypeName() == "Mesh" and not prim.GetAttribute(_ITERATIONS).HasAuthoredValue():
            prim.GetAttribute("subdivisionScheme").Set("none")
        if prim.GetAttribute(_SEEN).Get() is False and not prim.HasAPI("LightAPI"):
            prim.GetAttribute("visibility").Set("invisible")
