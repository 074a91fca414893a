"""A stage, frame by frame, as Scenes."""

from __future__ import annotations

import logging
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import cycle
from typing import TYPE_CHECKING

from pxr import Usd

from defshade_cli.errors import EmptyStage
from defshade_cli.garbage import uncollected
from defshade_cli.scene.geometry import Drawable, Mesh
from defshade_cli.scene.light import Light
from defshade_cli.scene.scene import Scene, Unsupported
from defshade_cli.scene.view import View
from defshade_cli.usd.blame import blaming
from defshade_cli.usd.camera import find_cameras
from defshade_cli.usd.drawables import drawables_of
from defshade_cli.usd.facing import PlacedSurface, faced
from defshade_cli.usd.instancing.instancing import Piece
from defshade_cli.usd.lights.linking import link
from defshade_cli.usd.lights.shining import glowing_surfaces, lit, shining
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.opening import stage as facts
from defshade_cli.usd.opening.unresolved import by_reason, find_unresolved
from defshade_cli.usd.options import AS_IT_IS, ReadOptions
from defshade_cli.usd.palette import Palette
from defshade_cli.usd.render_settings.render_pass import pass_issues, read_pass
from defshade_cli.usd.render_settings.settings import read_settings
from defshade_cli.usd.sharing import shared
from defshade_cli.usd.sight import Sight
from defshade_cli.usd.surfaces.complexity import UNIFORM_LEVELS, choose_levels
from defshade_cli.usd.surfaces.geometry import Gprim, Surface
from defshade_cli.usd.surfaces.tessellation import Tessellation
from defshade_cli.usd.traversal import Traversal

if TYPE_CHECKING:
    from defshade_cli.scene.motion import Moment

log = logging.getLogger("defshade")


