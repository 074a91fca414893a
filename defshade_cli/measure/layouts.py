"""What each GBuffer layout costs: the beauty of stages against the float64 reference, as a table for the docs.

`python -m defshade_cli.measure.layouts docs/lighting.md` renders every stage in scenes/ and writes the table anew.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from defshade_cli import resources
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.error import RelativeError, relative_error
from defshade_cli.measure.reference import reference_radiance
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import LAYOUTS, Layout, RenderSettings
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader

SIZE = (480, 270)
_HEADER = "| stage | " + " | ".join(f"{layout}, median | p99.9" for layout in LAYOUTS) + " |"
_RULE = "|---|" + "---:|---:|" * len(LAYOUTS)


def first_frame(path: Path) -> Scene:
    """The stage at its first frame, seen by its own camera. Raises the errors of errors.py."""
    reader = StageReader(open_stage(path))
    return reader.read(reader.first_frame())


def layout_errors(
    pipeline: Pipeline, scene: Scene, settings: RenderSettings, layouts: Iterable[Layout] = LAYOUTS
) -> dict[Layout, RelativeError]:
    """Each layout's beauty against the reference, which is evaluated on the float GBuffer.

    Raises as make_plan: UsageError.
    """
    plan = make_plan(scene, replace(settings, layout="float"))
    lights = [planned.light for planned in plan.lights]
    reference, _ = reference_radiance(
        pipeline.planes(scene, plan), plan.camera, lights, shading=settings.shading, exposure=settings.exposure
    )

    def error(layout: Layout) -> RelativeError:
        film = pipeline.render(scene, make_plan(scene, replace(settings, layout=layout)))
        return relative_error(film.layers["beauty"][..., :3], reference)

    return {layout: error(layout) for layout in layouts}


def layout_table(errors: Mapping[str, Mapping[Layout, RelativeError]]) -> str:
    """Markdown: one row a stage, median and 99.9th percentile a layout."""
    rows = [
        f"| {stage} | " + " | ".join(f"{e.median:.1e} | {e.p999:.1e}" for e in (by_layout[x] for x in LAYOUTS)) + " |"
        for stage, by_layout in errors.items()
    ]
    return "\n".join([_HEADER, _RULE, *rows])


def referenced_stages() -> list[Path]:
    """The stages that the float64 reference covers: lights with a position or a direction, not skies."""
    return sorted(path for path in resources.SCENES.glob("*.usda") if path.stem != "light_dome")


def main(page: Path) -> None:
    """Measure every stage that has a reference, and write the table into the page.

    Raises the errors of errors.py.
    """
    stages = referenced_stages()
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        settings = RenderSettings(size=SIZE, shadows=False, light_points=1)
        errors = {path.stem: layout_errors(pipeline, first_frame(path), settings) for path in stages}
    page.write_text(replace_generated(page.read_text("utf-8"), "layouts", layout_table(errors)), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
