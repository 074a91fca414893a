"""UsdGeom.NurbsPatch → Polygons: points on the surface with its exact normals.

A rational patch is a quotient A/w of two tensor-product B-splines; from A = w S follows w ∂S = ∂A − S ∂w (Piegl and
Tiller, "The NURBS Book", 4.5). Control points run along U first, as Hydra and RenderMan read them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.normals import mend_normals
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.primvars import DISPLAY_COLOR, read_carried
from defshade_cli.usd.values import floats

PATCH_ATTRIBUTES = (
    *("points", "pointWeights", "uVertexCount", "vVertexCount"),
    *("uOrder", "vOrder", "uKnots", "vKnots", "uRange", "vRange"),
)
"""What is read of a NurbsPatch that may vary over time, besides primvars."""

_STEPS = 8
"""Quads along a span between two knots; one where the patch is linear."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class _Direction:
    """One parameter of a patch. count: control points along it.  at: (M,) where the surface is sampled."""

    count: int
    degree: int
    knots: Array
    at: Array

    def evaluate(self, grid: Array, derivative: int = 0) -> Array:
        """(M, ...) of a grid whose first axis is this direction's."""
        if derivative and self.degree == 0:
            return np.zeros((len(self.at), *grid.shape[1:]))
        from scipy.interpolate import BSpline  # half a second to import, and few stages have patches

        spline = BSpline(self.knots, grid, self.degree)
        return (spline.derivative() if derivative else spline)(self.at)


def read_patch(
    patch: UsdGeom.NurbsPatch, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Polygons:
    """The whole patch; trim curves are not cut. Bad data becomes issues."""
    prim = patch.GetPrim()
    if patch.GetTrimCurveCountsAttr().Get(time):
        issues.append("trim curves are ignored: the whole patch is drawn")
    try:
        u, v = _direction(prim, "u", time), _direction(prim, "v", time)
        homogeneous = _homogeneous(patch, u.count * v.count, time)
    except ValueError as error:
        issues.append(f"it is left out: {error}")
        return _grid(np.empty((0, 0, 3)), np.empty((0, 0, 3)))
    points, normals = _surface(homogeneous.reshape(v.count, u.count, 4), u, v)
    left_handed = patch.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    elements = {"constant": 1, "uniform": 1, "vertex": u.count * v.count}
    surface = replace(
        _grid(points, -normals if left_handed else normals),
        left_handed=left_handed,
        **read_carried(prim, time, elements, issues, color)._asdict(),
    )
    return mend_normals(surface.with_primvars(lambda p: p if p is surface.normals else _sampled(p, u, v)), [])


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
    spans = np.unique(np.concatenate([[low, high], knots[(knots > low) & (knots < high)]]))
    steps = 1 if order == 2 else _STEPS
    inner = spans[:-1, None] + np.diff(spans)[:, None] * (np.arange(steps) / steps)
    return _Direction(count, order - 1, knots, np.append(inner.ravel(), high))


def _homogeneous(patch: UsdGeom.NurbsPatch, count: int, time: Usd.TimeCode) -> Array:
    """(count, 4) points times their weights, and the weights. Raises ValueError."""
    value, authored = patch.GetPointsAttr().Get(time), patch.GetPointWeightsAttr().Get(time)
    points = None if value is None else floats(value, 3)
    if points is None or len(points) != count or not np.isfinite(points).all():
        raise ValueError(f"points are not {count} finite ones")
    weights = np.ones(count) if authored is None or not len(authored) else np.asarray(authored, np.float64)
    if len(weights) != count or not (weights > 0).all() or not np.isfinite(weights).all():
        raise ValueError(f"pointWeights are not {count} positive numbers")
    return np.column_stack([points * weights[:, None], weights])


def _surface(grid: Array, u: _Direction, v: _Direction) -> tuple[Array, Array]:
    """(M, N, 3) points, and normals along ∂S/∂u × ∂S/∂v, over the samples of v and u; zero where it degenerates."""

    def patch(along_u: int, along_v: int) -> Array:
        rows = v.evaluate(grid, along_v)
        return u.evaluate(rows.swapaxes(0, 1), along_u).swapaxes(0, 1)

    surface = patch(0, 0)
    points = surface[..., :3] / surface[..., 3:]
    along_u, along_v = (d[..., :3] - points * d[..., 3:] for d in (patch(1, 0), patch(0, 1)))
    return points, np.cross(along_u, along_v)


def _grid(points: Array, normals: Array) -> Polygons:
    """Quads over points (M, N, 3), wound along the second axis first."""
    rows, columns = points.shape[:2]
    first = (np.arange(max(rows - 1, 0))[:, None] * columns + np.arange(max(columns - 1, 0))).ravel()
    corners = np.stack([first, first + 1, first + columns + 1, first + columns], axis=1)
    return Polygons(
        points=points.reshape(-1, 3).astype(np.float32),
        counts=np.full(len(corners), 4),
        indices=corners.ravel(),
        faces=np.zeros(len(corners), np.int32),
        normals=Primvar(normals.reshape(-1, 3).astype(np.float32), "vertex"),
    )


def _sampled(primvar: Primvar, u: _Direction, v: _Direction) -> Primvar:
    """A primvar of the control points on the surface; `vertex` values weigh as polynomials do."""
    if primvar.interpolation != "vertex":
        return primvar
    shape = primvar.values.shape[1:]
    rows = v.evaluate(primvar.values.reshape(v.count, u.count, *shape).astype(np.float64))
    values = u.evaluate(rows.swapaxes(0, 1)).swapaxes(0, 1)
    return replace(primvar, values=values.reshape(-1, *shape).astype(np.float32))
