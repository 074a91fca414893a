"""Layers of what a stage says about its prims: semantic labels, and primvars of any name."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

from build import quad, scene, sun
from defshade_cli import render
from defshade_cli.errors import UsageError
from defshade_cli.image.files import write
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.layers.extras import extras_of
from defshade_cli.image.reading import read
from defshade_cli.plan import make_plan
from defshade_cli.settings import OutputSettings, RenderSettings

SIZE = (48, 32)
STAGE = """#usda 1.0
def Xform "car" (prepend apiSchemas = ["SemanticsLabelsAPI:class"]) {
    token[] semantics:labels:class = ["vehicle"]
    float[] primvars:wear = [0.25] (
        interpolation = "constant"
    )
    def Mesh "body" (prepend apiSchemas = ["SemanticsLabelsAPI:class", "SemanticsLabelsAPI:part"]) {
        token[] semantics:labels:class = ["car"]
        token[] semantics:labels:part = ["body"]
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
        point3f[] points = [(-3, -2, 0), (0, -2, 0), (3, -2, 0), (-3, 2, 0), (0, 2, 0), (3, 2, 0)]
        uniform token subdivisionScheme = "SCHEME"
        int[] primvars:panel = [4, 9] (
            interpolation = "uniform"
        )
        point3f[] primvars:rest = [(-3, -2, 1), (0, -2, 1), (3, -2, 1), (-3, 2, 1), (0, 2, 1), (3, 2, 1)] (
            interpolation = "vertex"
        )
        string primvars:note = "painted"
    }
}
def Mesh "wall" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)]
    uniform token subdivisionScheme = "none"
}
def Camera "cam" {
    float2 clippingRange = (1, 100)
    float horizontalAperture = 24
    float verticalAperture = 16
    float focalLength = 24
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    path = tmp_path / "car.usda"
    path.write_text(STAGE.replace("SCHEME", "none"))
    return path


def test_labels_are_the_prims_and_their_ancestors(stage: Path) -> None:
    film = render(stage, size=SIZE, layers=("semantic",))
    assert film.manifests["semantic"] == {0: "class:car,vehicle part:body"}
    values = film.layers["semantic"][..., 0]
    assert values[16, 24] == 0 and values[1, 1] == -1


@pytest.mark.parametrize("scheme", ["none", "bilinear", "catmullClark"])
def test_primvars_of_any_type_and_interpolation(scheme: str, tmp_path: Path) -> None:
    """Rest points lie one above the posed ones; faces keep their panels; a constant comes from the ancestor."""
    path = tmp_path / "car.usda"
    path.write_text(STAGE.replace("SCHEME", scheme))
    names = ("primvars:rest", "primvars:panel", "primvars:wear")
    film = render(path, size=SIZE, layers=("position", "primId", *names), complexity="medium")
    body = film.layers["primId"][..., 0] == 0
    rest, panel, wear = (film.layers[name] for name in names)
    assert (rest.shape[2], panel.shape[2], wear.shape[2]) == (3, 1, 1)
    np.testing.assert_allclose(rest[body], film.layers["position"][body] + (0, 0, 1), atol=1e-5)
    np.testing.assert_array_equal(wear[body], 0.25)
    left = film.layers["position"][..., 0] < 0
    assert (panel[body & left] == 4).all() and (panel[body & ~left] == 9).all()
    assert not any(film.layers[name][~body].any() for name in names)


def test_files_hold_as_many_channels_as_the_primvar(stage: Path, tmp_path: Path) -> None:
    film = render(stage, size=SIZE, layers=("primvars:rest", "primvars:panel"))
    write(film, OutputSettings(verify=True), tmp_path / "a.exr")
    layers = read(tmp_path / "a.exr")
    np.testing.assert_array_equal(layers["primvars_rest"], film.layers["primvars:rest"])
    np.testing.assert_array_equal(layers["primvars_panel"], film.layers["primvars:panel"])


def test_what_cannot_be_shown_is_said(stage: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "defshade"):
        film = render(stage, size=SIZE, layers=("primvars:note", "primvars:nowhere"))
    assert not film.layers["primvars:note"].any()
    assert "primvars:nowhere: no prim has such a primvar" in caplog.messages


def test_more_primvars_than_a_vertex_has_room_for_are_refused() -> None:
    layers = tuple(f"primvars:p{i}" for i in range(5))
    with pytest.raises(UsageError, match="5 primvars are asked for as layers, and 4"):
        make_plan(scene([quad()], [sun()]), RenderSettings(layers=layers))


def test_nothing_of_it_is_read_unasked() -> None:
    extras = extras_of(tuple(name for name, layer in LAYERS.items() if name != "semantic"))
    assert not extras.labels and not extras.primvars
    assert extras_of(["semantic", "primvars:b", "primvars:a"]).primvars == ("a", "b")
    plan = make_plan(scene([quad()], [sun()]), RenderSettings(layers=("primvars:a", "depth")))
    assert [plane.name for plane in plan.data_planes] == ["primvar_0"] and plan.inputs == {"PRIMVARS"}


def test_what_an_instance_hands_down_is_not_shown_and_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """One mesh stands for all instances; what is authored inside is shown."""
    (tmp_path / "stage.usda").write_text(INSTANCED)
    with caplog.at_level(logging.WARNING):
        layers = render(tmp_path / "stage.usda", size=(8, 8), layers=("primvars:wear", "primvars:panel")).layers
    assert not layers["primvars:wear"].any() and layers["primvars:panel"].max() == 4
    assert "primvars:wear is not shown of what is inside the instance (/set/a)" in caplog.text


INSTANCED = """#usda 1.0
class Xform "part" {
    def Cube "cube" {
        int[] primvars:panel = [4]
    }
}
def Xform "set" {
    float[] primvars:wear = [0.25]
    def Xform "a" (
        instanceable = true
        inherits = </part>
    ) {}
}
"""
