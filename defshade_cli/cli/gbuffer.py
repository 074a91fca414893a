"""`defshade gbuffer`."""

from __future__ import annotations

import click

from defshade_cli.cli.options import HeadedCommand, Reporting, epilog, takes_job
from defshade_cli.cli.render import execute
from defshade_cli.image.layers import LAYERS
from defshade_cli.settings import RenderJob

_DATA_LAYERS = tuple(name for name, layer in LAYERS.items() if not layer.filtered)
_EPILOG = epilog(
    "defshade gbuffer scene.usda",
    "defshade gbuffer scene.usda --layers depth,normal --width 640 -o training.exr",
    "defshade gbuffer shot.usd --frames 1:100 --split-layers -o 'data/{scene}.####.exr'",
    layers=True,
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@takes_job(layers=_DATA_LAYERS, name="{scene}.gbuffer")
def gbuffer(job: RenderJob, reporting: Reporting) -> None:
    """Write depth, normals and materials of SCENE.

    All data layers, unlit, one sample at each pixel's centre, in one EXR. The same as render with other defaults.
    """
    execute(job, reporting)
