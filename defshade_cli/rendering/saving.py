"""A command line as part of a stage."""

from __future__ import annotations

from pathlib import Path

from defshade_cli.farm.own_settings import own_settings
from defshade_cli.image.layers import LAYERS, resolve
from defshade_cli.plan import Plan
from defshade_cli.scene.product import Variable
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderJob
from defshade_cli.usd.render_settings.saved_settings import SavedSettings, write_settings

_TYPES = {1: "float", 2: "float2", 3: "color3f", 4: "color4f"}


def save_settings(job: RenderJob, scene: Scene, plan: Plan, path: Path) -> None:
    """Write the RenderSettings that `job` amounts to. Raises OutputError; UsageError for an unknown layer."""
    (width, height), window = plan.display, plan.window
    left, right = window.x / width, (window.x + window.width) / width
    bottom, top = 1.0 - (window.y + window.height) / height, 1.0 - window.y / height
    saved = SavedSettings(
        camera=scene.camera.path if scene.camera.path in scene.cameras else None,
        resolution=plan.display,
        data_window=(left, bottom, right, top),
        purposes=job.settings.purposes or scene.purposes,
        rendering_space=plan.render_space.interop_id,
        variables=tuple(_variable(name) for name in resolve(plan.layers)),
        own=own_settings(job.settings),
    )
    write_settings(saved, path)


def _variable(name: str) -> Variable:
    return Variable(name, name, data_type=_TYPES.get(len(LAYERS[name].channels), "color4f"))
