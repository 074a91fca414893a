"""In-memory stages written as usda text, and what tests look up in the scenes that are read from them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd

from defshade_cli.scene.geometry import Drawable
from defshade_cli.scene.scene import Scene
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader

SUFFIXES = {".usd", ".usda", ".usdc", ".usdz"}


def stage_of(text: str, metadata: str = "") -> Usd.Stage:
    """A stage whose root layer holds `text`, with stage `metadata`."""
    stage = Usd.Stage.CreateInMemory("test.usda")
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n(\n{metadata}\n)\n{text}")
    return stage


def read(text: str, frame: float | None = None, metadata: str = "", **options: Any) -> Scene:
    return StageReader(stage_of(text, metadata), ReadOptions(**options)).read(frame)


def move(x: float = 0, y: float = 0, z: float = 0) -> str:
    return f'double3 xformOp:translate = ({x}, {y}, {z})\nuniform token[] xformOpOrder = ["xformOp:translate"]'


def instance(name: str, body: str = "", source: str = "tree") -> str:
    """A native instance of the class `source`."""
    return f'def Xform "{name}" (\ninstanceable = true\ninherits = </{source}>\n) {{\n{body}\n}}\n'


TREE = f"""class Xform "tree" {{
    def Cube "trunk" {{
        {move(y=1)}
    }}
    def Xform "crown" {{
        float3 xformOp:scale = (2, 2, 2)
        float xformOp:rotateX = 30
        uniform token[] xformOpOrder = ["xformOp:scale", "xformOp:rotateX"]
        def Sphere "leaves" {{
            {move(z=3)}
        }}
    }}
}}
"""

MATERIALS = "".join(
    f"""def Material "{name}" {{
        token outputs:surface.connect = </{name}/s.outputs:surface>
        def Shader "s" {{
            uniform token info:id = "UsdPreviewSurface"
            token outputs:surface
        }}
    }}
    """
    for name in ("wood", "paint")
)


def bound(body: str, material: str, strength: str = "weakerThanDescendants") -> str:
    """`body`, a prim with metadata, with a binding on it."""
    binding = f'rel material:binding = </{material}> (bindMaterialAs = "{strength}")'
    return body.replace("(\n", '(\nprepend apiSchemas = ["MaterialBindingAPI"]\n', 1).replace("{", f"{{\n{binding}", 1)


def placed(scene: Scene) -> dict[str, NDArray[np.float64]]:
    """World matrix of each instance by its path; paths that instances share take the instance's id behind a #."""
    found = {}
    for drawable in scene.drawables:
        for row, matrix in enumerate(drawable.world_from_object):
            shared = len(drawable.paths) < len(drawable.world_from_object)
            name = f"{drawable.paths[0]}#{drawable.instance_ids[row]}" if shared else drawable.paths[row]
            assert name not in found
            found[name] = matrix
    return found


def positions(scene: Scene) -> list[tuple[float, ...]]:
    """Where the origins of all drawn instances are, sorted."""
    matrices = np.concatenate([drawable.world_from_object for drawable in scene.drawables])
    return sorted(tuple(row) for row in matrices[:, :3, 3].round(6).tolist())


def drawable_at(scene: Scene, path: str) -> Drawable:
    return next(drawable for drawable in scene.drawables if path in drawable.paths)


def material_names(scene: Scene, path: str) -> list[str]:
    """Paths of the materials of a drawable's subsets, in order."""
    return [scene.materials[subset.material].path for subset in drawable_at(scene, path).subsets]


def reasons(scene: Scene, path: str) -> list[str]:
    return [issue.reason for issue in scene.unsupported if issue.path == path]


def column_vectors(gf: Gf.Matrix4d) -> NDArray[np.float64]:
    """USD's row-vector matrix as ours, element by element."""
    return np.array([[gf[column][row] for column in range(4)] for row in range(4)])


def stages_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in SUFFIXES)
