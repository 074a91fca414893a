"""Where the things of a frame are one frame earlier or later."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The drawables and meshes of another frame, placed at another time.

    camera: then.  placements: (N, 4, 4) world_from_object of each drawable.  points: (V, 3) float32 of each mesh.
    What is not there then, or of another topology, stands as it stands now.
    """

    camera: Camera
    placements: tuple[NDArray[np.float64], ...]
    points: tuple[NDArray[np.float32], ...]


def moment_of(
    drawables: Sequence[Drawable],
    meshes: Sequence[Mesh],
    camera_then: Camera,
    drawables_then: Sequence[Drawable],
    meshes_then: Sequence[Mesh],
) -> Moment:
    """The first two as the last three have them: instances are known by path and id, meshes by path."""
    then = _placements_by_path(drawables_then)
    by_path = {mesh.path: mesh for mesh in meshes_then}
    return Moment(
        camera_then,
        tuple(_placed(drawable, then) for drawable in drawables),
        tuple(_points(mesh, by_path.get(mesh.path)) for mesh in meshes),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Placements:
    """(N,) ids ascending, and the (N, 4, 4) matrices of each."""

    ids: NDArray[np.int32]
    world_from_object: NDArray[np.float64]

    def of(self, ids: NDArray[np.int32], otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
        """The matrices of some ids, those of `otherwise` where there is no such."""
        found = np.searchsorted(self.ids, ids).clip(max=len(self.ids) - 1)
        known = self.ids[found] == ids
        return np.where(known[:, None, None], self.world_from_object[found], otherwise)


def _placements_by_path(drawables: Sequence[Drawable]) -> dict[str, _Placements]:
    runs: dict[str, list[tuple[NDArray[np.int32], NDArray[np.float64]]]] = defaultdict(list)
    for drawable in drawables:
        for path, some in _runs(drawable):
            runs[path].append((drawable.instance_ids[some], drawable.world_from_object[some]))
    return {path: _sorted(parts) for path, parts in runs.items()}


def _sorted(parts: list[tuple[NDArray[np.int32], NDArray[np.float64]]]) -> _Placements:
    ids, matrices = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.argsort(ids, kind="stable")
    return _Placements(ids[order], matrices[order])


def _runs(drawable: Drawable) -> list[tuple[str, slice]]:
    """The instances of each path: all of them, or one each."""
    if len(drawable.paths) == 1:
        return [(drawable.paths[0], slice(None))]
    return [(path, slice(row, row + 1)) for row, path in enumerate(drawable.paths)]


def _placed(drawable: Drawable, then: Mapping[str, _Placements]) -> NDArray[np.float64]:
    matrices = drawable.world_from_object.copy()
    for path, some in _runs(drawable):
        if path in then:
            matrices[some] = then[path].of(drawable.instance_ids[some], drawable.world_from_object[some])
    return matrices


def _points(mesh: Mesh, then: Mesh | None) -> NDArray[np.float32]:
    if then is None or then is mesh or not np.array_equal(mesh.triangles, then.triangles):
        return mesh.points
    return then.points if then.points.shape == mesh.points.shape else mesh.points
