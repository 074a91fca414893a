"""`defshade inspect`."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from defshade_cli.cli.options import HeadedCommand, epilog, takes_stage
from defshade_cli.cli.progress import frame_name, show_log
from defshade_cli.cli.stats import plain
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from rich.tree import Tree

    from defshade_cli.plan import Plan
    from defshade_cli.scene.light import Light
    from defshade_cli.scene.scene import Scene

_EPILOG = epilog(
    "defshade inspect scene.usda",
    "defshade inspect shot.usd --frames 12 --plan",
    "defshade inspect scene.usda --json",
    "defshade inspect scene.usda --timing --width 960",
    "defshade inspect shot.usd --samples 64 --layers beauty,depth --save-settings final.usda",
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@takes_stage
@click.option("--plan", "with_plan", is_flag=True, help="Add what the renderer decides for this stage, and why.")
@click.option("--timing", is_flag=True, help="Draw the first frame too, and add what each step of it takes.")
@click.option(
    "--save-settings",
    "saved",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.usda",
    help="Write the RenderSettings that the options amount to: for --session-layer FILE.usda --settings "
    "/Render/settings, or for the stage's own layers.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON in place of a tree.")
def inspect(job: RenderJob, as_json: bool, with_plan: bool, timing: bool, saved: Path | None) -> None:
    """Show what a render of SCENE would see.

    Cameras, lights and the volumes they are drawn as, materials, geometry, and the prims that would be left out. It
    renders nothing and needs no graphics device, but for --timing.
    """
    from defshade_cli.rendering import examine, time_steps
    from defshade_cli.rendering.saving import save_settings

    show_log()
    scene, plan = examine(job)
    if saved is not None:
        save_settings(job, scene, plan, saved)
    seconds = time_steps(job) if timing else {}
    if as_json:
        record = _record(job, scene, plan) | ({"seconds": seconds} if timing else {})
        click.echo(json.dumps(plain(record), indent=2, allow_nan=False))
        return
    tree = _tree(job, scene, plan, with_plan)
    if timing:
        _branch(tree, "time", [f"{step}: {taken:.3f} s" for step, taken in seconds.items()], counted=False)
    _show(tree)


def _record(job: RenderJob, scene: Scene, plan: Plan) -> dict[str, Any]:
    return {
        "stage": scene.name,
        "composition": job.composition.choices,
        "frame": scene.frame,
        "frames_per_second": scene.frames_per_second,
        "up_axis": scene.up_axis,
        "meters_per_unit": scene.meters_per_unit,
        "bounds": scene.bounds.tolist(),
        "camera": scene.camera.path,
        "cameras": scene.cameras,
        "lights": [
            {"path": light.path, "kind": light.kind, "volume": volume, "reach": reach}
            for light, volume, reach in _lights(scene, plan)
        ],
        "materials": [material.path for material in scene.materials],
        "geometry": _geometry(scene),
        "unsupported": scene.unsupported,
        "plan": {"size": plan.size, "decisions": plan.decisions},
    }


def _geometry(scene: Scene) -> dict[str, int]:
    instances = sum(len(drawable.world_from_object) for drawable in scene.drawables)
    return {"meshes": len(scene.meshes), "instances": instances, "triangles": scene.triangle_count}


def _tree(job: RenderJob, scene: Scene, plan: Plan, with_plan: bool) -> Tree:
    from rich.tree import Tree

    width, height = plan.size
    tree = Tree(
        f"{scene.name}  frame {frame_name(scene.frame)}, {width}x{height}, {scene.up_axis} up, "
        f"{scene.meters_per_unit:g} m a unit, {scene.frames_per_second:g} frames a second"
    )
    if choices := job.composition.choices:
        lines = [f"{name.replace('_', ' ')}: {choice}" for name, choice in choices.items()]
        _branch(tree, "composition", lines, counted=False)
    _branch(tree, "cameras", _camera_lines(scene))
    _branch(tree, "lights", [_light_line(*light) for light in _lights(scene, plan)])
    _branch(tree, "materials", [material.path for material in scene.materials])
    _branch(tree, "geometry", [f"{noun}: {count:,}" for noun, count in _geometry(scene).items()], counted=False)
    _add_unsupported(tree, scene)
    if with_plan:
        _branch(tree, "plan", [f"{d.subject}: {d.choice} ({d.reason})" for d in plan.decisions], counted=False)
    return tree


def _camera_lines(scene: Scene) -> list[str]:
    """Every camera, the one to render marked; it stands first where it is not of the stage."""
    cameras = scene.cameras if scene.camera.path in scene.cameras else (scene.camera.path, *scene.cameras)
    return [f"{path}  ← selected" if path == scene.camera.path else path for path in cameras]


def _lights(scene: Scene, plan: Plan) -> list[tuple[Light, str | None, float]]:
    """Every light with its volume and reach; None and 0 for one that gives no light and is not drawn."""
    planned = {p.number: (p.volume, p.reach) for p in plan.lights}
    return [(light, *planned.get(number, (None, 0.0))) for number, light in enumerate(scene.lights)]


def _light_line(light: Light, volume: str | None, reach: float) -> str:
    if volume is None:
        return f"{light.path}  {light.kind}, gives no light"
    limit = f", reach {reach:.4g}" if math.isfinite(reach) else ""
    return f"{light.path}  {light.kind} → {volume}{limit}"


def _add_unsupported(tree: Tree, scene: Scene) -> None:
    paths = defaultdict(list)
    for prim in scene.unsupported:
        paths[prim.reason].append(prim.path)
    branch = _branch(tree, "unsupported", []) if not paths else tree.add("unsupported")
    for reason in sorted(paths):
        _branch(branch, reason, paths[reason])


def _branch(tree: Tree, title: str, lines: Iterable[str], counted: bool = True) -> Tree:
    lines = list(lines)
    branch = tree.add(f"{title} ({len(lines)})" if counted and lines else title)
    for line in lines or ["none"]:
        branch.add(line)
    return branch


def _show(tree: Tree) -> None:
    """Print without markup and wrapping: prim paths hold brackets, and a path cut in two finds nothing."""
    from rich.console import Console

    Console(markup=False, highlight=False, emoji=False, soft_wrap=True).print(tree)
