"""What Arnold's reader makes of a stage by rules of its own, as opinions of the session layer.

arnold-usd, libs/translator/reader/read_geometry.cpp: meshes are not subdivided, unless
`primvars:arnold:subdiv_iterations` asks for it; `primvars:arnold:visibility:camera` hides prims from the camera.
A light that it hides shines on.
"""

from __future__ import annotations

from typing import Any

_ITERATIONS = "primvars:arnold:subdiv_iterations"
_SEEN = "primvars:arnold:visibility:camera"


_SAMPLES, _FEW = "arnold:global:AA_samples", 3
"""Along each side of a pixel, and Arnold's own number of them."""


def read_as_arnold(stage: Any) -> None:
    """stage: Usd.Stage"""
    stage.SetEditTarget(stage.GetSessionLayer())
    for prim in stage.Traverse():
        if prim.GetTypeName() == "Mesh" and not prim.GetAttribute(_ITERATIONS).HasAuthoredValue():
            prim.GetAttribute("subdivisionScheme").Set("none")
        if prim.GetAttribute(_SEEN).Get() is False and not prim.HasAPI("LightAPI"):
            prim.GetAttribute("visibility").Set("invisible")


def samples_of(stage: Any) -> int:
    """How many samples Arnold takes of a pixel, by the first RenderSettings of the stage that say."""
    settings = (prim for prim in stage.Traverse() if prim.GetTypeName() == "RenderSettings")
    sides = (prim.GetAttribute(_SAMPLES).Get() for prim in settings if prim.GetAttribute(_SAMPLES))
    return next((int(side) for side in sides if side), _FEW) ** 2
