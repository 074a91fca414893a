"""The stages that are made to lie, with all that they depend on."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from defshade_cli import resources
from defshade_cli.dataclass import dataclass
from defshade_cli.measure.fuzz.mutations import mutated
from defshade_cli.usd.opening.conversion import write_as
from defshade_cli.usd.opening.dependencies import read_dependencies

_STAGE_LIES = 0.6
"""How often it is the stage's own file, where it depends on others."""


@dataclass(frozen=True, slots=True)
class Case:
    """A stage to render, and the file of its folder that lies."""

    stage: Path
    changed: Path


class Corpus:
    """Copies of this project's stages in `folder`, as text, crate and package. One file lies at a time."""

    def __init__(self, folder: Path) -> None:
        shutil.copytree(resources.SCENES, folder, dirs_exist_ok=True)
        texts = sorted(folder.glob("*.usda"))
        others = [write_as(text, suffix) for text in texts for suffix in (".usdc", ".usdz")]
        self._stages = [*texts, *texts, *others]  # text half of the time: its lies are seldom found on opening
        self._parts = {stage: _others(stage, folder) for stage in self._stages}
        self._truth: dict[Path, bytes] = {}

    def case(self, number: int, seed: int) -> Case:
        """The case of that number, whatever came before it."""
        for path, data in self._truth.items():
            path.write_bytes(data)
        rng = np.random.default_rng((seed, number))
        stage = self._stages[rng.integers(len(self._stages))]
        parts = self._parts[stage]
        changed = parts[rng.integers(len(parts))] if parts and rng.random() > _STAGE_LIES else stage
        self._truth = {changed: changed.read_bytes()}
        changed.write_bytes(mutated(self._truth[changed], changed.suffix, rng))
        return Case(stage, changed)


def _others(stage: Path, folder: Path) -> list[Path]:
    """What the stage depends on besides itself, inside the folder."""
    files = (path for path in read_dependencies(stage).files.values() if path != stage.resolve())
    return sorted(path for path in files if path.is_relative_to(folder.resolve()))
