"""MaterialX documents in the place of references to them."""

from __future__ import annotations

import builtins
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf

from defshade_cli.scene.scene import Scene
from defshade_cli.usd.opening.dependencies import read_dependencies
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader

BINDS = '(prepend apiSchemas = ["MaterialBindingAPI"])'

DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.38" colorspace="lin_rec709" fileprefix="maps/">
  <nodegraph name="NG">
    <input name="rough" type="float" value="0.75" />
    <image name="wood" type="color3">
      <input name="file" type="filename" value="wood.png" colorspace="srgb_texture" />
    </image>
    <dot name="shine" type="float"><input name="in" type="float" interfacename="rough" /></dot>
    <output name="color" type="color3" nodename="wood" />
    <output name="roughness" type="float" nodename="shine" />
  </nodegraph>
  <standard_surface name="SR" type="surfaceshader">
    <input name="base_color" type="color3" nodegraph="NG" output="color" />
    <input name="specular_roughness" type="float" nodegraph="NG" output="roughness" />
    <input name="emission_color" type="color3" value="0.5, 0.5, 0.5" colorspace="srgb_texture" />
    <input name="emission" type="float" value="1" />
  </standard_surface>
  <surfacematerial name="Wood" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR" />
  </surfacematerial>
</materialx>
"""
REFERENCE = f"""def Scope "looks" (prepend references = @./look.mtlx@</MaterialX/Materials>) {{
}}
def Cube "cube" {BINDS} {{
    rel material:binding = </looks/Wood>
}}
"""


def with_document(folder: Path, document: str = DOCUMENT, maps: str = "maps") -> Path:
    (folder / maps).mkdir(exist_ok=True)
    (folder / maps / "wood.png").touch()
    (folder / "look.mtlx").write_text(document)
    (folder / "stage.usda").write_text(f"#usda 1.0\n{REFERENCE}")
    return folder / "stage.usda"


def read_stage(path: Path, frame: float | None = None) -> Scene:
    return StageReader(open_stage(path)).read(frame)


@pytest.mark.parametrize("maps", ["maps", "."])
def test_a_document_is_read_in_place_of_its_reference(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, maps: str
) -> None:
    """File prefixes count; where only the name without exists, that is the file."""
    pytest.importorskip("MaterialX")
    with caplog.at_level(logging.WARNING):
        scene = read_stage(with_document(tmp_path, maps=maps))
    (found,) = scene.materials
    assert (found.path, scene.unsupported, caplog.text) == ("/looks/Wood", (), "")
    texture = found.inputs["diffuse_color"].texture
    assert Path(texture.tiles[0][1].path) == (tmp_path / maps / "wood.png").resolve()
    assert (texture.color_space, found.roughness) == ("sRGB", 0.75)
    np.testing.assert_allclose(found.emissive_color, 0.21404, atol=1e-5)


def test_documents_in_packages_name_what_lies_beside_them(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """In one package, and in one that lies in another."""
    pytest.importorskip("MaterialX")
    with_document(tmp_path)
    names = ("stage.usda", "look.mtlx", "maps/wood.png")
    (tmp_path / "maps" / "wood.png").write_bytes(b"texels")
    pack(tmp_path / "inner.usdz", {name: tmp_path / name for name in names})
    (tmp_path / "outer.usda").write_text("#usda 1.0\n(\nsubLayers = [@./inner.usdz@]\n)\n")
    pack(tmp_path / "outer.usdz", {name: tmp_path / name for name in ("outer.usda", "inner.usdz")})
    for path in (tmp_path / "inner.usdz", tmp_path / "outer.usdz"):
        scene = read_stage(path)
        (found,) = scene.materials
        assert (scene.unsupported, caplog.text) == ((), "")
        assert found.inputs["diffuse_color"].texture.tiles[0][1].contents == b"texels"


def pack(path: Path, files: Mapping[str, Path]) -> None:
    writer = Sdf.ZipFileWriter.CreateNew(str(path))
    for name, file in files.items():
        writer.AddFile(str(file), name)
    writer.Save()


def test_a_document_may_be_a_sublayer(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pytest.importorskip("MaterialX")
    stage = with_document(tmp_path)
    cube = f'def Cube "cube" {BINDS} {{\nrel material:binding = </MaterialX/Materials/Wood>\n}}'
    stage.write_text(f"#usda 1.0\n(\nsubLayers = [@./look.mtlx@]\n)\n{cube}")
    scene = read_stage(stage)
    assert (scene.materials[0].roughness, scene.unsupported, caplog.text) == (0.75, (), "")


DEFINED = """<?xml version="1.0"?>
<materialx version="1.38">
  <nodedef name="ND_dimmed" node="dimmed">
    <input name="color" type="color3" value="1, 1, 1" />
    <input name="by" type="float" value="0.5" />
    <output name="out" type="color3" />
  </nodedef>
  <nodegraph name="NG_dimmed" nodedef="ND_dimmed">
    <multiply name="product" type="color3">
      <input name="in1" type="color3" interfacename="color" />
      <input name="in2" type="float" interfacename="by" />
    </multiply>
    <output name="out" type="color3" nodename="product" />
  </nodegraph>
  <nodedef name="ND_paint" node="paint">
    <input name="color" type="color3" value="0.2, 0.4, 0.8" />
    <output name="out" type="surfaceshader" />
  </nodedef>
  <nodegraph name="NG_paint" nodedef="ND_paint">
    <dimmed name="dim" type="color3"><input name="color" type="color3" interfacename="color" /></dimmed>
    <dimmed name="dimmer" type="color3">
      <input name="color" type="color3" nodename="dim" />
      <input name="by" type="float" value="0.25" />
    </dimmed>
    <gltf_pbr name="pbr" type="surfaceshader"><input name="base_color" type="color3" nodename="dimmer" /></gltf_pbr>
    <output name="out" type="surfaceshader" nodename="pbr" />
  </nodegraph>
  <paint name="coat" type="surfaceshader"><input name="color" type="color3" value="0.8, 0.4, 0.8" /></paint>
  <surfacematerial name="Wood" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="coat" />
  </surfacematerial>
