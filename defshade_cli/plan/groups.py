"""Light groups: which layers `light:…` a light adds to.

light:key*      lights whose group, or whose prim's name, matches; the group is what inputs:lightGroup says, or its
                like of RenderMan, Arnold and Karma (usd/lights/light.py)
light:/World/*  lights whose path matches
light:default   lights that no other layer of the request holds, and all that is emitted
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from fnmatch import fnmatchcase

from defshade_cli.errors import UsageError
from defshade_cli.gpu.outputs import OUTPUTS, most_groups
from defshade_cli.image.layers import DEFAULT_GROUP, LIGHT_FAMILY
from defshade_cli.scene.light import Light

log = logging.getLogger("defshade")


def light_outputs(layers: Sequence[str]) -> tuple[str, ...]:
    """Of these layers those that the light volumes write beside their radiance."""
    return tuple(name for name in OUTPUTS if name in layers)


def light_groups(layers: Sequence[str]) -> tuple[str, ...]:
    """Of these layers those that are sums of some lights."""
    return tuple(name for name in layers if name.startswith(LIGHT_FAMILY))


def group_lights(lights: Sequence[Light], layers: Sequence[str], outputs: Sequence[str]) -> list[tuple[str, ...]]:
    """For each light the group layers that it adds to, of those in `layers`. outputs: other sums that are asked for.

    Raises UsageError where a light is in more groups than a framebuffer takes.
    """
    groups = [_groups_of(light, layers) for light in lights]
    for layer in layers:
        if layer != DEFAULT_GROUP and not any(layer in of_light for of_light in groups):
            log.warning("%s: no light has such a group, name or path", layer)
    if max(map(len, groups), default=0) > most_groups(outputs):
        light = next(
            light for light, of_light in zip(lights, groups, strict=True) if len(of_light) > most_groups(outputs)
        )
        raise UsageError(f"{light.path} is in more than {most_groups(outputs)} of the light groups asked for at once")
    return groups


def _groups_of(light: Light, layers: Sequence[str]) -> tuple[str, ...]:
    found = tuple(layer for layer in layers if layer != DEFAULT_GROUP and _matches(light, layer))
    return found or tuple(layer for layer in layers if layer == DEFAULT_GROUP)


def _matches(light: Light, layer: str) -> bool:
    pattern = layer.removeprefix(LIGHT_FAMILY)
    names = (light.path,) if pattern.startswith("/") else (light.group, light.path.rpartition("/")[2])
    return any(name and fnmatchcase(name, pattern) for name in names)
