"""How many points stand for each light in one sample.

Few samples show lights as few points: hard shadows in place of soft ones. So a frame has `light_points` points of a
large light at least, however few its samples are; where several are large they share them, and a light that looks small
needs but one. Numbers are powers of two, at which the points' pattern is a net.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.light import DistantLight, DomeLight, Light, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import is_similarity

MIN_ALPHA = 1e-4  # shaders/lib/constants.glsl

_SMALL, LARGE = 0.03, 0.12
"""Radius over distance: up to the first one point does, up to the second a quarter of the largest lights' number."""

NEAREST_WHOLE = 6.0
"""Radii of a light around it in which no geometry lies, where it shows as a whole."""

_OVERLAPPING = 128
"""Discs of a light that looks smaller than any lobe, at each place of it."""

_FEW_SAMPLES, _FOR_EACH_LOBE, _MOST_WHOLE = 64, 20.0, 1024
"""In which other small lights show as a whole: at least, for each lobe that the light would hold, and at most. More of
them err less by points and rays than wholes do."""

_PARTS = 8
"""Along a pixel's side, of all cells together: highlights that are smaller are spread over one of them."""

_RAYS_FOR_EACH_POINT = 0.25
"""Of a large light, in all samples together; at least."""

_SKY_DIRECTIONS, _FOR_EACH_POINT = 4, 8
"""Of a dome: in a sample, and in all samples together for each point of a large light; at least."""


def points_of(light: Light, shared: int, settings: RenderSettings) -> int:
    """A sample's points of a light, `shared` among most; of a dome directions, 0 where its analytic term does."""
    if not isinstance(light, DomeLight):
        return shared
    if _is_plain(settings):
        return 0
    return max(_power_of_two(_FOR_EACH_POINT * settings.light_points / settings.most_samples), _SKY_DIRECTIONS)


def cell_parts(settings: RenderSettings) -> int:
    """A side of a sample's cell of its pixel, that highlights are looked for in; 0 for the plain equation.

    Fewer as cells become smaller; and one where a single sample is asked, which shall be cheap.
    """
    if _is_plain(settings):
        return 0
    if settings.most_samples == 1:
        return 1
    return min(max(round(_PARTS / math.sqrt(settings.most_samples)), 1), 4)


def samples_whole(light: Light, points: int, size: float, narrowest: float, settings: RenderSettings) -> int:
    """The first samples, in which it shines from its centre and shows in lobes as a whole, its points casting shadows.

    Round lights that look small: their points hardly differ in the diffuse and find few narrow lobes. 0 for others,
    and for those that many samples see better by their points. narrowest: alpha.
    """
    is_round = isinstance(light, DistantLight) or (
        isinstance(light, SphereLight) and is_similarity(light.world_from_light)
    )
    if _is_plain(settings) or points > 1 or not (is_round and 0.0 < size < LARGE):
        return 0
    lobes = (0.5 * size / max(narrowest, MIN_ALPHA)) ** 2
    if lobes <= 1.0:
        return _OVERLAPPING
    few = min(max(_FOR_EACH_LOBE * lobes, _FEW_SAMPLES), _MOST_WHOLE)
    return settings.most_samples if settings.most_samples <= few else 0


def share_shown(index: int, whole: int) -> float:
    """Of the disc of a light, in a sample, that shows as a whole in the first `whole` of them, then less and less."""
    return min(1.0, whole / (index + 1))


def narrowest_lobe(materials: Iterable[Material]) -> float:
    """The least alpha; what an image holds is not known here: it may be 0."""
    lobes = [0.0 if "roughness" in m.inputs else m.roughness for m in materials]
    coats = [m for m in materials if m.clearcoat > 0.0 or "clearcoat" in m.inputs]
    lobes += [0.0 if "clearcoat_roughness" in m.inputs else m.clearcoat_roughness for m in coats]
    return min(lobes, default=1.0) ** 2


def _is_plain(settings: RenderSettings) -> bool:
    """One sample, to which every light is a point?"""
    return settings.most_samples * settings.light_points == 1


def rays_a_sample(settings: RenderSettings) -> int:
    """Of a pixel into a sky, where it has any."""
    return _power_of_two(settings.light_points * _RAYS_FOR_EACH_POINT / settings.most_samples)


def apparent_size(light: Light, bounds: NDArray[np.float64]) -> float:
    """The light's radius over its distance, seen from the middle of the geometry. bounds: (2, 3)."""
    if light.is_infinite or not np.isfinite(bounds).all():
        return light.spread
    distance = float(np.linalg.norm(bounds.mean(axis=0) - light.position))
    return light.spread / max(distance, light.spread) if light.spread > 0.0 else 0.0


def share_points(sizes: Sequence[float], settings: RenderSettings) -> list[int]:
    """Points a sample of each light."""
    large = sum(size > _SMALL for size in sizes)
    most = settings.light_points / settings.most_samples / max(large, 1)
    return [_power_of_two(most * _share(size)) for size in sizes]


def _share(size: float) -> float:
    if size <= _SMALL:
        return 0.0
    return 0.25 if size <= LARGE else 1.0


def _power_of_two(number: float) -> int:
    return 2 ** max(math.floor(math.log2(number)), 0) if number > 1.0 else 1
