"""Polygons around sampled curves: round tubes, and ribbons across a normal.

A tube's frames are carried along the curve by the least rotation from each tangent to the next (rotation-minimising,
Bishop 1975), so that it does not twist. The running product of those rotations is taken in log₂ n steps for all curves
at once (Hillis and Steele 1986).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.spaces import normalize
from defshade_cli.usd.curves.basis import CurveSamples
from defshade_cli.usd.polygons.polygons import Polygons, Primvar

Vectors = NDArray[np.float64]

TOUCHING = 1e-6
"""Of the size of all curves of a prim: ends that are no farther apart are one."""

_LONGEST_MITRE = 4.0
"""In radii: the tip of a sharp bend, as in PostScript's mitre limit."""


def tubes(samples: CurveSamples, centres: Vectors, radii: NDArray[np.float64], sides: int) -> Polygons:
    """Round, `sides` points a sample, open at their ends. centres (N, 3), radii (N,): in scene units."""
    course = _course(samples, centres)
    across = _frames(samples, course)
    angle = np.arange(sides) * (2.0 * math.pi / sides)
    beside = np.cross(course.tangent, across)
    normals = across[:, None] * np.cos(angle)[:, None] + beside[:, None] * np.sin(angle)[:, None]
    points = centres[:, None] + radii[:, None, None] * course.mitred(normals)
    return _strips(samples, points, normals, np.arange(sides), np.roll(np.arange(sides), -1))


def ribbons(samples: CurveSamples, centres: Vectors, radii: NDArray[np.float64], normals: Vectors) -> Polygons:
    """Flat, two points a sample, facing along `normals` (N, 3) as far as these are across the curve.

    centres (N, 3), radii (N,): in scene units.
    """
    course = _course(samples, centres)
    sideways = normalize(np.cross(normals, course.tangent))
    facing = np.cross(course.tangent, sideways)
    points = centres[:, None] + radii[:, None, None] * course.mitred(np.stack([sideways, -sideways], axis=1))
    return _strips(samples, points, np.repeat(facing[:, None], 2, axis=1), np.array([0]), np.array([1]))


@dataclass(frozen=True, eq=False, slots=True)
class _Course:
    """Where curves lead at each of S samples.

    tangent: (S, 3) unit, halfway between the ways in and out.  bend: (S, 3) unit, across it, towards the outside of
    the turn; zero where there is none.  stretch: (S,) how much longer a cut through the tube is there.
    meeting: (K,) whether a curve with samples ends where it begins, and its last sample stands for its first.
    """

    tangent: Vectors
    bend: Vectors
    stretch: NDArray[np.float64]
    meeting: NDArray[np.bool_]

    def mitred(self, offsets: Vectors) -> Vectors:
        """Offsets (S, K, 3) across the curve, so that the straight parts before and after keep their width."""
        along_bend = np.einsum("ski,si->sk", offsets, self.bend)[..., None]
        return offsets + (self.stretch - 1.0)[:, None, None] * along_bend * self.bend[:, None]


def _strips(
    samples: CurveSamples, points: Vectors, normals: Vectors, left: NDArray[np.intp], right: NDArray[np.intp]
) -> Polygons:
    """Quads from each sample to the next, between points `left` and `right` of points (S, K, 3)."""
    around = points.shape[1]
    after = following(samples)
    here = np.flatnonzero(after >= 0)
    there = after[here]
    corners = np.stack(
        [
            here[:, None] * around + left,
            here[:, None] * around + right,
            there[:, None] * around + right,
            there[:, None] * around + left,
        ],
        axis=-1,
    ).reshape(-1, 4)
    return Polygons(
        points=points.reshape(-1, 3).astype(np.float32),
        counts=np.full(len(corners), 4),
        indices=corners.ravel(),
        faces=np.repeat(samples.curve[here], len(left)).astype(np.int32),
        normals=Primvar(normals.reshape(-1, 3).astype(np.float32), "vertex"),
    )


def following(samples: CurveSamples) -> NDArray[np.intp]:
    """(S,) the sample after each; −1 at the end of an open curve."""
    following = np.arange(1, samples.count + 1)
    first, last = _ends(samples)
    following[last] = first if samples.closed else -1
    return following


