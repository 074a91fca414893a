"""A stage, frame by frame, as Scenes."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from pxr import Usd

from defshade_cli.errors import EmptyStage
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh, Subset
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import UNBOUND
from defshade_cli.scene.scene import Scene, Unsupported
from defshade_cli.usd import stage as facts
from defshade_cli.usd.camera import choose_camera, find_cameras, framed_camera, read_camera
from defshade_cli.usd.geometry import Gprim
from defshade_cli.usd.instancing import Piece
from defshade_cli.usd.light import camera_light
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.palette import Palette
from defshade_cli.usd.settings import read_settings
from defshade_cli.usd.traversal import Traversal

log = logging.getLogger("defshade")

_NOWHERE = np.full((2, 3), np.nan)


class StageReader:
    """Reads frames of one stage. What does not change over time is read once, and stays the same object.

    camera: path or name; without it the rule of usd/camera.py picks.  purposes: of the geometry that is drawn.
    Raises PrimNotFound for a camera that the stage lacks.
    """

    def __init__(
        self, stage: Usd.Stage, *, camera: str | None = None, purposes: Sequence[str] = ("default", "render")
    ) -> None:
        self._stage, self._purposes = stage, tuple(purposes)
        self._memory = Memory(stage)
        self._settings = read_settings(stage)
        self._cameras = find_cameras(stage)
        self._camera = choose_camera(stage, self._cameras, camera, self._settings.camera)

    @property
    def camera_name(self) -> str:
        """The prim name of the camera that renders; `framed` for ours."""
        return self._camera.GetName() if self._camera else "framed"

    def first_frame(self) -> float | None:
        """The stage's startTimeCode; None, the default time, where no time range is authored."""
        return facts.first_frame(self._stage)

    def read(self, frame: float | None) -> Scene:
        """The stage at a time code, None standing for the default time.

        A frame in which everything is hidden for a while has no drawables. Raises EmptyStage where there is nothing
        to draw at any time, StageError for a camera that sees nothing.
        """
        time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
        with facts.gathered_diagnostics():
            scene = self._read(frame, time)
        return _lit(scene)

    def _read(self, frame: float | None, time: Usd.TimeCode) -> Scene:
        traversal = Traversal(self._stage, self._memory, time, self._purposes)
        pieces = traversal.read_stage()
        palette = Palette(self._memory, time)
        meshes: dict[Mesh, int] = {}
        drawables = tuple(self._drawables(pieces, meshes, palette))
        if not drawables and not traversal.dormant:
            raise EmptyStage(_empty(self._stage, traversal.issues))
        camera, camera_issues = self._read_camera(time)
        up_axis = facts.up_axis(self._stage)
        scene = Scene(
            name=facts.stage_name(self._stage),
            meshes=tuple(meshes),
            drawables=drawables,
            materials=palette.materials,
            lights=tuple(_lights(pieces)),
            camera=camera or framed_camera(_NOWHERE, up_axis),
            cameras=self._cameras,
            unsupported=(*traversal.issues, *palette.issues, *camera_issues, *self._settings.issues),
            meters_per_unit=facts.meters_per_unit(self._stage),
            up_axis=up_axis,
            frame=frame,
            frames_per_second=facts.frames_per_second(self._stage),
            resolution=self._settings.resolution,
            conform=self._settings.conform,
        )
        if camera is None:
            scene = replace(scene, camera=framed_camera(scene.bounds, up_axis))
        return replace(scene, pixel_aspect=self._settings.pixel_aspect_for(scene.camera))

    def _drawables(self, pieces: Iterable[Piece], meshes: dict[Mesh, int], palette: Palette) -> Iterator[Drawable]:
        """What is drawn of the pieces; `meshes` takes their meshes, each with its number."""
        for piece in pieces:
            if isinstance(piece.content, Gprim) and (piece.purpose or "default") in self._purposes:
                numbers = [palette.number(bindings) for bindings in piece.bindings]
                groups = zip(numbers, piece.content.groups, strict=True)
                yield Drawable(
                    mesh=meshes.setdefault(piece.content.mesh, len(meshes)),
                    world_from_object=piece.root_from_object,
                    subsets=tuple(Subset(number, group.first, group.count) for number, group in groups),
                    paths=piece.paths,
                    instance_ids=piece.ids,
                    display_color=np.nan_to_num(piece.display_color, nan=UNBOUND.diffuse_color[0]),
                    display_opacity=np.nan_to_num(piece.display_opacity, nan=UNBOUND.opacity),
                )

    def _read_camera(self, time: Usd.TimeCode) -> tuple[Camera | None, tuple[Unsupported, ...]]:
        if self._camera is None:
            return None, ()
        camera, issues = read_camera(self._camera, time)
        return self._settings.applied_to(camera), issues


def _lights(pieces: Iterable[Piece]) -> Iterator[Light]:
    for piece in pieces:
        if isinstance(piece.content, Light):
            count = len(piece.root_from_object)
            paths = piece.paths if len(piece.paths) == count else piece.paths * count
            for path, world_from_object in zip(paths, piece.root_from_object, strict=True):
                world_from_light = world_from_object @ piece.content.world_from_light
                yield replace(piece.content, path=path, world_from_light=world_from_light)


def _lit(scene: Scene) -> Scene:
    """The scene with a light at the camera, as usdrecord has it, where there is no other."""
    if scene.lights:
        return scene
    log.info("no light that is supported: one shines from the camera")
    return replace(scene, lights=(camera_light(scene.camera),))


def _empty(stage: Usd.Stage, issues: Iterable[Unsupported]) -> str:
    reason = next((f": {issue.path}: {issue.reason}" for issue in issues), "")
    return f"{stage.GetRootLayer().GetDisplayName()} has nothing to draw{reason}"
