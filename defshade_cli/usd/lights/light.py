"""UsdLux lights in scene terms.

What the scene cannot say yet (plug-in lights, filters, connected inputs) is reported; a light that has some of these is
read without them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdLux

from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, DomeLight, Light, RectLight, SphereLight
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.shadow import ShadowStyle
from defshade_cli.scene.shaping import Shaping
from defshade_cli.usd.blame import mistyped
from defshade_cli.usd.color_space import in_rec709, unknown_space
from defshade_cli.usd.lights.dome import is_dome, pole, sky_texture
from defshade_cli.usd.lights.light_files import with_files
from defshade_cli.usd.lights.mesh_light import Glow, is_mesh_light, read_glow
from defshade_cli.usd.values import is_finite, resembles

CAMERA_LIGHT = "<camera light>"
"""Path of the light of a stage that has none."""

_CLASSES: tuple[tuple[Any, type[Light], tuple[str, ...]], ...] = (
    (UsdLux.DistantLight, DistantLight, ("angle",)),
    (UsdLux.SphereLight, SphereLight, ("radius",)),
    (UsdLux.DiskLight, DiskLight, ("radius",)),
    (UsdLux.RectLight, RectLight, ("width", "height")),
    (UsdLux.CylinderLight, CylinderLight, ("radius", "length")),
)
"""Schema, scene class, and the inputs that say its size."""

_GROUP_ATTRIBUTES = (
    "inputs:lightGroup",
    "inputs:ri:light:lightGroup",
    "primvars:arnold:aov",
    "primvars:karma:light:lpetag",
)
"""A light's group: ours, since UsdLux has none, then RenderMan's, Arnold's and Karma's."""

_APIS = {"shaping": "ShapingAPI", "shadow": "ShadowAPI"}
"""By the namespace of their inputs. What is authored there counts also where the schema is not applied, as in Hydra."""

_INPUTS = "inputs:"
_WHITE = np.array(UsdLux.BlackbodyTemperatureAsRgb(6500.0))


def is_light(schemas: Sequence[str]) -> bool:
    """By what is applied to a prim; USD lists what its type has among it."""
    return "LightAPI" in schemas


def read_light(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[Light | Glow | None, tuple[Unsupported, ...]]:
    """The light at `time` in its own space (world_from_light is the identity, or a dome's pole), and what is left out.

    A Glow for what shines by its geometry, None for a kind that is not supported. Purposes do not concern lights, as in
    Hydra; what glows is geometry first.
    """
    path = str(prim.GetPath())
    if is_dome(prim):
        texture, layout, problem = sky_texture(prim, time)
        dome = DomeLight(path=path, world_from_light=pole(prim), texture=texture, layout=layout, **_common(prim, time))
        return dome, tuple(Unsupported(path, reason) for reason in [problem, *_left_out(prim, time)] if reason)
    for schema, light_class, sizes in _CLASSES:
        if prim.IsA(schema):
            fields = {size: _input(prim, size, time) for size in sizes}
            if light_class is SphereLight:
                fields["treat_as_point"] = bool(UsdLux.SphereLight(prim).GetTreatAsPointAttr().Get(time))
            light = light_class(path=path, world_from_light=np.eye(4), **_common(prim, time), **fields)
            light, lost = with_files(light, prim, time)
            return light, tuple(Unsupported(path, reason) for reason in (*lost, *_left_out(prim, time)))
    if is_mesh_light(prim):
        glow = read_glow(prim, **_common(prim, time))
        lost = () if glow else ("it names no geometry",)
        return glow, tuple(Unsupported(path, reason) for reason in (*lost, *_left_out(prim, time)))
    return None, (Unsupported(path, f"lights of type {prim.GetTypeName()} are not supported yet"),)


def camera_light(camera: Camera) -> DistantLight:
    """A light of irradiance π along the camera's view: a white Lambertian surface that faces the camera reads 1.

    It casts no shadow: what the camera sees, its light reaches.
    """
    return DistantLight(
        path=CAMERA_LIGHT,
        world_from_light=camera.world_from_camera,
        color=np.ones(3),
        intensity=math.pi,
        angle=0.0,
        casts_shadow=False,
    )


def temperature_color(kelvin: float) -> NDArray[np.float64]:
    """(3,) linear Rec. 709, white at 6500 K as LightAPI's inputs:colorTemperature asks."""
    return np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin)) / _WHITE


