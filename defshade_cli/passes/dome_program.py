"""What the passes that light by a dome have in common: a program over the whole image, and the sky it reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.shaders import set_uniforms
from defshade_cli.image.environment import sky_of
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.plan import PlannedLight
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.spaces import rigid


class DomeProgram:
    """A fragment shader that includes lib/environment.glsl, with its defines and generated sources."""

    def __init__(
        self,
        gpu: Gpu,
        shader: str,
        defines: Iterable[str],
        generated: Mapping[str, str],
        screen: Screen,
        textures: SkyTextures,
    ) -> None:
        self._context, self._screen, self._textures = gpu.context, screen, textures
        self._program = gpu.shaders.program("screen.vert", shader, defines=defines, generated=generated)
        self._array = screen.array(self._program)

    def add(
        self,
        planned: PlannedLight,
        gbuffer: GBuffer,
        targets: LightTargets,
        uniforms: Mapping[str, object],
        textures: Mapping[str, moderngl.Texture],
    ) -> None:
        """Add a dome's light to its targets. uniforms, textures: what the shader reads besides the sky."""
        dome = planned.light
        assert isinstance(dome, DomeLight)
        targets.of(planned.groups).use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        sky = sky_of(dome)
        gbuffer.bind(self._program, sky=self._textures.image(sky), **textures)
        set_uniforms(self._program, {**_dome_uniforms(dome, sky), **uniforms})
        self._screen.draw(self._array)


def _dome_uniforms(dome: DomeLight, sky: Environment) -> dict[str, object]:
    """What lib/environment.glsl reads, and the response."""
    rotation = rigid(dome.world_from_light)[:3, :3]
    return {
        "sky_from_relative": tuple(rotation.ravel()),  # the transpose of a rotation, column by column
        "sky_emission": tuple(dome.emission),
        "irradiance_sh": [tuple(row) for row in sky.irradiance_sh],
        "cell_lod": sky.cell_level,
        "response": (dome.diffuse, dome.specular),
    }
