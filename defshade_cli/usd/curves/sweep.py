"""Strands → Polygons: tubes, or ribbons where normals are authored.

Every sample of every curve is a weighted sum of control points: one sparse matrix takes points, and whatever lies on
them, to samples.

    segments of control points ── basis ── samples along the curves ── frames ── tubes | ribbons
"""

from __future__ import annotations

import numpy as np

from defshade_cli.usd.curves.basis import LARGEST_DETAIL, CurveSamples, sample_curves
from defshade_cli.usd.curves.strands import Strands, laid_along
from defshade_cli.usd.curves.tubes import ribbons, tubes
from defshade_cli.usd.polygons.polygons import Polygons

QUAD_BUDGET = 1_000_000
"""Quads of one prim up to which its tubes are round, and its segments many; more get the next lower detail."""

_DETAILS = ((LARGEST_DETAIL, 12), (4, 6), (2, 3))
"""Samples a segment of cubic curves, and sides of tubes."""


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
    """The finest samples within the budget, and sides."""
    for detail, sides in _DETAILS:
        samples = sample_curves(strands.kind, strands.counts, len(strands.points), detail)
        if samples.count * sides <= QUAD_BUDGET:
            break
    return samples, sides
