"""A display transform as GLSL, by OpenColorIO: the same transform as image.colour's, for a graphics device."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.colour import DisplayTransform
from defshade_cli.image.kept import Arrays
from defshade_cli.image.ocio import kept_answer, read_config

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

log = logging.getLogger("defshade")

Texels = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """A texture that the shader reads.

    sampler: its name in the source.  values: (H, W, C) or (D, H, W, C) float32.  smooth: read between its texels.
    """

    sampler: str
    values: Texels
    smooth: bool


@dataclass(frozen=True, slots=True, eq=False)
class DisplayShader:
    """source: GLSL with `vec4 display(vec4 color)`, from the render space to the display."""

    source: str
    tables: tuple[Table, ...]


class _NoShaderError(Exception):
    """OpenColorIO's word on why."""


def display_shader(transform: DisplayTransform) -> DisplayShader | None:
    """None for a transform that OpenColorIO makes no shader of; the log says why."""
    try:
        arrays = kept_answer(transform.space.config, f"shader {transform}", lambda: _shader(transform))
    except _NoShaderError as error:
        log.info("%s, %s: %s", transform.display, transform.view, error)
        return None
    source, smooth = str(arrays.pop("source")), arrays.pop("smooth")
    tables = (Table(sampler, values, sampler in smooth) for sampler, values in arrays.items())
    return DisplayShader(source, tuple(tables))


def _shader(transform: DisplayTransform) -> Arrays:
    """The source, which samplers are smooth, and what they read by their names. Raises _NoShaderError."""
    import PyOpenColorIO as ocio

    description = ocio.GpuShaderDesc.CreateShaderDesc(
        language=ocio.GPU_LANGUAGE_GLSL_4_0, functionName="display", resourcePrefix="ocio_"
    )
    description.setAllowTexture1D(False)
    try:
        _processor(transform).getDefaultGPUProcessor().extractGpuShaderInfo(description)
    except ocio.Exception as error:
        raise _NoShaderError(str(error)) from error
    flat, deep = list(description.getTextures()), list(description.get3DTextures())
    smooth = [texture.samplerName for texture in (*flat, *deep) if texture.interpolation != ocio.INTERP_NEAREST]
    told = {"source": np.array(description.getShaderText()), "smooth": np.array(smooth, str)}
    told |= {texture.samplerName: _values(texture, texture.height, texture.width) for texture in flat}
    return told | {texture.samplerName: _values(texture, *[texture.edgeLen] * 3) for texture in deep}


def _processor(transform: DisplayTransform) -> ocio.Processor:
    import PyOpenColorIO as ocio

    config = read_config(transform.space.config)
    shown = ocio.DisplayViewTransform(transform.space.name, transform.display, transform.view)
    pipeline = ocio.LegacyViewingPipeline()
    pipeline.setDisplayViewTransform(shown)
    pipeline.setLooksOverrideEnabled(bool(transform.look))
    pipeline.setLooksOverride(transform.look)
    return pipeline.getProcessor(config)


def _values(texture: ocio.GpuShaderDesc.Texture | ocio.GpuShaderDesc.Texture3D, *shape: int) -> Texels:
    return np.array(texture.getValues(), np.float32).reshape(*shape, -1)