class StageReader:
    """Reads frames of one stage. What does not change over time is read once, and stays the same object.

    beside: a reader of the same stage, whose memory is shared.
    Raises PrimNotFound for a camera or render settings that the stage lacks.
    """

    def __init__(self, stage: Usd.Stage, options: ReadOptions = AS_IT_IS, *, beside: StageReader | None = None) -> None:
        self._stage, self._options = stage, options
        self._memory: Memory = beside._memory if beside else _memory(stage, options)
        self._tessellation: Tessellation = beside._tessellation if beside else Tessellation()
        self._settings = read_settings(stage, options.render_settings, options.product)
        self._purposes = tuple(self._settings.purposes if options.purposes is None else options.purposes)
        self._levels: dict[str, int] = {}
        self._last: Scene | None = None
        self._lights: dict[str, Light] = {}
        self._pass = read_pass(stage, options.render_settings)
        self._cameras = find_cameras(stage)
        self._sight = Sight(stage, self._settings, self._cameras, options)
        unresolved = tuple(arc.unsupported for arc in find_unresolved(stage))
        self._told = set(unresolved)  # by open_stage
        self._issues = (*unresolved, *pass_issues(stage, options.render_settings))

    @property
    def camera_name(self) -> str:
        """The prim name of the camera that renders; `framed`, `fit` or `turntable` for ours."""
        return self._sight.name

    def first_frame(self) -> float | None:
        """The stage's startTimeCode; None, the default time, where no time range is authored."""
        return facts.first_frame(self._stage)

    def read(self, frame: float | None) -> Scene:
        """The stage at a time code, None standing for the default time.

        A frame in which everything is hidden for a while has no drawables. Raises EmptyStage where there is nothing
        to draw at any time, StageError for a camera that sees nothing.
        """
        if self._last and self.is_still:  # asked for no sooner than a second frame is
            return replace(self._last, frame=frame)
        self._last = None
        time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
        with facts.gathered_diagnostics(), blaming(self._stage):
            levels = self._levels = {}
            scene = self._read(frame, time, levels)
            if self._options.extras.motion and frame is not None:
                neighbours = tuple(self._moment(scene, frame + step, levels) for step in (-1.0, 1.0))
                scene = replace(scene, neighbours=neighbours)
        self._tell(scene.unsupported)
        scene = lit(scene, studio=self._options.studio)
        self._last = scene
        return scene

    def read_shutter(self, scene: Scene, count: int) -> Iterator[Scene]:
        """The frame of `scene` again and again, at `count` times of its shutter in turn, without end.

        Surfaces are refined as often as at the frame itself. Raises EmptyStage where nothing is left to draw.
        """
        assert scene.frame is not None
        for offset in cycle(scene.camera.shutter_times(count)):
            time = Usd.TimeCode(scene.frame + offset)
            with facts.silence(), blaming(self._stage):
                moment = self._read(scene.frame, time, self._levels)
            yield lit(moment, studio=self._options.studio)

    def _tell(self, issues: Iterable[Unsupported]) -> None:
        """Log what the picture lacks, or shows otherwise than authored, when it is first met."""
        if new := [issue for issue in issues if issue not in self._told]:
            log.warning("not drawn as authored: %s", by_reason(new))
            self._told.update(new)

    def _moment(self, scene: Scene, frame: float, levels: dict[str, int]) -> Moment:
        """What `scene` has, as it is at another frame, refined alike."""
        from defshade_cli.scene.motion import moment_of

        then = self._read(frame, Usd.TimeCode(frame), levels)
        return moment_of(scene.drawables, scene.meshes, then.camera, then.drawables, then.meshes)

    @uncollected()
    def _read(self, frame: float | None, time: Usd.TimeCode, levels: dict[str, int]) -> Scene:
        """levels: of refinement by path of the surface; those that are missing are chosen, and put in."""
        base = time if frame is None else Usd.TimeCode(frame)
        traversal = self._traversal(time, base)
        pieces = traversal.read_stage()
        placed = self._surfaces(pieces)
        drawn = tuple((piece, surface) for piece, surface in placed if surface.groups)
        if not drawn and not traversal.found.dormant:
            raise EmptyStage(_empty(self._stage, traversal.found.issues))
        camera, camera_issues = self._sight.camera(frame, time, placed, self._placed_at)
        view = self._sight.view(camera)
        drawn = tuple(faced(drawn, view, UNIFORM_LEVELS.get(self._options.complexity)))
        gprims = self._tessellate(drawn, view, levels, traversal.found.glows)
        palette = Palette(self._memory.materials, time, self._settings.material_purposes)
        meshes: dict[Mesh, int] = {}
        glowing = glowing_surfaces(drawn, gprims, traversal.found.glows, palette)
        shown = [*drawables_of(drawn, gprims, meshes, palette, glowing)]
        lights, drawables = link(self._stage, self._shared_lights(shining(pieces, glowing)), shown)
        mended = dict.fromkeys(issue for gprim in gprims.values() for issue in gprim.issues)
        return Scene(
            name=facts.stage_name(self._stage),
            meshes=tuple(meshes),
            drawables=drawables,
            materials=palette.materials,
            lights=lights,
            portals=tuple(traversal.found.portals),
            camera=camera,
            cameras=self._cameras,
            unsupported=(*self._issues, *traversal.found.issues, *mended, *palette.issues, *camera_issues),
            meters_per_unit=facts.meters_per_unit(self._stage),
            up_axis=facts.up_axis(self._stage),
            frame=frame,
            moves=frame is not None and camera.shutter[0] < camera.shutter[1] and self._may_change,
            frames_per_second=facts.frames_per_second(self._stage),
            resolution=self._settings.resolution,
            pixel_aspect=self._settings.pixel_aspect_for(camera),
            conform=self._settings.conform,
            data_window=self._settings.data_window,
            labels=self._labels(drawables, time) if self._options.extras.labels else {},
            assets=self._assets(drawables) if self._options.extras.assets else {},
            purposes=self._purposes,
            rendering_space=self._settings.rendering_space,
        )

    def _traversal(self, time: Usd.TimeCode, base: Usd.TimeCode) -> Traversal:
        return Traversal(self._stage, self._memory, time, self._purposes, base, self._pass)

    def _placed_at(self, time: Usd.TimeCode) -> Sequence[PlacedSurface]:
        return self._surfaces(self._traversal(time, time).read_stage())

    def _surfaces(self, pieces: Iterable[Piece]) -> tuple[PlacedSurface, ...]:
        """Those of the pieces that count as geometry."""
        return tuple(
            (piece, piece.content)
            for piece in pieces
            if isinstance(piece.content, Surface) and (piece.purpose or "default") in self._purposes
        )

    def _labels(self, drawables: Iterable[Drawable], time: Usd.TimeCode) -> Mapping[str, str]:
        from defshade_cli.usd.identity import read_labels

        return read_labels(self._stage, _paths(drawables), time)

    def _assets(self, drawables: Iterable[Drawable]) -> Mapping[str, str]:
        from defshade_cli.usd.identity import read_assets

        return read_assets(self._stage, _paths(drawables))

    @cached_property
    def is_still(self) -> bool:
        """Is every frame like the first? The neighbours that motion asks for are read with their frame."""
        return not (self._sight.turns or self._options.extras.motion or self._may_change)

    @cached_property
    def _may_change(self) -> bool:
        return facts.may_change(self._stage)

    def _shared_lights(self, lights: Iterable[Light]) -> list[Light]:
        """Lights that are as they were when last read are the same objects."""
        found = [shared(light, self._lights.get(light.path)) for light in lights]
        self._lights = {light.path: light for light in found}
        return found

    def _tessellate(
        self, drawn: Iterable[PlacedSurface], view: View, levels: dict[str, int], shining: Container[str]
    ) -> dict[Surface, Gprim]:
        placed = ((surface, piece.root_from_object) for piece, surface in drawn)
        chosen = choose_levels(placed, self._options.complexity, view, shining)
        return self._tessellation.at_levels(
            {surface: levels.setdefault(surface.path, level) for surface, level in chosen.items()}
        )


def _memory(stage: Usd.Stage, options: ReadOptions) -> Memory:
    return Memory(stage, options.extras, as_cages=options.as_cages, seen_from=options.seen_from)


def _paths(drawables: Iterable[Drawable]) -> dict[str, None]:
    """Of every prim that is drawn, each once."""
    return dict.fromkeys(path for drawable in drawables for path in drawable.paths)


def _empty(stage: Usd.Stage, issues: Iterable[Unsupported]) -> str:
    reason = next((f": {issue.path}: {issue.reason}" for issue in issues), "")
    return f"{stage.GetRootLayer().GetDisplayName()} has nothing to draw{reason}"
