"""Frames like the one before: where nothing of a stage moves, what was drawn once is every frame's picture."""

from __future__ import annotations

from dataclasses import dataclass

from defshade_cli.farm.shots import Shot
from defshade_cli.image.film import Film
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """film: drawn, checked and shown.  fault: what is wrong with its values; empty where all are numbers."""

    film: Film
    plan: Plan
    fault: str


class Stills:
    """The last picture of each product."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[Shot, Scene, Picture]] = {}

    def find(self, shot: Shot, scene: Scene) -> Picture | None:
        """The picture of `scene` as `shot` wants it, where the last one was of the same."""
        if shot.product.path not in self._last:
            return None
        then, before, picture = self._last[shot.product.path]
        return picture if then.job == shot.job and scene.is_still(before) else None

    def keep(self, shot: Shot, scene: Scene, picture: Picture) -> None:
        """Remember the last picture of a product, and what it is of."""
        self._last[shot.product.path] = shot, scene, picture
