"""Textures and framebuffers that passes draw into."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import GpuError, GpuMemoryError
from defshade_cli.gpu.context import Gpu
from defshade_cli.scene.window import WHOLE_IMAGE

_READ_DTYPE = {"f1": np.uint8, "f2": np.float16, "f4": np.float32, "u4": np.uint32}


_ROUNDING = 1e-2
"""Of a pixel, what shares in float32 may be off."""

Part = tuple[float, float, float, float]
"""Of an image: left, top, right and bottom as shares of it."""


NOWHERE: Part = (0.0, 0.0, 0.0, 0.0)


def pixels_of(part: Part, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """(x, y, width, height) of all pixels that a part of an image of (width, height) touches."""
    left, top, right, bottom = (share * side for share, side in zip(part, size * 2, strict=True))
    x, y = math.floor(left + _ROUNDING), math.floor(top + _ROUNDING)
    return x, y, max(math.ceil(right - _ROUNDING) - x, 0), max(math.ceil(bottom - _ROUNDING) - y, 0)


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A framebuffer with its colour textures by name and, where it has one, its depth."""

    framebuffer: moderngl.Framebuffer
    textures: dict[str, moderngl.Texture]
    depth: moderngl.Texture | None

    def read(self, name: str) -> NDArray[Any]:
        """(height, width, components) in the texture's own type, row 0 at the top; uint8 for 8-bit planes."""
        texture = self.textures[name]
        return _as_image(texture, _READ_DTYPE[texture.dtype], texture.components)

    def read_depth(self) -> NDArray[np.float32]:
        """(height, width) as stored."""
        assert self.depth is not None
        return _as_image(self.depth, np.float32, 1)[..., 0]

    def keep_to(self, part: Part) -> None:
        """Draw and clear in a part of the image alone from now on. The framebuffer is bound.

        All of it is no scissor: OpenGL's would hold for what is cleared of other framebuffers too.
        """
        framebuffer: Any = self.framebuffer  # moderngl's own types know no None
        framebuffer.scissor = None if part == WHOLE_IMAGE else pixels_of(part, framebuffer.size)

    @contextmanager
    def colours_kept(self) -> Iterator[None]:
        """Draw and clear the depth alone within the block, in which the framebuffer is bound."""
        self._write_colours(False)
        self.framebuffer.use()
        yield
        self._write_colours(True)

    def _write_colours(self, written: bool) -> None:
        if not self.textures:
            return
        framebuffer: Any = self.framebuffer  # moderngl's own types know a mask for one texture
        mask = (written,) * 4
        framebuffer.color_mask = [mask] * len(self.textures) if len(self.textures) > 1 else mask

    def release(self) -> None:
        """Free the framebuffer and its colour textures; a depth texture may be shared and is its maker's."""
        free(self.framebuffer)
        for texture in self.textures.values():
            texture.release()


def allocate(
    gpu: Gpu,
    size: tuple[int, int],
    formats: Mapping[str, tuple[int, str]],
    depth: moderngl.Texture | None = None,
) -> Target:
    """A target of (width, height) with one texture a name, each (components, dtype f1|f2|f4).

    Raises GpuError where the size is past the driver's limit, GpuMemoryError where memory ends.
    """
    if max(size) > gpu.max_size:
        raise GpuError(f"{size[0]}x{size[1]} is past this driver's limit of {gpu.max_size} pixels a side")
    textures: dict[str, moderngl.Texture] = {}
    try:
        for name, (n, dtype) in formats.items():
            textures[name] = gpu.context.texture(size, n, dtype=dtype)
        framebuffer = gpu.context.framebuffer(list(textures.values()), depth)
    except moderngl.Error as error:
        for texture in textures.values():
            texture.release()
        raise GpuMemoryError(f"no memory for a target of {size[0]}x{size[1]} ({error})") from error
    for texture in textures.values():
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return Target(framebuffer, textures, depth)


def free(framebuffer: moderngl.Framebuffer) -> None:
    """Unbound first: moderngl binds again what was bound once it has made another, which must not be gone by then."""
    framebuffer.ctx.detect_framebuffer(0).use()
    framebuffer.release()


def _as_image(texture: moderngl.Texture, dtype: type, components: int) -> NDArray[Any]:
    width, height = texture.size
    return np.frombuffer(texture.read(alignment=1), dtype).reshape(height, width, components)
