"""Small meshes shaped together: what comes out is what comes out of each alone."""

from __future__ import annotations

import numpy as np
import pytest

from defshade_cli.usd.cut import cut
from defshade_cli.usd.normals import with_normals
from defshade_cli.usd.polygons import Polygons, Scheme
from defshade_cli.usd.small_meshes import shape_all
from defshade_cli.usd.subsets import Faces
from defshade_cli.usd.triangulation import triangulate


def mesh(rng: np.random.Generator, scheme: Scheme, left_handed: bool) -> Polygons:
    """Faces of 3 and 4 corners anywhere among some points."""
    counts = rng.integers(3, 5, rng.integers(1, 9))
    points = rng.normal(size=(rng.integers(4, 12), 3)).astype(np.float32)
    indices = rng.integers(0, len(points), counts.sum())
    return Polygons(
        points, counts, indices, np.arange(len(counts), dtype=np.int32), scheme=scheme, left_handed=left_handed
    )


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
@pytest.mark.parametrize("left_handed", [False, True])
def test_together_is_as_alone_to_the_bit(scheme: Scheme, left_handed: bool) -> None:
    rng = np.random.default_rng(1)
    meshes = [mesh(rng, scheme, left_handed) for _ in range(300)]
    shaped = shape_all(meshes)
    assert len(shaped) == len(meshes)
    for each in meshes:
        normals, (triangles, face), corners = shaped[each]
        alone = with_normals(each).normals
        assert alone is not None and normals.interpolation == alone.interpolation
        assert normals.values.tobytes() == alone.values.tobytes()
        expected, expected_face = triangulate(each, [])
        np.testing.assert_array_equal(triangles, expected)
        np.testing.assert_array_equal(face, expected_face)
        together, apart = (cut(with_normals(each), Faces(("/m",)), "/m", known).mesh for known in (shaped[each], None))
        assert corners is not None
        for name in ("points", "normals", "triangles", "faces"):
            assert getattr(together, name).tobytes() == getattr(apart, name).tobytes()


def test_what_is_not_small_is_left_out() -> None:
    many_corners = Polygons(np.zeros((5, 3), np.float32), np.array([5]), np.arange(5), np.zeros(1, np.int32))
    assert shape_all([many_corners]) == {}
    assert shape_all([]) == {}
