"""The generated stages are what they are said to be, and peers get all of them."""

from __future__ import annotations

import importlib
import json
import struct
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

from defshade_cli.measure.layouts import first_frame

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks"


@pytest.fixture
def stages(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(FOLDER)
    return importlib.import_module("bench_stages")


def test_simple_is_as_it_is_stated(stages: ModuleType, tmp_path: Path) -> None:
    """25 spheres of 4k triangles that are all different, a plane, 1 distant + 4 sphere + 1 cone light."""
    scene = first_frame(stages.generate(tmp_path, "simple"))
    assert len(scene.meshes) == 26 and all(len(d.world_from_object) == 1 for d in scene.drawables)
    assert scene.triangle_count == pytest.approx(25 * 4000, rel=0.02)
    assert Counter(light.kind for light in scene.lights) == {"distant": 1, "sphere": 5}
    assert sum(light.shaping is not None for light in scene.lights) == 1


def test_many_lights_are_256(stages: ModuleType, tmp_path: Path) -> None:
    scene = first_frame(stages.generate(tmp_path, "manylights"))
    assert Counter(light.kind for light in scene.lights) == {"sphere": 256}


def test_one_prim_of_animated_moves(stages: ModuleType, tmp_path: Path) -> None:
    from defshade_cli.usd.opening.stage import open_stage
    from defshade_cli.usd.reader import StageReader

    reader = StageReader(open_stage(stages.generate(tmp_path, "animated")))
    first, later = reader.read(1), reader.read(26)
    moved = [a != b for a, b in zip(_places(first), _places(later), strict=True)]
    assert sum(moved) == 1


def test_glb_holds_the_stage(stages: ModuleType, tmp_path: Path) -> None:
    stage = stages.generate(tmp_path, "simple")
    glb = tmp_path / "simple.glb"
    importlib.import_module("glb").write_glb(stage, glb)
    data = glb.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    (text_length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + text_length])
    assert document["buffers"][0]["byteLength"] == len(data) - 28 - text_length
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    assert Counter(light["type"] for light in lights) == {"directional": 1, "point": 4, "spot": 1}
    triangles = sum(
        document["accessors"][part["indices"]]["count"] // 3
        for mesh in document["meshes"]
        for part in mesh["primitives"]
    )
    assert triangles == first_frame(stage).triangle_count


def test_a_process_is_measured(stages: ModuleType) -> None:
    """Work of 0.1 processor seconds takes as many at least, 64 MiB are resident; a failure has no figures."""
    compare = importlib.import_module("compare")
    work = "import time; x = bytearray(64 << 20)\nwhile time.process_time() < 0.1: pass"
    usage = compare.measure([sys.executable, "-c", work])
    assert usage.cpu >= 0.1 and usage.wall >= 0.05 and usage.peak > 64
    assert compare.measure([sys.executable, "-c", "raise SystemExit(3)"]) is None


def _places(scene: object) -> list[bytes]:
    return [drawable.world_from_object.tobytes() for drawable in scene.drawables]  # type: ignore[attr-defined]
