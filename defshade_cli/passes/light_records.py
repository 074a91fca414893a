"""Lights as the shaders read them: a Light record each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.records import record
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.shadow_atlas import ShadowAtlas
from defshade_cli.passes.tables import NO_TABLES, LightTables
from defshade_cli.plan import PlannedLight
from defshade_cli.scene.emission import Emitter
from defshade_cli.scene.light import Light, Profile
from defshade_cli.scene.shadow import PLAIN, ShadowStyle

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile

_PROFILES: tuple[Profile, ...] = ("uniform", "cosine", "sine")
NO_CONE = 2.0 * math.pi
NO_IES = 0xFFFFFFFF


def light_records(
    lights: Sequence[PlannedLight],
    emitters: Sequence[Emitter],
    eye: NDArray[np.float64],
    shadows: ShadowAtlas | None,
    tables: LightTables = NO_TABLES,
) -> NDArray[Any]:
    """One Light record each, (L,); positions relative to the eye (3,)."""
    records = np.zeros(len(lights), record("Light"))
    if not len(records):
        return records
    places = np.array([emitter.position for emitter in emitters])
    centres = np.array([planned.light.position for planned in lights])
    aside = np.linalg.norm(places - centres, axis=1)
    shown = [emitter.shown or emitter for emitter in emitters]
    columns = {
        "position": places - eye,
        "axis": [emitter.axis for emitter in shown],
        "facing": [emitter.facing for emitter in emitters],
        "profile": [_PROFILES.index(emitter.profile) for emitter in emitters],
        "intensity": [emitter.intensity for emitter in emitters],
        "extent": [emitter.extent for emitter in shown],
        "falloff_limit": [emitter.falloff_limit for emitter in shown],
        "reach": np.array([planned.reach for planned in lights]) + aside,
        "response": [(planned.light.diffuse, planned.light.specular) for planned in lights],
        "radius": [emitter.radius for emitter in emitters],
        "centre": [e.shown.position if e.shown else c for e, c in zip(emitters, centres, strict=True)] - eye,
        "is_whole": [emitter.shown is not None for emitter in emitters],
        "by_rays": [planned.by_rays for planned in lights],
        "is_sky": [planned.light.kind == "dome" for planned in lights],
        "first_link": [tables.links.lights.get(planned.light, ALL_LINKED) for planned in lights],
        "cone_angle": NO_CONE,
        "cone_smooth_start": NO_CONE,
        "ies_table": NO_IES,
    }
    with np.errstate(over="ignore"):  # an infinity in the image is found after the frame, with its light
        for name, values in columns.items():
            records[name] = values
    _set_shadow(records, PLAIN)
    _set_styles(records, [planned.light for planned in lights], tables.profiles)
    if shadows:
        records["first_shadow"], records["first_shadow_map"] = shadows.first, shadows.first_record
        records["shadow_count"] = shadows.count
    return records


def _set_styles(records: NDArray[Any], lights: Sequence[Light], profiles: Sequence[IesProfile]) -> None:
    """Shaping and shadows of the few lights that have any of their own."""
    for number, light in enumerate(lights):
        if light.shaping is not None:
            _set_shaping(records[number], light, profiles)
        if light.shadow is not PLAIN:
            _set_shadow(records[number], light.shadow)


def _set_shaping(row: np.void, light: Light, profiles: Sequence[IesProfile]) -> None:
    shaping = light.shaping
    assert shaping is not None
    angle, softness = math.radians(shaping.cone_angle), min(max(shaping.cone_softness, 0.0), 1.0)
    row["cone_angle"], row["cone_smooth_start"] = angle, angle * (1.0 - softness)
    row["focus"], row["focus_tint"] = shaping.focus, shaping.focus_tint
    if shaping.ies is not None:
        row["right"], row["up"] = light.frame[:, 0], light.frame[:, 1]
        row["ies_table"], row["ies_scale"] = profiles.index(shaping.ies), shaping.ies_scale
        row["ies_vertical"] = shaping.ies_vertical


def _set_shadow(rows: np.void | NDArray[Any], shadow: ShadowStyle) -> None:
    """Of one record or of all."""
    rows["shadow_color"], rows["shadow_distance"] = shadow.color, shadow.distance
    rows["shadow_fading"], rows["shadow_gamma"] = shadow.fading, shadow.gamma
