"""UsdGeom.NurbsPatch → Polygons: points on the surface with its exact normals.

A rational patch is a quotient A/w of two tensor-product B-splines; from A = w S follows w ∂S = ∂A − S ∂w (Piegl and
Tiller, "The NURBS Book", 4.5). Control points run along U first, as Hydra and RenderMan read them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.nurbs.trim import TRIM_ATTRIBUTES, inside, read_loops
from defshade_cli.usd.polygons.normals import mend_normals
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, read_carried
from defshade_cli.usd.values import floats

PATCH_ATTRIBUTES = (
    *("points", "pointWeights", "uVertexCount", "vVertexCount"),
    *("uOrder", "vOrder", "uKnots", "vKnots", "uRange", "vRange"),
    *TRIM_ATTRIBUTES,
)
"""What is read of a NurbsPatch that may vary over time, besides primvars."""

_STEPS = {32: 1 << 6, 16: 1 << 9}
"""Quads along a span between two knots, of patches of up to so many spans; one where it is linear and not trimmed."""

_LEAST_STEPS = 8
"""Of patches with more."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Direction:
    """One parameter of a patch. count: control points along it.  low, high: its range."""

    count: int
    degree: int
    knots: Array
    low: float
    high: float

    @cached_property
    def spans(self) -> Array:
        """(S + 1,) parameters between which its S spans lie."""
        inside = self.knots[(self.knots > self.low) & (self.knots < self.high)]
        return np.unique([self.low, self.high, *inside])

    @property
    def by_spans(self) -> _Direction:
        """The same parameter with a value at each end of a span, and lines between."""
        spans = self.spans
        return _Direction(len(spans), 1, np.concatenate([spans[:1], spans, spans[-1:]]), self.low, self.high)

    def samples(self, steps: int, *, finely: bool = False) -> Array:
        """(M,) parameters at which the patch is sampled, in so many steps a span."""
        spans = self.spans
        steps = 1 if self.degree == 1 and not finely else steps
        inner = spans[:-1, None] + np.diff(spans)[:, None] * (np.arange(steps) / steps)
        return np.append(inner.ravel(), self.high)


class _Cut(NamedTuple):
    """Where a patch is sampled: at (P, 2) u and v.  corners: (F, 3 or 4) faces of these, wound along u first."""

    at: Array
    corners: NDArray[np.integer]


def read_patch(
    patch: UsdGeom.NurbsPatch, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Polygons:
    """What its trim curves leave of the patch. Bad data becomes issues."""
    prim = patch.GetPrim()
    try:
        u, v = _direction(prim, "u", time), _direction(prim, "v", time)
        control = homogeneous_points(patch, u.count * v.count, time).reshape(v.count, u.count, 4)
    except ValueError as error:
        issues.append(f"it is left out: {error}")
        return _polygons(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 4), int))
    where = _cut(patch, u, v, time, issues)
    points, normals = _surface(control, u, v, where.at)
    left_handed = patch.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    elements = {"constant": 1, "uniform": 1, "vertex": u.count * v.count, "varying": len(u.spans) * len(v.spans)}
    surface = replace(
        _polygons(points, -normals if left_handed else normals, where.corners),
        left_handed=left_handed,
        **read_carried(prim, time, elements, issues, color)._asdict(),
    )
    return mend_normals(surface.with_primvars(lambda p: p if p is surface.normals else _sampled(p, u, v, where.at)), [])


def _cut(patch: UsdGeom.NurbsPatch, u: _Direction, v: _Direction, time: Usd.TimeCode, issues: list[str]) -> _Cut:
    """The whole patch in quads, or in triangles what is inside its trim curves."""
    spans = (len(u.spans) - 1) * (len(v.spans) - 1)
    steps = next((steps for steps, most in _STEPS.items() if spans <= most), _LEAST_STEPS)
    if patch.GetTrimCurveCountsAttr().Get(time):
        try:
            cut = _Cut(*inside(read_loops(patch, time), u.samples(steps, finely=True), v.samples(steps, finely=True)))
        except ValueError as error:
            issues.append(f"trim curves are ignored: {error}")
        else:
            if not len(cut.corners):
                issues.append("its trim curves leave nothing of it")
            return cut
    us, vs = u.samples(steps), v.samples(steps)
    first = (np.arange(len(vs) - 1)[:, None] * len(us) + np.arange(len(us) - 1)).ravel()
    corners = np.stack([first, first + 1, first + len(us) + 1, first + len(us)], axis=1)
    return _Cut(np.stack(np.meshgrid(us, vs), axis=-1).reshape(-1, 2), corners)


