"""Frames like the one before: where nothing of a stage moves, what was drawn once is every frame's picture.

Where a part moves, the passes draw that part: plan/changes.py.
"""

from __future__ import annotations

from defshade_cli.dataclass import dataclass
from defshade_cli.farm.shots import Shot
from defshade_cli.image.film import Film
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """film: checked and shown.  drawn: before its check.  fault: what its values have; empty where all are numbers."""

    film: Film
    drawn: Film
    plan: Plan
    fault: str


class Stills:
    """The last picture of each product."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[Shot, Scene, Picture]] = {}

    def find(self, shot: Shot, scene: Scene) -> Picture | None:
        """The picture of `scene` as `shot` wants it, where the last one was of the same."""
        last = self.last(shot)
        return last[1] if last and scene.is_still(last[0]) else None

    def last(self, shot: Shot) -> tuple[Scene, Picture] | None:
        """What was last drawn of the shot's product as the shot wants it, and its picture."""
        then, before, picture = self._last.get(shot.product.path, (None, None, None))
        return (before, picture) if then and before and picture and then.job == shot.job else None

    def keep(self, shot: Shot, scene: Scene, picture: Picture) -> None:
        """Remember the last picture of a product, and what it is of."""
        self._last[shot.product.path] = shot, scene, picture
