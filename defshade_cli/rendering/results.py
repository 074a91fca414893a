"""What became of a job's frames."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

from defshade_cli.dataclass import dataclass
from defshade_cli.image.film import Film
from defshade_cli.plan import Plan


@dataclass(frozen=True, slots=True, eq=False)
class ImageResult:
    """What became of one image.

    paths: the files written, or found where `skipped`.  film, plan: None where skipped.
    seconds: wall time per step: read, plan, context, upload, draw, write.
    """

    paths: tuple[Path, ...]
    skipped: bool = False
    film: Film | None = None
    plan: Plan | None = None
    seconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """What became of one frame: an image for each product of the stage's, or one.

    startup: wall time per step before the first frame: open.
    """

    frame: float | None
    images: tuple[ImageResult, ...]
    startup: dict[str, float] = field(default_factory=dict)

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files of all images."""
        return tuple(path for image in self.images for path in image.paths)

    @property
    def skipped(self) -> bool:
        """Whether all images stood already."""
        return all(image.skipped for image in self.images)

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time per step, of all images together."""
        steps = dict.fromkeys(step for image in self.images for step in image.seconds)
        return self.startup | {step: sum(image.seconds.get(step, 0.0) for image in self.images) for step in steps}
