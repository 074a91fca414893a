"""Small meshes shaped together: what comes out is what comes out of each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from defshade_cli.scene.geometry import Mesh
from defshade_cli.usd.polygons.cut import cut
from defshade_cli.usd.polygons.end_to_end import LARGEST
from defshade_cli.usd.polygons.normals import with_normals
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar, Scheme
from defshade_cli.usd.polygons.small_meshes import Shaped, shape_all
from defshade_cli.usd.polygons.subsets import Faces

INTERPOLATIONS: tuple[Interpolation, ...] = ("constant", "uniform", "varying", "vertex", "faceVarying")


def mesh(rng: np.random.Generator, scheme: Scheme, left_handed: bool) -> Polygons:
    """Faces of 3 to 7 corners anywhere among some points, some of them holes."""
    counts = rng.integers(3, rng.integers(4, 9), rng.integers(1, 9))
    points = rng.normal(size=(rng.integers(4, 12), 3)).astype(np.float32)
    indices = rng.integers(0, len(points), counts.sum())
    holes = rng.integers(0, len(counts), rng.integers(len(counts)) if rng.random() < 0.3 else 0)
    faces = np.arange(len(counts), dtype=np.int32)
    return Polygons(points, counts, indices, faces, holes, scheme=scheme, left_handed=left_handed)


def dressed(rng: np.random.Generator, bare: Polygons) -> Polygons:
    """The same with some of all that may lie on it."""

    def primvar(*width: int) -> Primvar:
        interpolation = INTERPOLATIONS[rng.integers(len(INTERPOLATIONS))]
        points, corners = len(bare.points), len(bare.indices)
        sizes = {"constant": 1, "uniform": len(bare.counts), "faceVarying": corners}
        values = rng.random((sizes.get(interpolation, points), *width)).astype(np.float32)
        if interpolation == "faceVarying" and rng.random() < 0.5:
            values = rng.random((points, *width)).astype(np.float32)[bare.indices]
        return Primvar(values, interpolation)

    def perhaps(*width: int) -> Primvar | None:
        return primvar(*width) if rng.random() < 0.4 else None

    return replace(
        bare,
        normals=perhaps(3),
        display_color=perhaps(3),
        display_opacity=perhaps(),
        uvs={name: primvar(2) for name in ("st", "map1") if rng.random() < 0.5},
        shown={"temperature": primvar(int(rng.integers(1, 5)))} if rng.random() < 0.3 else {},
    )


def arrays(drawn: Mesh) -> dict[str, NDArray[np.generic] | None]:
    named = {name: getattr(drawn, name) for name in ("points", "normals", "triangles", "faces")}
    lying = {"color": drawn.display_color, "opacity": drawn.display_opacity}
    return (
        named | lying | {f"uv {n}": v for n, v in drawn.uvs.items()} | {f"p {n}": v for n, v in drawn.primvars.items()}
    )


def assert_as_alone(each: Polygons, shaped: Shaped, faces: Faces) -> None:
    assert shaped.polygons is each
    together, apart = cut(each, faces, "/m", shaped), cut(with_normals(each), faces, "/m")
    assert together.split == apart.split and len(together.groups) == len(apart.groups)
    expected = arrays(apart.mesh)
    for name, values in arrays(together.mesh).items():
        alone = expected.pop(name)
        assert (values is None) == (alone is None)
        if values is not None and alone is not None:
            assert values.dtype == alone.dtype and values.shape == alone.shape
            assert values.tobytes() == alone.tobytes(), name
    assert not expected


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
@pytest.mark.parametrize("left_handed", [False, True])
def test_together_is_as_alone_to_the_bit(scheme: Scheme, left_handed: bool) -> None:
    rng = np.random.default_rng(1)
    meshes = [mesh(rng, scheme, left_handed) for _ in range(300)]
    shaped = shape_all(meshes)
    assert len(shaped) == len(meshes)
    for each in meshes:
        assert_as_alone(each, shaped[each], Faces(("/m",)))


@pytest.mark.parametrize("seed", range(4))
def test_what_lies_on_them_is_as_alone_too(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = [dressed(rng, mesh(rng, "none", bool(seed % 2))) for _ in range(40)]
    meshes = [dressed(rng, mesh(rng, "none", False)) for _ in range(200)] + kinds
    for each, shaped in shape_all(meshes).items():
        groups = Faces(("/m", "/m/a"), rng.integers(0, 2, len(each.counts)))
        assert_as_alone(each, shaped, Faces(("/m",)) if rng.random() < 0.7 else groups)


def test_what_is_not_small_is_left_out() -> None:
    corners = LARGEST + 1
    whole = Polygons(np.zeros((5, 3), np.float32), np.array([corners]), np.zeros(corners, int), np.zeros(1, np.int32))
    nothing = Polygons(whole.points, np.array([5]), np.arange(5), np.zeros(1, np.int32), holes=np.zeros(1, np.int32))
    assert shape_all([whole, nothing]) == {}
    assert shape_all([]) == {}
