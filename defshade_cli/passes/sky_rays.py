"""What lobes mirror of a sky, by rays of each pixel's own: shaders/sky_rays.frag.

The directions that all pixels share are too few for a narrow lobe, and what is hidden along one of them tells little of
the next. A ray a sample along the lobe finds both, in a tree of boxes on the device.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.outputs import outputs_source
from defshade_cli.gpu.planes import read_source
from defshade_cli.gpu.residence import BOXES, TRIANGLES, RecordBuffer
from defshade_cli.image.environment import sky_of
from defshade_cli.passes.dome_program import DomeProgram
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import shadow_source
from defshade_cli.passes.sky_guide import SkyGuides
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.triangle_tree import TriangleTree, triangle_tree


class TreeStore:
    """The tree of one scene after another; it stays on the device while nothing in it moves."""

    def __init__(self, gpu: Gpu) -> None:
        self._boxes, self._triangles = RecordBuffer(gpu, BOXES), RecordBuffer(gpu, TRIANGLES)
        self._scene: Scene | None = None
        self._tree: TriangleTree | None = None

    def update(self, scene: Scene) -> TriangleTree:
        """Make the scene's tree resident."""
        if self._tree is None or self._scene is None or not _is_placed_alike(self._scene, scene):
            self._tree = triangle_tree(scene)
            self._boxes.write(in_texels(self._tree.boxes))
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


@dataclass(frozen=True, slots=True, eq=False)
class SkyRays:
    """What the rays of a frame read: how dense the shared directions of each dome are, and what is in the way."""

    densities: Mapping[DomeLight, moderngl.Texture]
    tree: TriangleTree | None

    def release(self) -> None:
        """The densities."""
        for texture in self.densities.values():
            texture.release()


def sky_densities(plan: Plan, guides: SkyGuides, textures: SkyTextures) -> dict[DomeLight, moderngl.Texture]:
    """Of each dome's directions, in all samples, by solid angle."""
    domes = [(p.light, p.points * plan.samples) for p in plan.domes if isinstance(p.light, DomeLight)]
    return {dome: textures.density(count * sky_of(dome).density(guides.get(dome))) for dome, count in domes}


class SkyRaysPass:
    """Compiled for one variant of the lighting. hidden: geometry hides the sky."""

    def __init__(
        self, gpu: Gpu, variant: LightingVariant, screen: Screen, textures: SkyTextures, *, hidden: bool
    ) -> None:
        variant = replace(variant, shadows=(), shadow_styles=False, ies=False, shaped=False)
        generated = {
            "generated/planes.glsl": read_source(variant.planes, variant.layout),
            "generated/outputs.glsl": outputs_source(variant.outputs, variant.groups),
            **shadow_source(variant.shadows),
        }
        defines = [*variant.defines, "VOLUME_QUAD", *["HIDDEN_SKY"] * hidden]
        self._dome = DomeProgram(gpu, "sky_rays.frag", defines, generated, screen, textures)

    def draw(
        self,
        planned: PlannedLight,
        plan: Plan,
        gbuffer: GBuffer,
        targets: LightTargets,
        rays: SkyRays,
        first_link: int = ALL_LINKED,
    ) -> None:
        """Add what a dome shows in lobes. first_link: place of its bits."""
        uniforms: dict[str, object] = {"first_link": first_link, "rays": plan.sky_rays}
        if rays.tree:
            uniforms["tree_rounding"] = rays.tree.rounding
            uniforms["tree_shape"] = rays.tree.leaves, rays.tree.leaf_size
            uniforms["tree_from_relative"] = tuple(plan.camera.position - rays.tree.centre)
        assert isinstance(planned.light, DomeLight)
        self._dome.add(planned, gbuffer, targets, uniforms, {"sky_density": rays.densities[planned.light]})