</materialx>
"""


def test_nodes_that_the_document_defines_are_the_graphs_that_they_stand_for(tmp_path: Path) -> None:
    pytest.importorskip("MaterialX")
    scene = read_stage(with_document(tmp_path, DEFINED))
    assert scene.unsupported == ()
    np.testing.assert_allclose(scene.materials[0].diffuse_color, (0.1, 0.05, 0.1), rtol=1e-6)


def test_a_node_that_is_defined_by_itself_is_named(tmp_path: Path) -> None:
    pytest.importorskip("MaterialX")
    circle = DEFINED.replace('<multiply name="product"', '<dimmed name="product"').replace("</multiply>", "</dimmed>")
    scene = read_stage(with_document(tmp_path, circle))
    assert ["dimmed" in issue.reason for issue in scene.unsupported] == [True]


def test_the_files_on_disk_stay_as_they_are(tmp_path: Path) -> None:
    stage = with_document(tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    read_stage(stage)
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


def test_dependencies_are_the_same_before_and_after_it_is_read(tmp_path: Path) -> None:
    pytest.importorskip("MaterialX")
    path = with_document(tmp_path)
    before = read_dependencies(path)
    stage = open_stage(path)
    assert stage and read_dependencies(path) == before
    assert set(before.files) == {"stage.usda", "look.mtlx", "maps/wood.png"}
    assert before.missing == ()


@pytest.mark.parametrize("document", ["<materialx", "no xml at all", ""])
def test_what_is_no_document_is_said_and_drawn_unbound(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, document: str
) -> None:
    pytest.importorskip("MaterialX")
    with caplog.at_level(logging.WARNING):
        scene = read_stage(with_document(tmp_path, document))
    assert scene.materials[0].uses_display_color
    assert "look.mtlx" in caplog.text or any("/looks/Wood" in issue.path for issue in scene.unsupported)


def test_without_the_package_its_name_is_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **named: Mapping[str, Any]) -> Any:
        if name == "MaterialX":
            raise ImportError(name)
        return real(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with caplog.at_level(logging.WARNING):
        scene = read_stage(with_document(tmp_path))
    assert caplog.text.count("pip install 'defshade[materialx]'") == 1
    assert [record.module for record in caplog.records].count("documents") == 1
    assert scene.materials[0].uses_display_color
