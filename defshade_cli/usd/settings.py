"""What a UsdRenderSettings prim says about the image."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Any

from pxr import Usd, UsdRender

from defshade_cli.scene.camera import Camera
from defshade_cli.scene.window import WHOLE_IMAGE
from defshade_cli.spaces import ConformPolicy

log = logging.getLogger("defshade")

_POLICIES: tuple[ConformPolicy, ...] = (
    "expandAperture",
    "cropAperture",
    "adjustApertureWidth",
    "adjustApertureHeight",
)


@dataclass(frozen=True, slots=True)
class StageSettings:
    """The stage's render settings; the defaults are those of a stage without any.

    camera: prim path.
    pixel_aspect: width over height of a pixel; None lets the image cover the camera's aperture exactly.
    data_window: (xmin, ymin, xmax, ymax), 0..1 over the image, y up.
    rendering_space: colour space that the image is rendered in.
    instantaneous: the shutter closes when it opens.
    """

    camera: str | None = None
    resolution: tuple[int, int] | None = None
    pixel_aspect: float | None = 1.0
    conform: ConformPolicy = "expandAperture"
    data_window: tuple[float, float, float, float] = WHOLE_IMAGE
    rendering_space: str | None = None
    motion_blur: bool = True
    instantaneous: bool = False
    depth_of_field: bool = True

    def applied_to(self, camera: Camera) -> Camera:
        """`camera` with the effects that the settings switch off."""
        opens, closes = camera.shutter if self.motion_blur else (0.0, 0.0)
        f_stop = camera.f_stop if self.depth_of_field else 0.0
        return replace(camera, shutter=(opens, opens if self.instantaneous else closes), f_stop=f_stop)

    def pixel_aspect_for(self, camera: Camera) -> float:
        if self.pixel_aspect is not None or self.resolution is None:
            return self.pixel_aspect or 1.0
        width, height = self.resolution
        return camera.aspect * height / width


def read_settings(stage: Usd.Stage) -> StageSettings:
    """The settings that the stage's renderSettingsPrimPath names, else the only RenderSettings prim below /Render.

    Where the settings have a single product, what is authored on the product goes before them.
    """
    settings = UsdRender.Settings.GetStageRenderSettings(stage) or _only_settings(stage)
    if not settings:
        return StageSettings()
    prims = (*_only_product(settings), settings.GetPrim())
    width, height = _value(prims, "resolution")
    policy = str(_value(prims, "aspectRatioConformPolicy"))
    stretch = policy == UsdRender.Tokens.adjustPixelAspectRatio
    return StageSettings(
        camera=_camera(prims),
        resolution=(width, height) if min(width, height) > 0 else None,
        pixel_aspect=None if stretch else max(float(_value(prims, "pixelAspectRatio")), 0.0) or 1.0,
        conform=next((known for known in _POLICIES if known == policy), "expandAperture"),
        data_window=tuple(_value(prims, "dataWindowNDC")),
        rendering_space=settings.GetRenderingColorSpaceAttr().Get() or None,
        motion_blur=not _value(prims, "disableMotionBlur"),
        instantaneous=bool(_value(prims, "instantaneousShutter")),
        depth_of_field=not _value(prims, "disableDepthOfField"),
    )


def _only_settings(stage: Usd.Stage) -> UsdRender.Settings | None:
    folder = stage.GetPrimAtPath("/Render")
    found = [prim for prim in Usd.PrimRange(folder) if prim.IsA(UsdRender.Settings)] if folder else []
    return UsdRender.Settings(found[0]) if len(found) == 1 else None


def _only_product(settings: UsdRender.Settings) -> tuple[Usd.Prim, ...]:
    stage = settings.GetPrim().GetStage()
    targets = settings.GetProductsRel().GetForwardedTargets()
    product = stage.GetPrimAtPath(targets[0]) if len(targets) == 1 else None
    return (product,) if product and product.IsA(UsdRender.Product) else ()


def _value(prims: tuple[Usd.Prim, ...], name: str) -> Any:
    """The first authored value, else the schema's."""
    attributes = [prim.GetAttribute(name) for prim in prims]
    authored = (attribute for attribute in attributes if attribute.HasAuthoredValue())
    return next(authored, attributes[-1]).Get()


def _camera(prims: tuple[Usd.Prim, ...]) -> str | None:
    targets = (target for prim in prims for target in prim.GetRelationship("camera").GetForwardedTargets())
    return next((str(target) for target in targets), None)