def _common(prim: Usd.Prim, time: Usd.TimeCode) -> dict[str, Any]:
    color = np.array(in_rec709(prim.GetAttribute("inputs:color"), _input(prim, "color", time)), np.float64)
    if _input(prim, "enableColorTemperature", time):
        color = color * temperature_color(_input(prim, "colorTemperature", time))
    has_shadow = _says(prim, "shadow")
    shadow = {"casts_shadow": _input(prim, "shadow:enable", time), "shadow": _shadow(prim, time)} if has_shadow else {}
    values = {name: _input(prim, name, time) for name in ("intensity", "exposure", "normalize", "diffuse", "specular")}
    shaping = _shaping(prim, time) if _says(prim, "shaping") else None
    return {"color": color, "shaping": shaping, "group": _group(prim)} | shadow | values


def _says(prim: Usd.Prim, namespace: str) -> bool:
    """Whether one of _APIS is applied, or something of it authored."""
    return prim.HasAPI(_APIS[namespace]) or bool(prim.GetAuthoredPropertiesInNamespace(_INPUTS + namespace))


def _group(prim: Usd.Prim) -> str:
    """The light group, in the first of the ways to say it; empty without one."""
    values = (attribute.Get() for name in _GROUP_ATTRIBUTES if (attribute := prim.GetAttribute(name)))
    return next((str(value) for value in values if value), "")


def _shadow(prim: Usd.Prim, time: Usd.TimeCode) -> ShadowStyle:
    return ShadowStyle(
        color=tuple(_input(prim, "shadow:color", time)),
        distance=_input(prim, "shadow:distance", time),
        falloff=_input(prim, "shadow:falloff", time),
        gamma=_input(prim, "shadow:falloffGamma", time),
    )


def _shaping(prim: Usd.Prim, time: Usd.TimeCode) -> Shaping:
    return Shaping(
        focus=max(_input(prim, "shaping:focus", time), 0.0),
        focus_tint=tuple(_input(prim, "shaping:focusTint", time)),
        cone_angle=max(_input(prim, "shaping:cone:angle", time), 0.0),
        cone_softness=min(max(_input(prim, "shaping:cone:softness", time), 0.0), 1.0),
        ies_angle_scale=_input(prim, "shaping:ies:angleScale", time),
        ies_normalize=_input(prim, "shaping:ies:normalize", time),
    )


def _left_out(prim: Usd.Prim, time: Usd.TimeCode) -> Iterator[str]:
    if UsdLux.LightAPI(prim).GetFiltersRel().GetForwardedTargets():
        yield "light filters are ignored"
    if old := _of_old(prim):
        yield f"not read, since they lack the inputs: that they have since USD 21.02: {', '.join(old)}"
    authored = {attribute.GetName(): attribute for attribute in prim.GetAuthoredAttributes()}
    if connected := [name for name, attribute in authored.items() if attribute.HasAuthoredConnections()]:
        yield f"connections are ignored: {', '.join(connected)}"
    if space := unknown_space(prim.GetAttribute("inputs:color")):
        yield f"its color counts as linear Rec.709: there is no colour space {space}"
    inputs = {name: attribute for name, attribute in authored.items() if name.startswith(_INPUTS)}
    if odd := [name for name, attribute in inputs.items() if not is_finite(attribute.Get(time))]:
        yield f"not finite, so the schema's own values count: {', '.join(odd)}"
    yield from mistyped(prim)


def _of_old(prim: Usd.Prim) -> list[str]:
    """Inputs under the names that they had before version 21.02, and under no others."""
    names, known = prim.GetAuthoredPropertyNames(), set(prim.GetPrimDefinition().GetPropertyNames())
    unsaid = known.difference(names)
    return [name for name in names if name not in known and _INPUTS + name in unsaid]


def _input(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    """Value of `inputs:name`, or the schema's fallback, also for what is not finite or of another type.

    None where the schema has none.
    """
    attribute = prim.GetAttribute(_INPUTS + name)
    value = attribute.Get(time) if attribute else None
    api = _APIS.get(name.partition(":")[0])
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api) if api else prim.GetPrimDefinition()
    fallback = definition.GetAttributeFallbackValue(_INPUTS + name)
    return value if is_finite(value) and (fallback is None or resembles(value, fallback)) else fallback
