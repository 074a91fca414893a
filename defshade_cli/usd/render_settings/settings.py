"""What a UsdRenderSettings prim says about the image."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

from pxr import Usd, UsdRender

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.window import WHOLE_IMAGE
from defshade_cli.spaces import ConformPolicy
from defshade_cli.usd.materials.bindings import PURPOSES
from defshade_cli.usd.render_settings.products import find_settings

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
    purposes: of the geometry that is drawn.
    material_purposes: of bindings, in order of preference.
    rendering_space: colour space that the image is rendered in.
    instantaneous: the shutter closes when it opens.
    """

    camera: str | None = None
    resolution: tuple[int, int] | None = None
    pixel_aspect: float | None = 1.0
    conform: ConformPolicy = "expandAperture"
    data_window: tuple[float, float, float, float] = WHOLE_IMAGE
    purposes: tuple[str, ...] = ("default", "render")
    material_purposes: tuple[str, ...] = PURPOSES
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
        """Width of a pixel over its height, as authored, else what fills the resolution with the camera's window."""
        if self.pixel_aspect is not None or self.resolution is None:
            return self.pixel_aspect or 1.0
        width, height = self.resolution
        return camera.aspect * height / width


def read_settings(stage: Usd.Stage, path: str | None = None, product: str = "") -> StageSettings:
    """The settings at `path`, or what products.find_settings finds; what is authored on `product` goes before them.

    Raises PrimNotFound for a path without settings.
    """
    settings = find_settings(stage, path)
    if not settings:
        return StageSettings()
    own = stage.GetPrimAtPath(product) if product else None
    prims = (own, settings.GetPrim()) if own else (settings.GetPrim(),)
    width, height = _value(prims, "resolution")
    policy = str(_value(prims, "aspectRatioConformPolicy"))
    stretch = policy == UsdRender.Tokens.adjustPixelAspectRatio
    return StageSettings(
        camera=_camera(prims),
        resolution=(width, height) if min(width, height) > 0 else None,
        pixel_aspect=None if stretch else max(float(_value(prims, "pixelAspectRatio")), 0.0) or 1.0,
        conform=next((known for known in _POLICIES if known == policy), "expandAperture"),
        data_window=tuple(_value(prims, "dataWindowNDC")),
        purposes=tuple(str(name) for name in settings.GetIncludedPurposesAttr().Get()),
        material_purposes=_material_purposes(settings),
        rendering_space=settings.GetRenderingColorSpaceAttr().Get() or None,
        motion_blur=not _value(prims, "disableMotionBlur"),
        instantaneous=bool(_value(prims, "instantaneousShutter")),
        depth_of_field=not _value(prims, "disableDepthOfField"),
    )


def _material_purposes(settings: UsdRender.Settings) -> tuple[str, ...]:
    """As authored; the schema's own value would leave out previews, which are often all that we understand."""
    attribute = settings.GetMaterialBindingPurposesAttr()
    return tuple(map(str, attribute.Get())) if attribute.HasAuthoredValue() else PURPOSES


def _value(prims: tuple[Usd.Prim, ...], name: str) -> Any:
    """The first authored value, else the schema's."""
    attributes = [prim.GetAttribute(name) for prim in prims]
    authored = (attribute for attribute in attributes if attribute.HasAuthoredValue())
    return next(authored, attributes[-1]).Get()


def _camera(prims: tuple[Usd.Prim, ...]) -> str | None:
    targets = (target for prim in prims for target in prim.GetRelationship("camera").GetForwardedTargets())
    return next((str(target) for target in targets), None)
