"""Whether `--max-error` keeps its word: tile by tile, the error that a render claims against the one that it has.

`python -m defshade_cli.measure.convergence docs/accuracy.md [STAGE...]` renders the stages of measure/accuracy.py, or
those named, until 95 % of their tiles claim MAX_ERROR, and compares them with renders of LIMIT samples. Errors are
counted against our own limit: what separates that from the truth, such as the texels of shadow maps, no number of
samples tells.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.accuracy import stages
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.convergence import Convergence
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

SIZE = (160, 90)
MAX_ERROR = 0.05
MOST, LIMIT = 128, 1024
SLACK = 1.5

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_HEADER = f"| stage | samples, mean | claimed | true | tiles within {SLACK}x | true over claimed, median |"
_RULE = "|---|" + "---:|" * 5


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """claimed, true: (T,) relative errors of the tiles that have any; samples: a pixel, on average."""

    claimed: NDArray[np.float64]
    true: NDArray[np.float64]
    samples: float

    @property
    def kept(self) -> float:
        """Share of the tiles whose true error is at most SLACK times the claimed one."""
        return float((self.true <= SLACK * self.claimed).mean())


def measure_claim(pipeline: Pipeline, scene: Scene, settings: RenderSettings, limit: int) -> Claim:
    """Render with `settings` and with `limit` samples, and compare. Raises as make_plan: UsageError."""
    plan = make_plan(scene, replace(settings, layers=("beauty", "variance", "sampleCount")))
    film = pipeline.render(scene, plan).layers
    converged = pipeline.render(scene, make_plan(scene, RenderSettings(size=settings.size, samples=limit)))
    difference = (film["beauty"] - converged.layers["beauty"])[..., :3].astype(np.float64) @ _LUMINANCE
    luminance = (film["beauty"][..., :3] @ _LUMINANCE.astype(np.float32))[..., None]
    claimed = _tile_errors(plan.size, luminance, film["variance"])
    true = _tile_errors(plan.size, luminance, (difference**2)[..., None].astype(np.float32))
    noisy = np.maximum(claimed, true) > 1e-6
    return Claim(claimed[noisy], true[noisy], float(film["sampleCount"].mean()))


def _tile_errors(
    size: tuple[int, int], luminance: NDArray[np.float32], squares: NDArray[np.float32]
) -> NDArray[np.float64]:
    tiles = Convergence(size, None)
    tiles.judge(luminance, squares, 1)
    return tiles.error


def claims_table(claims: Mapping[str, Claim]) -> str:
    """Markdown: one row a stage, and one of all tiles together."""
    return "\n".join([_HEADER, _RULE, *(_row(stage, claim) for stage, claim in claims.items()), _all(claims)])


def _row(stage: str, claim: Claim) -> str:
    worst = [f"{np.percentile(e, 95):.3f}" for e in (claim.claimed, claim.true)]
    ratio = np.median(claim.true / np.maximum(claim.claimed, 1e-9))
    return f"| {stage} | {claim.samples:.0f} | {worst[0]} | {worst[1]} | {100 * claim.kept:.0f} % | {ratio:.2f} |"


def _all(claims: Mapping[str, Claim]) -> str:
    claimed, true = (np.concatenate([getattr(c, name) for c in claims.values()]) for name in ("claimed", "true"))
    return _row("all", Claim(claimed, true, float(np.mean([c.samples for c in claims.values()]))))


def main(page: Path, names: list[str]) -> None:
    """Measure the stages, or those named; progress goes to stderr. Raises the errors of errors.py."""
    claims: dict[str, Claim] = {}
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        for path in (path for path in stages() if not names or path.stem in names):
            settings = RenderSettings(size=SIZE, samples=MOST, max_error=MAX_ERROR)
            claims[path.stem] = measure_claim(pipeline, first_frame(path), settings, LIMIT)
            print(_row(path.stem, claims[path.stem]), file=sys.stderr, flush=True)
    page.write_text(replace_generated(page.read_text("utf-8"), "convergence", claims_table(claims)), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
