"""Which planes a frame fills: those that samples are lit from, and those that data layers show."""

from __future__ import annotations

from defshade_cli.errors import UsageError
from defshade_cli.gpu.planes import MOST_PRIMVARS, MOST_TARGETS, Plane, named_planes, needed_planes
from defshade_cli.image.layers import LAYERS, PRIMVAR_FAMILY
from defshade_cli.plan.opacity import is_transparent
from defshade_cli.scene.material import UNBOUND, Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings


def is_lit(layers: tuple[str, ...]) -> bool:
    """Does any need the lighting?"""
    return any(LAYERS[name].source == "lighting" for name in layers)


def primvar_names(layers: tuple[str, ...]) -> tuple[str, ...]:
    """Of the layers that show primvars, these."""
    return tuple(name.removeprefix(PRIMVAR_FAMILY) for name in layers if name.startswith(PRIMVAR_FAMILY))


def divide_planes(
    scene: Scene, settings: RenderSettings, layers: tuple[str, ...], thin: tuple[Material, ...]
) -> tuple[tuple[Plane, ...], tuple[Plane, ...], bool]:
    """Planes of the samples' GBuffer, planes of the data layers, and whether these need a GBuffer of their own.

    One exact sample at the pixels' centres serves both, unless it is jittered, quantised or dithered, or the planes
    are too many. Raises UsageError for more primvars than can be shown.
    """
    rows = [LAYERS[name] for name in layers]
    lit = _lit_planes(scene, settings, thin) if is_lit(layers) else ()
    lit += named_planes("visible" for row in rows if row.source == "matte")
    shown = primvar_names(layers)
    if len(shown) > MOST_PRIMVARS:
        raise UsageError(f"{len(shown)} primvars are asked for as layers, and {MOST_PRIMVARS} can be shown at once")
    data = named_planes([row.source for row in rows] + [f"primvar_{i}" for i in range(len(shown))])
    both = named_planes(plane.name for plane in (*lit, *data))
    sampled, has_data = any(row.is_sampled for row in rows), not all(row.is_sampled for row in rows)
    exact = settings.layout == "float" and settings.most_samples == 1 and not thin and len(both) <= MOST_TARGETS
    data_pass = has_data and not (sampled and exact)
    return (lit if data_pass or not has_data else both), data, data_pass


def _lit_planes(scene: Scene, settings: RenderSettings, thin: tuple[Material, ...]) -> tuple[Plane, ...]:
    names = [plane.name for plane in needed_planes(scene.materials or (UNBOUND,))]
    names += ["links"] * scene.light_linked + ["weights"] * is_transparent(thin, settings.shading)
    falls_by_coins = any(material.opacity_threshold == 0.0 for material in thin)
    return named_planes(names + ["triangle"] * (settings.shadows and falls_by_coins and len(names) < MOST_TARGETS - 1))
