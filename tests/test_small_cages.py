"""Small subdivision surfaces refined together: what comes out is what comes out of each alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from defshade_cli.usd.polygons.control import Control, smooth_control
from defshade_cli.usd.polygons.end_to_end import signature
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar, Scheme
from defshade_cli.usd.polygons.refiner import Refiner
from defshade_cli.usd.polygons.small_cages import Cage, refine_all
from defshade_cli.usd.subdivision import LinearInterpolation

INTERPOLATIONS: tuple[Interpolation, ...] = ("constant", "uniform", "varying", "vertex", "faceVarying")
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])


def sheet(rng: np.random.Generator, scheme: Scheme) -> Polygons:
    """Some of four quads, some cut into triangles, in any order; now and then with a hole."""
    faces: list[list[int]] = []
    for quad in rng.permutation(QUADS)[: rng.integers(1, 5)].tolist():
        cut = scheme == "loop" or rng.random() < 0.2
        faces += [quad[:3], [quad[0], quad[2], quad[3]]] if cut else [quad]
    points = rng.normal(size=(9, 3)).astype(np.float32)
    counts, indices = np.array([len(face) for face in faces]), np.concatenate(faces)
    holes = rng.integers(0, len(faces), 1) if rng.random() < 0.2 else np.empty(0, int)
    return Polygons(points, counts, indices, np.arange(len(faces), dtype=np.int32), holes, scheme)


def dressed(rng: np.random.Generator, bare: Polygons) -> Polygons:
    def primvar(*width: int) -> Primvar:
        interpolation = INTERPOLATIONS[rng.integers(len(INTERPOLATIONS))]
        sizes = {"constant": 1, "uniform": len(bare.counts), "faceVarying": len(bare.indices)}
        values = rng.random((sizes.get(interpolation, len(bare.points)), *width)).astype(np.float32)
        if interpolation == "faceVarying" and rng.random() < 0.7:
            values = rng.integers(0, 2, (len(bare.points), *width)).astype(np.float32)[bare.indices]
        return Primvar(values, interpolation)

    opacity = primvar() if rng.random() < 0.3 else None
    return replace(bare, uvs={"st": primvar(2)} if rng.random() < 0.8 else {}, display_opacity=opacity)


def control(rng: np.random.Generator, polygons: Polygons, rule: LinearInterpolation) -> Control:
    """Plain, or with a crease or a sharp corner."""
    found = smooth_control(polygons)
    assert found is not None
    topology = found.topology
    if rng.random() < 0.2:
        topology = replace(
            topology,
            crease_indices=polygons.indices[:3],
            crease_lengths=[3],
            crease_sharpnesses=[2.0] if rng.random() < 0.5 else [1.5, 10.0],
        )
    if rng.random() < 0.2:
        topology = replace(topology, corner_indices=[4], corner_sharpnesses=[3.0])
    return Control(topology, rule)


def arrays(polygons: Polygons) -> dict[str, NDArray[np.generic]]:
    named = {"normals": polygons.normals, "opacity": polygons.display_opacity, **polygons.uvs}
    values = {name: primvar.values for name, primvar in named.items() if primvar}
    return {n: getattr(polygons, n) for n in ("points", "counts", "indices", "faces", "holes")} | values


@pytest.mark.parametrize("scheme", ["catmullClark", "loop", "bilinear"])
@pytest.mark.parametrize(("level", "rule"), [(1, "cornersPlus1"), (2, "all"), (1, "boundaries")])
def test_together_is_as_alone_to_the_bit(scheme: Scheme, level: int, rule: LinearInterpolation) -> None:
    """Many are wired as others are, and some as no other is."""
    rng = np.random.default_rng(level)
    patterns = [sheet(rng, scheme) for _ in range(12)]
    moved = [
        replace(each, points=rng.normal(size=(9, 3)).astype(np.float32)) for each in patterns[:4] for _ in range(5)
    ]
    sheets = [sheet if rng.random() < 0.4 else dressed(rng, sheet) for sheet in [*patterns, *moved]]
    cages = [Cage(sheet, control(rng, sheet, rule)) for sheet in sheets]
    found = refine_all(cages, level)
    kinds = Counter((signature(cage.polygons)) for cage in cages)
    assert found.keys() == {cage for cage in cages if kinds[signature(cage.polygons)] > 1} and len(found) > 20
    for cage, surface in found.items():
        alone = Refiner(cage.control, level).refine(cage.polygons)
        assert surface.left_handed == alone.left_handed and surface.scheme == alone.scheme
        kinds = ([p.interpolation for p in each.primvars] for each in (surface, alone))
        assert next(kinds) == next(kinds)
        expected = arrays(alone)
        for name, values in arrays(surface).items():
            assert values.shape == expected[name].shape and values.dtype == expected[name].dtype, name
            assert values.tobytes() == expected[name].tobytes(), name


def test_what_collapses_is_alone_or_not_small_is_left_out() -> None:
    rng = np.random.default_rng(0)
    cages = [Cage(each, control(rng, each, "all")) for each in (sheet(rng, "catmullClark") for _ in range(3))]
    assert not refine_all(cages[:1], 1)
    flat = cages[0]._replace(polygons=replace(cages[0].polygons, points=np.zeros((9, 3), np.float32)))
    assert refine_all([*cages, flat], 1).keys() == {*cages}
    assert not refine_all(cages, 5)
