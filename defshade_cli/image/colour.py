"""Scene-linear pixels → a display, by OpenColorIO inside OpenImageIO.

Pixels are in the render space with premultiplied alpha. Without a choice the config's default display and its default
view hold: with the built-in config sRGB, tone mapped by ACES 2.0. `Un-tone-mapped` is the plain sRGB curve, and the
cheaper one.
"""

from __future__ import annotations

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.image.layers import ID, SCENE_UNITS, UNIT_VECTOR, Layer
from defshade_cli.image.ocio import read_displays
from defshade_cli.image.render_space import REC709, RenderSpace

BRIGHTEST = 65504.0
"""Half's largest number: what brighter light is clamped to, in half files and before a display transform."""

Pixels = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class DisplayTransform:
    """A view of a display, and perhaps a look before it. space: what the pixels are in; its config knows the others."""

    display: str
    view: str
    look: str
    space: RenderSpace

    @property
    def encoding(self) -> str:
        """The colour space that pixels arrive in, for a file's header."""
        return read_displays(self.space.config).views[self.display][self.view]

    def apply(self, pixels: Pixels, *, straight: bool = False) -> Pixels:
        """Scene-linear (H, W, 3 or 4), exposure applied → the same shape in [0, 1], encoded for the display.

        The transform sees colours that are not premultiplied by alpha: it is no linear function, so a half covered
        pixel would come out as a darker colour. Afterwards they are premultiplied again unless `straight`. NaN
        becomes 0. Raises UsageError for a space that the config cannot show.
        """
        buffer = oiio.ImageBuf(finite(np.ascontiguousarray(pixels, np.float32)))
        has_alpha = pixels.shape[-1] == 4
        if has_alpha:
            oiio.ImageBufAlgo.unpremult(buffer, buffer)
        self._show(buffer)
        if has_alpha and not straight:
            oiio.ImageBufAlgo.premult(buffer, buffer)
        if buffer.has_error:
            raise UsageError(
                f"view '{self.view}' of display '{self.display}' cannot show {self.space.name}: {buffer.geterror()}"
            )
        shown = np.asarray(buffer.get_pixels(oiio.FLOAT))
        return np.clip(shown, 0.0, 1.0, out=shown)

    def _show(self, buffer: oiio.ImageBuf) -> None:
        oiio.ImageBufAlgo.ociodisplay(
            buffer,
            buffer,
            self.display,
            self.view,
            self.space.name,
            self.look,
            unpremult=False,
            colorconfig=self.space.config,
        )


def display_transform(
    display: str | None = None, view: str | None = None, look: str | None = None, space: RenderSpace = REC709
) -> DisplayTransform:
    """The config's defaults where nothing is chosen. Raises UsageError for a choice that the config lacks."""
    config = read_displays(space.config)
    display = display or config.default
    if display not in config.views:
        raise UsageError(f"there is no display '{display}'; the OCIO config has {', '.join(config.views)}")
    view, views = view or config.default_views[display], config.views[display]
    if view not in views:
        raise UsageError(f"display '{display}' has no view '{view}'; it has {', '.join(views)}")
    if look and look not in config.looks:
        raise UsageError(f"there is no look '{look}'; the OCIO config has {', '.join(config.looks) or 'none'}")
    return DisplayTransform(display, view, look or "", space)


def picture(layer: Layer, pixels: Pixels, transform: DisplayTransform, *, alpha: bool) -> Pixels:
    """A layer in [0, 1] to look at, (H, W, 1, 3 or 4).

    Colours go through the display transform: with straight alpha where `alpha` keeps it, else composited on black.
    Unit vectors become (v + 1) / 2, and lengths are stretched over what is finite, the least value white. What is
    0..1 stays, texture coordinates repeat, and ids and
    motion get colours. Only EXR holds the data themselves.
    """
    if layer.is_color:
        return transform.apply(pixels if alpha else pixels[..., :3], straight=True)
    return _data_picture(layer, pixels)


def _data_picture(layer: Layer, pixels: Pixels) -> Pixels:
    from defshade_cli.image.false_colour import show_coordinates, show_ids, show_matte, show_vectors

    if layer.unit == UNIT_VECTOR:
        return np.clip(0.5 * pixels + 0.5, 0.0, 1.0)
    if layer.unit == SCENE_UNITS:
        return _stretched(pixels)
    if layer.unit == ID:
        return show_ids(pixels, layer.background)
    if layer.source == "matte":
        return np.clip(show_matte(pixels), 0.0, 1.0)
    if layer.source == "motion":
        return show_vectors(pixels)
    return np.clip(show_coordinates(pixels) if pixels.shape[-1] == 2 else pixels, 0.0, 1.0)


def finite(pixels: Pixels) -> Pixels:
    """Pixels (H, W, C) without NaN and infinity, on which OCIO's SIMD paths spoil the alpha of the pixel too."""
    if abs(pixels.min()) <= BRIGHTEST and abs(pixels.max()) <= BRIGHTEST:
        return pixels
    return np.nan_to_num(pixels, nan=0.0).clip(-BRIGHTEST, BRIGHTEST)


def _stretched(pixels: Pixels) -> Pixels:
    finite = pixels[np.isfinite(pixels)]
    if not finite.size or finite.min() == finite.max():
        return np.isfinite(pixels).astype(np.float32)
    near, far = finite.min(), finite.max()
    return np.nan_to_num((far - pixels) / (far - near), nan=0.0, neginf=0.0)
