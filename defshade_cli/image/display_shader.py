"""A display transform as GLSL, by OpenColorIO: the same transform as image.colour's, for a graphics device."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import PyOpenColorIO as ocio
from numpy.typing import NDArray

from defshade_cli.image.colour import DisplayTransform
from defshade_cli.image.ocio import read_config

log = logging.getLogger("defshade")


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A texture that the shader reads.

    sampler: its name in the source.  values: (H, W, C) or (D, H, W, C) float32.  smooth: read between its texels.
    """

    sampler: str
    values: NDArray[np.float32]
    smooth: bool


@dataclass(frozen=True, slots=True, eq=False)
class DisplayShader:
    """source: GLSL with `vec4 display(vec4 color)`, from the render space to the display."""

    source: str
    tables: tuple[Table, ...]


def display_shader(transform: DisplayTransform) -> DisplayShader | None:
    """None for a transform that OpenColorIO makes no shader of; the log says why."""
    try:
        return _shader(transform)
    except ocio.Exception as error:
        log.info("%s, %s: %s", transform.display, transform.view, error)
        return None


def _shader(transform: DisplayTransform) -> DisplayShader:
    description = ocio.GpuShaderDesc.CreateShaderDesc(
        language=ocio.GPU_LANGUAGE_GLSL_4_0, functionName="display", resourcePrefix="ocio_"
    )
    description.setAllowTexture1D(False)
    _processor(transform).getDefaultGPUProcessor().extractGpuShaderInfo(description)
    flat = (_table(texture, (texture.height, texture.width)) for texture in description.getTextures())
    deep = (_table(texture, (texture.edgeLen,) * 3) for texture in description.get3DTextures())
    return DisplayShader(description.getShaderText(), (*flat, *deep))


def _processor(transform: DisplayTransform) -> ocio.Processor:
    config = read_config(transform.space.config)
    shown = ocio.DisplayViewTransform(transform.space.name, transform.display, transform.view)
    pipeline = ocio.LegacyViewingPipeline()
    pipeline.setDisplayViewTransform(shown)
    pipeline.setLooksOverrideEnabled(bool(transform.look))
    pipeline.setLooksOverride(transform.look)
    return pipeline.getProcessor(config)


def _table(texture: ocio.GpuShaderDesc.Texture | ocio.GpuShaderDesc.Texture3D, shape: tuple[int, ...]) -> Table:
    values = np.array(texture.getValues(), np.float32).reshape(*shape, -1)
    return Table(texture.samplerName, values, texture.interpolation != ocio.INTERP_NEAREST)
