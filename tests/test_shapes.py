"""Equal shapes become instances of one mesh; whatever sets them apart keeps them apart."""

from __future__ import annotations

import numpy as np
import pytest

from defshade_cli.usd.reader import StageReader
from stages import move, positions, read, stage_of

QUAD = """int[] faceVertexCounts = [4]
int[] faceVertexIndices = [0, 1, 2, 3]
point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
"""


def pair(kind: str, first: str = "", second: str = "", both: str = "") -> str:
    return f'def {kind} "a" {{\n{both}\n{first}\n}}\ndef {kind} "b" {{\n{both}\n{second}\n}}\n'


@pytest.mark.parametrize(
    "text",
    [
        pair("Cube"),
        pair("Sphere", both="double radius = 3"),
        pair("Mesh", both=QUAD),
        pair("Mesh", both=QUAD + 'uniform token subdivisionScheme = "none"'),
        pair("Cube", "color3f[] primvars:displayColor = [(1, 0, 0)]"),
        pair("Cube", move(x=3), 'token purpose = "render"'),
    ],
)
def test_equal_shapes_are_instances_of_one_mesh(text: str) -> None:
    scene = read(text)
    (drawable,) = scene.drawables
    assert len(scene.meshes) == 1 and drawable.paths == ("/a", "/b")


@pytest.mark.parametrize(
    "text",
    [
        pair("Cube", "double size = 3"),
        pair("Cylinder", 'uniform token axis = "X"'),
        pair("Mesh", 'color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "uniform")', both=QUAD),
        pair("Cube", "uniform bool doubleSided = true"),
        pair("Mesh", 'uniform token subdivisionScheme = "none"', both=QUAD),
        pair("Mesh", 'uniform token orientation = "leftHanded"', both=QUAD),
        pair("Mesh", "int[] cornerIndices = [0]\nfloat[] cornerSharpnesses = [10]", both=QUAD),
        pair("Mesh", 'texCoord2f[] primvars:st = [(0, 0)] (interpolation = "constant")', both=QUAD),
    ],
)
def test_shapes_that_differ_stay_apart(text: str) -> None:
    scene = read(text)
    assert len(scene.meshes) == len(scene.drawables) == 2


def test_one_mesh_with_two_materials_is_drawn_in_two_parts() -> None:
    text = pair("Cube", 'rel material:binding = </gone> (bindMaterialAs = "strongerThanDescendants")')
    scene = read(text.replace('"a" {', '"a" (prepend apiSchemas = ["MaterialBindingAPI"]) {'))
    assert len(scene.meshes) == 1
    assert [drawable.paths for drawable in scene.drawables] == [("/a",), ("/b",)]


def test_a_shape_that_changes_leaves_the_others() -> None:
    stage = stage_of(pair("Cube", "double size.timeSamples = { 1: 2, 2: 4 }"))
    reader = StageReader(stage)
    first, second = reader.read(1.0), reader.read(2.0)
    assert len(first.meshes) == 1 and len(second.meshes) == 2
    assert first.meshes[0] in second.meshes


def test_placements_and_paths_stay_together() -> None:
    scene = read(pair("Cube", move(x=3), move(y=5)))
    assert sorted(positions(scene)) == [(0, 5, 0), (3, 0, 0)]
    (drawable,) = scene.drawables
    np.testing.assert_array_equal(drawable.world_from_object[drawable.paths.index("/a"), :3, 3], [3, 0, 0])