def _ends(samples: CurveSamples) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last sample of each curve that has any."""
    changes = np.flatnonzero(np.diff(samples.curve, prepend=-1))
    return changes, np.append(changes[1:], samples.count)[: len(changes)] - 1


def _course(samples: CurveSamples, centres: Vectors) -> _Course:
    """From the sample before to the one after; along the Z axis where a curve stands still."""
    after = following(samples)
    after = np.where(after >= 0, after, np.arange(samples.count))
    before = np.arange(-1, samples.count - 1)
    first, last = _ends(samples)
    before[first] = last if samples.closed else first
    meeting = _meeting(samples, centres)
    before[first[meeting]], after[last[meeting]] = last[meeting] - 1, first[meeting] + 1
    inward, outward = normalize(centres - centres[before]), normalize(centres[after] - centres)
    inward = np.where(inward.any(axis=1, keepdims=True), inward, outward)
    outward = np.where(outward.any(axis=1, keepdims=True), outward, inward)
    tangent = normalize(inward + outward)
    reversed_ = ~tangent.any(axis=1)
    tangent[reversed_] = inward[reversed_]
    tangent[~tangent.any(axis=1)] = (0.0, 0.0, 1.0)
    cosine = np.einsum("si,si->s", inward, tangent)
    stretch = 1.0 / np.maximum(cosine, 1.0 / _LONGEST_MITRE)
    return _Course(tangent, normalize(inward - outward), stretch, meeting)


def _meeting(samples: CurveSamples, centres: Vectors) -> NDArray[np.bool_]:
    """(K,) of curves that are sampled as open ones, those whose ends are one; a way there and back is none."""
    first, last = _ends(samples)
    if samples.closed or not len(first):
        return np.zeros(len(first), bool)
    apart = np.abs(centres[first] - centres[last]).max(axis=1)
    return (last - first > 2) & (apart <= TOUCHING * np.ptp(centres))


def _frames(samples: CurveSamples, course: _Course) -> Vectors:
    """(S, 3) unit vectors across the tangents, which turn no more than these do; a closed curve's twist is spread."""
    tangents, meeting = course.tangent, course.meeting
    first, last = _ends(samples)
    lengths = last - first + 1
    start, place = np.repeat(first, lengths), np.arange(samples.count) - np.repeat(first, lengths)
    turns = _least_rotations(tangents[np.maximum(np.arange(samples.count) - 1, start)], tangents)
    carried = _running_products(turns, place)
    origin = _across(tangents[first])
    across = _rotated(carried, np.repeat(origin, lengths, axis=0))
    if samples.closed or meeting.any():
        home = _rotated(_least_rotations(tangents[last], tangents[first]), across[last])
        twist = np.arctan2(np.einsum("ki,ki->k", np.cross(home, origin), tangents[first]), (home * origin).sum(axis=1))
        steps = np.where(meeting, lengths - 1, lengths)
        angle = np.repeat(np.where(meeting | samples.closed, twist / steps, 0.0), lengths) * place
        across = across * np.cos(angle)[:, None] + np.cross(tangents, across) * np.sin(angle)[:, None]
    return across


def _across(directions: Vectors) -> Vectors:
    """(K, 3) unit vectors at right angles, from the axis that is farthest from each direction."""
    axis = np.eye(3)[np.abs(directions).argmin(axis=1)]
    return normalize(np.cross(directions, axis))


def _least_rotations(from_: Vectors, to: Vectors) -> NDArray[np.float64]:
    """(N, 4) unit quaternions w, x, y, z; half a turn across where the two are opposed."""
    cosine = np.einsum("ni,ni->n", from_, to)
    quaternions = np.column_stack([1.0 + cosine, np.cross(from_, to)])
    opposed = cosine < -1.0 + 1e-12
    quaternions[opposed] = np.column_stack([np.zeros(opposed.sum()), _across(from_[opposed])])
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _running_products(turns: NDArray[np.float64], place: NDArray[np.intp]) -> NDArray[np.float64]:
    """(S, 4) at each sample the product of all turns up to it along its curve."""
    product, step = turns.copy(), 1
    while step <= place.max(initial=0):
        later = np.flatnonzero(place >= step)
        product[later] = _multiply(product[later], product[later - step])
        step *= 2
    return product


def _multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4) the rotation b, then a."""
    scalar = a[:, 0] * b[:, 0] - np.einsum("ni,ni->n", a[:, 1:], b[:, 1:])
    vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.column_stack([scalar, vector])


def _rotated(quaternions: NDArray[np.float64], vectors: Vectors) -> Vectors:
    """(N, 3)"""
    w, axis = quaternions[:, :1], quaternions[:, 1:]
    across = 2.0 * np.cross(axis, vectors)
    return vectors + w * across + np.cross(axis, across)
