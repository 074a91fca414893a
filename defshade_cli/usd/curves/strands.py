"""Curves as pieces that face the image, shaped once the camera is known: as Hydra draws them at a fixed complexity.

    always          where no widths are authored, lines one pixel wide along the curves
    low             lines one pixel wide along the control points, whatever the basis and the widths
    medium, high    ribbons as wide as the curves; flat, and with the normals of a tube

A ribbon has a piece for each 20 pixels of its control polygon, and each segment is cut straight across at its ends:
hdSt/basisCurves.cpp, hdSt/shaders/basisCurves.glslfx. From `veryhigh` on Hydra draws half tubes; there ours are whole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.view import View
from defshade_cli.spaces import Matrix, cross, normalize, transform_directions, transform_points
from defshade_cli.usd.curves.basis import (
    DETAILS,
    CurveSamples,
    Kind,
    Places,
    control_samples,
    control_weights,
    sample_at,
    sample_curves,
    tangent_weights,
)
from defshade_cli.usd.curves.tubes import following
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.polygons.primvars import Carried
from defshade_cli.usd.values import places_in_runs

Vectors = NDArray[np.float64]

ROUND_LEVEL, TUBE_LEVEL = 2, 3
"""Of refinement: from where on ribbons have the normals of tubes, and from where on tubes are drawn."""

_PIXELS_A_PIECE = 20.0
_MOST_PIECES = 40.0
_BEYOND = 1.3
"""Half widths of the image from its middle at which control points are held, so that what is out of sight is coarse."""

_LINE_DETAILS, _LINE_BUDGET = DETAILS[:3], 1 << 16
"""Samples a segment of curves without widths, and how many of a prim all but the coarsest may have."""

_ACROSS = {False: np.array([-1.0, 1.0]), True: np.sin(np.linspace(-np.pi / 2, np.pi / 2, 7))}
"""Where points lie across a ribbon, from edge to edge: flat, and round."""


@dataclass(frozen=True, slots=True, eq=False)
class Strands:
    """Curves before they are sampled.

    counts: (K,) control points of each curve, all there.  points: (P, 3) float32, finite.
    widths, normals, carried: fit the kind's elements; None where none are authored that do.  Curves with normals are
        ribbons that lie as these say.
    loops: the wrap is authored as periodic; lines are closed even where no number of segments closes the curves.
    """

    kind: Kind
    counts: NDArray[np.int64]
    points: NDArray[np.float32]
    widths: Primvar | None
    normals: Primvar | None
    carried: Carried
    loops: bool

    def face_at(self, level: int | None) -> bool:
        """Whether they face the image at a level of refinement, None for what they are from all sides."""
        if self.widths is None or level is None:
            return self.widths is None
        return level == 0 or (level < TUBE_LEVEL and self.normals is None)

    def facing(self, camera_from_object: Matrix, view: View, level: int | None) -> Polygons:
        """The pieces in camera space, of strands that face the image."""
        points = transform_points(camera_from_object, self.points.astype(np.float64))
        if level != 0 and self.widths is not None:
            across = _ACROSS[level is not None and level >= ROUND_LEVEL]
            return _polygons(self._ribbons(self.widths, points, camera_from_object, view), across, self.carried)
        if level == 0:
            samples = control_samples(self.kind, self.counts, len(points), self.loops)
        else:
            samples = sample_curves(self.kind, self.counts, len(points), self._line_detail)
        return _polygons(_lines(samples, points, view), _ACROSS[False], self.carried)

    @property
    def _line_detail(self) -> int:
        segments = int(self.kind.segments(self.counts).sum())
        return next((detail for detail in _LINE_DETAILS if detail * segments <= _LINE_BUDGET), _LINE_DETAILS[-1])

    def _ribbons(self, widths: Primvar, points: Vectors, camera_from_object: Matrix, view: View) -> _Pieces:
        places, start = self._cut(points, view)
        samples = sample_at(self.kind, self.counts, len(points), places)
        tangents = tangent_weights(self.kind, self.counts, len(points), places) @ points
        sideways = normalize(cross(tangents, np.array([0.0, 0.0, 1.0])))
        stretch = np.linalg.norm(transform_directions(camera_from_object, sideways), axis=1)
        offsets = (0.5 * samples.at(widths) * stretch)[:, None] * sideways
        index = np.stack([start, start + 1], axis=1)
        return _Pieces(samples, index, (samples.vertex @ points)[index], offsets[index])

    def _cut(self, points: Vectors, view: View) -> tuple[Places, NDArray[np.intp]]:
        """The ends of pieces, segment by segment, and which of them a piece starts at."""
        count = self.kind.segments(self.counts)
        curve, segment = places_in_runs(count)
        whole = Places(curve, segment, np.zeros(len(curve)))
        controls = control_weights(self.kind, self.counts, len(points), whole)
        on_screen = np.stack([view.seen(weights @ points, _BEYOND) for weights in controls], axis=1)
        length = np.linalg.norm(np.diff(on_screen, axis=1), axis=2).sum(axis=1)
        level = np.ones(len(curve)) if self.kind.basis == "linear" else length / _PIXELS_A_PIECE
        row, t = fractional_odd(np.clip(level, 1.0, _MOST_PIECES - 1.0))
        return Places(curve[row], segment[row], t), np.flatnonzero(row[:-1] == row[1:])


@dataclass(frozen=True, slots=True, eq=False)
class _Pieces:
    """M quads. index: (M, 2) samples.  ends, offsets: (M, 2, 3) of both, and half the way across there."""

    samples: CurveSamples
    index: NDArray[np.intp]
    ends: Vectors
    offsets: Vectors


def _lines(samples: CurveSamples, points: Vectors, view: View) -> _Pieces:
    after = following(samples)
    start = np.flatnonzero(after >= 0)
    index = np.stack([start, after[start]], axis=1)
    ends = (samples.vertex @ points)[index]
    reach = 0.5 / view.pixels_at(-ends[..., 2])
    return _Pieces(samples, index, ends, reach[..., None] * normalize(_seen_across(ends, view))[:, None])


def fractional_odd(levels: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """How OpenGL cuts N edges under fractional_odd_spacing: (S,) the edge, and the place 0..1 along it, of each cut.

    The next odd number of pieces, all but two of one length. Where these two are is left to the hardware; here, as in
    Direct3D 11's reference tessellator, new points split off where the ruler function puts them.
    """
    half = (levels + 1.0) / 2.0
    floor, ceiling = np.floor(half).astype(np.intp), np.ceil(half).astype(np.intp)
    row, point = places_in_runs(2 * ceiling)
    split = np.where(floor == 1, 0, 2 * _without_highest_bit(floor - 1) + 1)
    from_end = np.minimum(point, 2 * ceiling[row] - 1 - point)
    before = from_end - ((from_end > split[row]) & (floor != ceiling)[row])
    share = (half - floor)[row]
    place = (1.0 - share) * before / (2 * floor - 1)[row] + share * from_end / (2 * ceiling - 1)[row]
    return row, np.where(from_end < point, 1.0 - place, place)


def _without_highest_bit(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    exponent = np.frexp(np.maximum(numbers, 1))[1] - 1
    return np.where(numbers > 0, numbers - (1 << exponent), 0)


def _seen_across(ends: Vectors, view: View) -> Vectors:
    """(M, 3) parallel to the image, at right angles to how lines between ends (M, 2, 3) are seen."""
    along = ends[:, 1] - ends[:, 0]
    if view.camera.projection == "orthographic":
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    else:
        across = cross(ends[:, 0], ends[:, 1])[:, :2]
    return np.concatenate([across, np.zeros((len(across), 1))], axis=1)


def _polygons(pieces: _Pieces, across: NDArray[np.float64], carried: Carried) -> Polygons:
    """Strips of quads, with normals towards the eye."""
    count, wide = len(pieces.index), len(across)
    points = pieces.ends[:, :, None] + across[:, None] * pieces.offsets[:, :, None]
    along = normalize(pieces.ends[:, 1] - pieces.ends[:, 0])[:, None]
    sideways = normalize(pieces.offsets)
    facing = normalize(cross(sideways, along))
    facing = np.where(facing[..., 2:] < 0.0, -facing, facing)[:, :, None]
    tilt = across[:, None] if wide > 2 else 0.0 * across[:, None]
    normals = tilt * sideways[:, :, None] + np.sqrt(1.0 - tilt**2) * facing
    corner = np.arange(wide - 1)[:, None] + np.array([0, 1, wide + 1, wide])
    shape = Polygons(
        points=points.reshape(-1, 3).astype(np.float32),
        counts=np.full(count * (wide - 1), 4),
        indices=(np.arange(count)[:, None, None] * 2 * wide + corner).ravel(),
        faces=np.repeat(pieces.samples.curve[pieces.index[:, 0]], wide - 1).astype(np.int32),
        normals=Primvar(normals.reshape(-1, 3).astype(np.float32), "vertex"),
    )
    return laid_along(shape, carried, pieces.samples, np.repeat(pieces.index.ravel(), wide))


def laid_along(shape: Polygons, carried: Carried, samples: CurveSamples, sample: NDArray[np.intp]) -> Polygons:
    """The polygons with what the curves carry. sample: (P,) of which sample each point is."""

    def at_points(primvar: Primvar) -> Primvar:
        if primvar is shape.normals or primvar.interpolation == "constant":
            return primvar
        return Primvar(samples.at(primvar)[sample].astype(np.float32), "vertex")

    return carried.laid_on(shape).with_primvars(at_points)
