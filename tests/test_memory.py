"""Between frames only what varies is read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest

from defshade_cli.usd import memory
from defshade_cli.usd.materials import materials
from defshade_cli.usd.reader import StageReader
from stages import stage_of

PANEL = """def Mesh "NAME" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    SAYS
}
"""
LOOK = """def Material "NAME" {
    token outputs:surface.connect = </NAME/Surface.outputs:surface>
    def Shader "Surface" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness SAYS
        token outputs:surface
    }
}
"""


def panel(name: str, says: str = "") -> str:
    return PANEL.replace("NAME", name).replace("SAYS", says)


def look(name: str, roughness: str) -> str:
    return LOOK.replace("NAME", name).replace("SAYS", roughness)


STAGE = (
    look("still_look", "= 0.5")
    + look("varying_look", ".timeSamples = {0: 0.1, 9: 0.9}")
    + panel("still", "rel material:binding = </still_look>")
    + panel("bound", "rel material:binding = </varying_look>")
    + panel(
        "moved",
        "double3 xformOp:translate.timeSamples = {0: (0, 0, 0), 9: (9, 0, 0)}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]',
    )
    + panel("blinking", 'token visibility.timeSamples = {0: "inherited", 1: "invisible", 2: "inherited"}')
    + panel("coloured", "color3f[] primvars:displayColor.timeSamples = {0: [(1, 0, 0)], 9: [(0, 1, 0)]}")
    + panel("recut", "")
    .replace("int[] faceVertexIndices = ", "int[] faceVertexIndices.timeSamples = {0: ")
    .replace("[0, 1, 2, 3]", "[0, 1, 2, 3], 9: [3, 2, 1, 0]}")
)


@pytest.fixture
def read_again(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each prim's surface, material and bindings were read."""
    counts: Counter[str] = Counter()

    def counted(module: ModuleType, name: str, path_of: Callable[..., object]) -> None:
        original = getattr(module, name)

        def count(*args: Any, **options: Any) -> Any:
            counts[f"{name} {path_of(*args)}"] += 1
            return original(*args, **options)

        monkeypatch.setattr(module, name, count)

    counted(memory, "read_surface", lambda prim, *_: prim.GetPath())
    counted(memory, "is_time_varying", lambda prim, *_: prim.GetPath())
    counted(materials, "read_material", lambda _, path, *__: path)
    counted(materials, "read_bound", lambda prim, *_: prim.GetPath())
    counted(memory, "told_of", lambda said, *_: said.path)
    return counts


def test_between_frames_only_what_varies_is_read(read_again: Counter[str]) -> None:
    reader = StageReader(stage_of(STAGE))
    first = reader.read(0)
    assert read_again["told_of /still"] == read_again["read_material /still_look"] == 1
    assert not read_again["read_surface /still"]
    reader.read(1)
    reader.read(2)
    read_again.clear()
    fourth = reader.read(3)
    assert {name for name, count in read_again.items() if count} == {
        "read_surface /coloured",
        "read_surface /recut",
        "read_material /varying_look",
    }
    assert max(read_again.values()) == 1
    kept = {mesh.path: mesh for mesh in first.meshes}
    assert all(mesh is kept[mesh.path] for mesh in fourth.meshes if mesh.path in kept and mesh.path != "/recut")


def test_a_frame_read_twice_reads_nothing_of_surfaces(read_again: Counter[str]) -> None:
    reader = StageReader(stage_of(STAGE))
    reader.read(3)
    read_again.clear()
    reader.read(3)
    assert not any(name.startswith(("read_surface", "told_of")) for name in read_again)