def _direction(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> _Direction:
    """Raises ValueError where order, knots and range do not fit each other."""
    count, order = (prim.GetAttribute(f"{name}{what}").Get(time) or 0 for what in ("VertexCount", "Order"))
    knots = np.asarray(prim.GetAttribute(f"{name}Knots").Get(time) or [], np.float64)
    if order < 2 or count < order:
        raise ValueError(f"{name}Order {order} and {count} points along {name} make no surface")
    if len(knots) != count + order or not np.isfinite(knots).all() or (np.diff(knots) < 0).any():
        raise ValueError(f"{name}Knots are not {count + order} ascending numbers")
    whole = knots[order - 1], knots[count]
    authored = prim.GetAttribute(f"{name}Range").Get(time)
    low, high = whole if authored is None else np.clip(tuple(authored), *whole)
    if not low < high:
        raise ValueError(f"{name}Range is empty")
    return _Direction(count, order - 1, knots, low, high)


def homogeneous_points(based: UsdGeom.NurbsPatch | UsdGeom.NurbsCurves, count: int, time: Usd.TimeCode) -> Array:
    """(count, 4) points times their weights, and the weights. Raises ValueError."""
    value, authored = based.GetPointsAttr().Get(time), based.GetPointWeightsAttr().Get(time)
    points = None if value is None else floats(value, 3)
    if points is None or len(points) != count or not np.isfinite(points).all():
        raise ValueError(f"points are not {count} finite ones")
    weights = np.ones(count) if authored is None or not len(authored) else np.asarray(authored, np.float64)
    if len(weights) != count or not (weights > 0).all() or not np.isfinite(weights).all():
        raise ValueError(f"pointWeights are not {count} positive numbers")
    return np.column_stack([points * weights[:, None], weights])


def _evaluated(grid: Array, u: _Direction, v: _Direction, at: Array, along: tuple[int, int] = (0, 0)) -> Array:
    """(P, ...) of a grid (V, U, ...) at u and v (P, 2). along: derivatives by u and v."""
    from scipy.interpolate import NdBSpline  # half a second to import, and few stages have patches

    spline = NdBSpline((v.knots, u.knots), grid, (v.degree, u.degree))
    return spline(np.ascontiguousarray(at[:, ::-1]), nu=along[::-1])


def _surface(control: Array, u: _Direction, v: _Direction, at: Array) -> tuple[Array, Array]:
    """(P, 3) points, and normals along ∂S/∂u × ∂S/∂v, at u and v (P, 2); zero where it degenerates."""
    surface = _evaluated(control, u, v, at)
    points = surface[:, :3] / surface[:, 3:]
    slopes = (_evaluated(control, u, v, at, along) for along in ((1, 0), (0, 1)))
    along_u, along_v = (slope[:, :3] - points * slope[:, 3:] for slope in slopes)
    return points, np.cross(along_u, along_v)


def _polygons(points: Array, normals: Array, corners: NDArray[np.integer]) -> Polygons:
    """Faces (F, n) over points (P, 3)."""
    return Polygons(
        points=points.astype(np.float32),
        counts=np.full(len(corners), corners.shape[1]),
        indices=corners.ravel(),
        faces=np.zeros(len(corners), np.int32),
        normals=Primvar(normals.astype(np.float32), "vertex"),
    )


def _sampled(primvar: Primvar, u: _Direction, v: _Direction, at: Array) -> Primvar:
    """A primvar on the surface: `vertex` values weigh as polynomials do, `varying` ones are bilinear in each span."""
    if primvar.interpolation == "varying":
        u, v = u.by_spans, v.by_spans
    elif primvar.interpolation != "vertex":
        return primvar
    grid = primvar.values.reshape(v.count, u.count, *primvar.values.shape[1:]).astype(np.float64)
    return replace(primvar, values=_evaluated(grid, u, v, at).astype(np.float32), interpolation="vertex")
