"""Strands → Polygons: tubes, or ribbons where normals are authored.

Every sample of every curve is a weighted sum of control points: one sparse matrix takes points, and whatever lies on
them, to samples.

    segments of control points ── basis ── samples along the curves ── frames ── tubes | ribbons
"""

from __future__ import annotations

import numpy as np

from defshade_cli.usd.curves.basis import DETAILS, CurveSamples, sample_curves
from defshade_cli.usd.curves.strands import Strands, laid_along
from defshade_cli.usd.curves.tubes import ribbons, tubes
from defshade_cli.usd.polygons.polygons import Polygons

QUAD_BUDGET = 1_000_000
"""Quads of one prim that its tubes keep to, where three sides and two samples a segment let them."""

_SIDES = (24, 16, 12, 6, 3)
_BUDGETS = (1 << 16, 1 << 17, *[QUAD_BUDGET] * 3)
"""Of tubes at each of DETAILS: few curves, which may be seen from near, cost little however fine they are."""


def swept(strands: Strands) -> Polygons:
    """All curves, each a face in the sense of `Polygons.faces`; tubes without width where none is authored."""
    samples, sides = _detailed(strands)
    centres = samples.vertex @ strands.points.astype(np.float64)
    radii = np.zeros(samples.count) if strands.widths is None else samples.at(strands.widths) / 2.0
    if strands.normals is None:
        shape = tubes(samples, centres, radii, sides)
    else:
        shape = ribbons(samples, centres, radii, samples.at(strands.normals))
    around = len(shape.points) // max(samples.count, 1)
    return laid_along(shape, strands.carried, samples, np.repeat(np.arange(samples.count), around))


def _detailed(strands: Strands) -> tuple[CurveSamples, int]:
    """The finest samples within the budget, and sides; ribbons, which twist, leave out the finest.

    Each edge between two planes that differ is a place where a shadow map errs.
    """
    choices = list(zip(DETAILS, _SIDES, _BUDGETS, strict=True))
    for detail, sides, budget in choices[strands.normals is not None :]:
        samples = sample_curves(strands.kind, strands.counts, len(strands.points), detail)
        if samples.count * sides <= budget:
            break
    return samples, sides
