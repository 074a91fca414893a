"""What lobes mirror of skies and lamps, by rays of each pixel's own: shaders/lobe_rays.frag.

The directions and points that all pixels share are too few for a narrow lobe, and what is hidden along one of them
tells little of the next. A ray a sample along the lobe finds both, in a tree of boxes on the device. It is the same ray
for all lights.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import BOXES, CELLS, LAMPS, TRIANGLES, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import background_depth
from defshade_cli.gpu.shaders import set_uniforms
from defshade_cli.image.environment import sky_of
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_records import light_records
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.sky_guide import SkyGuides
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.tables import LightTables
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.emission import far_field
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.scene import Scene

if TYPE_CHECKING:
    from defshade_cli.scene.triangle_tree import TriangleTree


class TreeStore:
    """The tree of one scene after another; it stays on the device while nothing in it moves."""

    def __init__(self, gpu: Gpu) -> None:
        self._boxes, self._triangles = RecordBuffer(gpu, BOXES), RecordBuffer(gpu, TRIANGLES)
        self._scene: Scene | None = None
        self._tree: TriangleTree | None = None

    def update(self, scene: Scene) -> TriangleTree:
        """Make the scene's tree resident."""
        if self._tree is None or self._scene is None or not _is_placed_alike(self._scene, scene):
            from defshade_cli.scene.triangle_tree import triangle_tree

            self._tree = triangle_tree(scene)
            self._boxes.write(self._tree.packed_boxes)
            self._triangles.write(in_texels(self._tree.edges))
        self._scene = scene
        return self._tree


def in_texels(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, K, 3) as the vec4 of a storage buffer."""
    return np.concatenate([rows, np.zeros((*rows.shape[:2], 1), np.float32)], axis=2)


def _is_placed_alike(one: Scene, other: Scene) -> bool:
    return (
        one.meshes == other.meshes
        and len(one.drawables) == len(other.drawables)
        and all(
            a.mesh == b.mesh and a.subsets == b.subsets and np.array_equal(a.world_from_object, b.world_from_object)
            for a, b in zip(one.drawables, other.drawables, strict=True)
        )
    )


class LampStore:
    """The lamps of one plan after another on the device."""

    def __init__(self, gpu: Gpu) -> None:
        self._lamps, self._cells = RecordBuffer(gpu, LAMPS), RecordBuffer(gpu, CELLS)

    def update(self, plan: Plan, towards: NDArray[np.float64], tables: LightTables) -> NDArray[Any]:
        """Make the plan's lamps resident. towards: (3,) as for `emitter_at`.

        Returns their Light records (N,), which are to be bound where rays are drawn.
        """
        from defshade_cli.passes.lamp_records import lamp_records

        records, cells = lamp_records(plan.lamps, plan.samples, plan.camera.position, towards)
        self._lamps.write(records)
        self._cells.write(cells)
        emitters = [far_field(planned.light) for planned in plan.lamps]
        return light_records(plan.lamps, emitters, plan.camera.position, None, tables)


@dataclass(frozen=True, slots=True, eq=False)
class LobeRays:
    """What the rays of a frame read: how dense the shared directions of each dome are, and what is in the way.

    lamps: (L,) Light records of the plan's, whose other half LampStore has made resident.
    """

    densities: Mapping[DomeLight, moderngl.Texture]
    tree: TriangleTree | None
    lamps: NDArray[Any]

    def release(self) -> None:
        """The densities."""
        for texture in self.densities.values():
            texture.release()

    def uniforms(self, plan: Plan) -> dict[str, object]:
        """Of shaders/lobe_rays.frag and shaders/lib/rays.glsl."""
        uniforms: dict[str, object] = {"rays": plan.lobe_rays}
        if self.tree:
            uniforms["grid_low"], uniforms["grid_step"] = (tuple(each.tolist()) for each in self.tree.grid)
            uniforms["tree_rounding"] = self.tree.rounding
            uniforms["tree_shape"] = self.tree.leaves, self.tree.leaf_size
            uniforms["tree_from_relative"] = tuple(plan.camera.position - self.tree.centre)
        return uniforms


def sky_densities(plan: Plan, guides: SkyGuides, textures: SkyTextures) -> dict[DomeLight, moderngl.Texture]:
    """Of the directions of each dome that rays see, in all samples, by solid angle."""
    domes = [(p.light, p.points * plan.samples) for p in plan.domes if isinstance(p.light, DomeLight) and p.by_rays]
    return {dome: textures.density(count * sky_of(dome).density(guides.get(dome))) for dome, count in domes}


class SkyRaysPass:
    """Compiled for one variant of the lighting. hidden: geometry hides the sky."""

    def __init__(
        self, gpu: Gpu, variant: LightingVariant, screen: Screen, textures: SkyTextures, *, hidden: bool
    ) -> None:
        from defshade_cli.passes.dome_program import DomeProgram

        variant = replace(variant, ies=False, shaped=False)
        defines, generated = _sources(variant, ["HIDDEN"] * hidden)
        self._dome = DomeProgram(gpu, "lobe_rays.frag", defines, generated, screen, textures)

    def draw(
        self,
        planned: PlannedLight,
        plan: Plan,
        gbuffer: GBuffer,
        targets: LightTargets,
        rays: LobeRays,
        first_link: int = ALL_LINKED,
    ) -> None:
        """Add what a dome shows in lobes. first_link: place of its bits."""
        assert isinstance(planned.light, DomeLight)
        uniforms = {**rays.uniforms(plan), "first_link": first_link}
        self._dome.add(planned, gbuffer, targets, uniforms, {"sky_density": rays.densities[planned.light]})


class LampRaysPass:
    """Compiled for one variant of the lighting. hidden: geometry hides some lamps."""

    def __init__(self, gpu: Gpu, variant: LightingVariant, screen: Screen, *, hidden: bool) -> None:
        self._context, self._screen = gpu.context, screen
        defines, generated = _sources(variant, ["LAMPS", *["HIDDEN"] * hidden])
        self._program = gpu.shaders.program("screen.vert", "lobe_rays.frag", defines=defines, generated=generated)
        self._array = screen.array(self._program)

    def draw(self, plan: Plan, gbuffer: GBuffer, targets: LightTargets, rays: LobeRays, tables: LightTables) -> None:
        """Add what all lamps show in lobes; their Light records are bound."""
        self._context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._context.depth_func = "!="
        background = background_depth(gbuffer.layout)
        first = 0
        for groups, lamps in groupby(plan.lamps, key=lambda planned: planned.groups):
            count = len(list(lamps))
            targets.of(groups).use()
            gbuffer.bind(self._program, ies_tables=tables.candela)
            set_uniforms(self._program, {**rays.uniforms(plan), "lamp_run": (first, count), "screen_depth": background})
            self._screen.draw(self._array)
            first += count


def _sources(variant: LightingVariant, defines: Iterable[str]) -> tuple[list[str], dict[str, str]]:
    """Defines and generated files of shaders/lobe_rays.frag."""
    variant = replace(variant, shadows=(), shadow_styles=False)
    return [*variant.defines, "VOLUME_QUAD", *defines], variant.generated
