"""In-memory stages written as usda text, and what tests look up in the scenes that are read from them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd

from defshade_cli.scene.geometry import Drawable
from defshade_cli.scene.scene import Scene
from defshade_cli.usd.reader import StageReader

SUFFIXES = {".usd", ".usda", ".usdc", ".usdz"}


def stage_of(text: str, metadata: str = "") -> Usd.Stage:
    """A stage whose root layer holds `text`, with stage `metadata`."""
    stage = Usd.Stage.CreateInMemory("test.usda")
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n(\n{metadata}\n)\n{text}")
    return stage


def read(text: str, frame: float | None = None, metadata: str = "", **options: Any) -> Scene:
    return StageReader(stage_of(text, metadata), **options).read(frame)


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
