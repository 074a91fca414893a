"""`defshade gbuffer`."""

from __future__ import annotations

import click

from defshade_cli.cli.options import HeadedCommand, Reporting, epilog, takes_job
from defshade_cli.cli.render import execute
from defshade_cli.settings import RenderJob

_LAYERS = ("depth", "distance", "position", "normal", "albedo", "metallic", "roughness", "emission")
_EPILOG = epilog(
    "defshade gbuffer scene.usda",
    "defshade gbuffer scene.usda --layers depth,normal --width 640 -o training.exr",
    "defshade gbuffer shot.usd --frames 1:100 --split-layers -o 'data/{scene}.####.exr'",
    "defshade gbuffer scene.usda --sheet --layers albedo,metallic,normal,roughness,depth,beauty",
    layers=True,
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@takes_job(layers=_LAYERS, name="{scene}.gbuffer")
def gbuffer(job: RenderJob, reporting: Reporting) -> None:
    """Write depth, normals and materials of SCENE.

    Unlit, one sample at each pixel's centre, in one EXR. The same as render with other defaults.
    """
    execute(job, reporting)
