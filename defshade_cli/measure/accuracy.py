"""How near accumulated samples come to path-traced direct lighting, stage by stage, as a table for the docs.

`python -m defshade_cli.measure.accuracy docs/accuracy.md` renders every stage and writes the table anew. References
are kept in out/accuracy/ under a hash of all that they depend on.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from defshade_cli import resources
from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.compare import Comparison, compare
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.pathtraced import Reference, path_traced
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

SIZE = (320, 180)
SAMPLES = (1, 16, 256)

REFERENCE_SAMPLES = 2048
_OF_NOISY_STAGES = {"dome_even": 16384, "dome_gloss": 8192, "dome_sun": 4096, "materials": 4096}
STAGES = Path("accuracy")
CACHE = Path("out/accuracy")
_CHARTS = ("materials",)

_HEADER = "| stage | relMSE 1 | 16 | 256 | FLIP 1 | 16 | 256 | slope | reference's noise |"
_RULE = "|---|" + "---:|" * 8


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One stage against its reference: a Comparison for each number of samples.

    noise: relMSE of the reference itself, from its two halves.
    """

    by_samples: Mapping[int, Comparison]
    noise: float

    @property
    def slope(self) -> float:
        """Of log RMSE over log samples, from the second number of samples on: −1/2 is Monte Carlo's."""
        counts = sorted(self.by_samples)[1:]
        errors = [self.by_samples[n].rmse for n in counts]
        return float(np.polyfit(np.log(counts), np.log(np.maximum(errors, 1e-12)), 1)[0])


def measure(
    pipeline: Pipeline, scene: Scene, size: tuple[int, int], samples: Iterable[int], reference_samples: int
) -> Accuracy:
    """Render `scene` with each number of samples and compare with a path-traced reference. Raises DefshadeError."""
    plans = {n: make_plan(scene, RenderSettings(size=size, samples=n, background=False)) for n in samples}
    reference = cached_reference(scene, next(iter(plans.values())), reference_samples)
    radiance = reference.radiance
    images = {n: pipeline.render(scene, plan).layers["beauty"][..., :3] for n, plan in plans.items()}
    return Accuracy({n: compare(image, radiance)[0] for n, image in images.items()}, reference_noise(reference))


def reference_noise(reference: Reference) -> float:
    """relMSE of the mean of both halves: a quarter of what lies between them."""
    return compare(*reference.halves, flip=False)[0].rel_mse / 4.0


def cached_reference(scene: Scene, plan: Plan, samples: int) -> Reference:
    """path_traced, kept in CACHE. Raises DefshadeError as it does."""
    path = CACHE / f"{scene.name}-{_fingerprint(scene, plan.size, plan.exposure, samples)}.npy"
    if path.exists():
        return Reference(np.load(path))
    reference = path_traced(scene, plan, samples)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, reference.halves)
    return reference


def _fingerprint(*parts: Any) -> str:
    """Of values, and of the program that makes references of them."""
    digest = hashlib.sha256()
    for name in ("brdf", "mitsuba_plugins", "pathtraced", "pathtraced_lights"):
        digest.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    _digest(parts, digest)
    return digest.hexdigest()[:16]


def _digest(value: Any, digest: Any) -> None:
    if is_dataclass(value):
        _digest([getattr(value, field.name) for field in fields(value)], digest)
    elif isinstance(value, np.ndarray):
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        _digest(list(value.items()), digest)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for item in value:
            _digest(item, digest)
    else:
        digest.update(repr(value).encode())


def stages() -> list[Path]:
    """The lights' stages, then the material chart of scenes/."""
    return [*sorted(STAGES.glob("*.usda")), *(resources.SCENES / f"{name}.usda" for name in _CHARTS)]


def accuracy_table(results: Mapping[str, Accuracy]) -> str:
    """Markdown: one row a stage."""
    return "\n".join([_HEADER, _RULE, *(_row(stage, result) for stage, result in results.items())])


def _row(stage: str, result: Accuracy) -> str:
    shown = [result.by_samples[n] for n in SAMPLES]
    errors = [f"{c.rel_mse:.1e}" for c in shown] + [f"{c.flip:.3f}" for c in shown]
    return f"| {stage} | " + " | ".join([*errors, f"{result.slope:.2f}", f"{result.noise:.0e}"]) + " |"


def main(page: Path) -> None:
    """Measure every stage; progress goes to stderr. Raises the errors of errors.py."""
    results: dict[str, Accuracy] = {}
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        for path in stages():
            count = _OF_NOISY_STAGES.get(path.stem, REFERENCE_SAMPLES)
            results[path.stem] = measure(pipeline, first_frame(path), SIZE, SAMPLES, count)
            print(_row(path.stem, results[path.stem]), file=sys.stderr, flush=True)
    page.write_text(replace_generated(page.read_text("utf-8"), "accuracy", accuracy_table(results)), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
