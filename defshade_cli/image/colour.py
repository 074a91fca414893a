"""Scene-linear pixels → a display, by OpenColorIO inside OpenImageIO.

The config is $OCIO's, else OpenImageIO's built-in ACES one. Pixels are linear Rec.709/D65 with premultiplied alpha.
Without a choice the config's default display and its default view hold: with the built-in config sRGB, tone mapped by
ACES 2.0. `Un-tone-mapped` is the plain sRGB curve, and the cheaper one.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.image.false_colour import show_coordinates, show_ids, show_matte
from defshade_cli.image.layers import ID, SCENE_UNITS, UNIT_VECTOR, Layer

RENDER_SPACE = "lin_rec709_scene"
"""Color interop ID of the render space: linear, Rec.709 primaries, D65 white."""

BRIGHTEST = 65504.0
"""Half's largest number: what brighter light is clamped to, in half files and before a display transform."""

Pixels = NDArray[np.float32]


def displays() -> dict[str, tuple[str, ...]]:
    """The config's displays, each with its views."""
    config = _config()
    return {display: tuple(config.getViewNames(display)) for display in config.getDisplayNames()}


def resolve_view(display: str | None, view: str | None) -> tuple[str, str]:
    """(display, view) with the config's defaults filled in. Raises UsageError for one that the config lacks."""
    config, valid = _config(), displays()
    display = display or config.getDefaultDisplayName()
    if display not in valid:
        raise UsageError(f"there is no display '{display}'; the OCIO config has {', '.join(valid)}")
    view = view or config.getDefaultViewName(display)
    if view not in valid[display]:
        raise UsageError(f"display '{display}' has no view '{view}'; it has {', '.join(valid[display])}")
    return display, view


def display_space(display: str | None, view: str | None) -> str:
    """The colour space that `to_display` arrives in, for a file's header."""
    return _config().getDisplayViewColorSpaceName(*resolve_view(display, view))


def to_display(
    pixels: Pixels, *, display: str | None = None, view: str | None = None, straight: bool = False
) -> Pixels:
    """Scene-linear (H, W, 3 or 4), exposure applied → the same shape in [0, 1], encoded for the display.

    The transform sees colours that are not premultiplied by alpha: it is no linear function, so a half covered pixel
    would come out as a darker colour. Afterwards they are premultiplied again unless `straight`. NaN becomes 0.
    Raises UsageError for a display or view that the config lacks.
    """
    display, view = resolve_view(display, view)
    buffer = oiio.ImageBuf(_finite(np.ascontiguousarray(pixels, np.float32)))
    has_alpha = pixels.shape[-1] == 4
    if has_alpha:
        oiio.ImageBufAlgo.unpremult(buffer, buffer)
    oiio.ImageBufAlgo.ociodisplay(buffer, buffer, display, view, RENDER_SPACE, unpremult=False)
    if has_alpha and not straight:
        oiio.ImageBufAlgo.premult(buffer, buffer)
    if buffer.has_error:
        raise UsageError(f"view '{view}' of display '{display}' cannot show {RENDER_SPACE}: {buffer.geterror()}")
    shown = np.asarray(buffer.get_pixels(oiio.FLOAT))
    return np.clip(shown, 0.0, 1.0, out=shown)


def picture(
    layer: Layer, pixels: Pixels, *, alpha: bool, display: str | None = None, view: str | None = None
) -> Pixels:
    """A layer in [0, 1] to look at, (H, W, 1, 3 or 4).

    Colours go through the display transform: with straight alpha where `alpha` keeps it, else composited on black.
    Unit vectors become (v + 1) / 2, and lengths are stretched over what is finite, the least value white. What is
    0..1 stays, texture coordinates repeat, and ids get colours. Only EXR holds the data themselves.
    """
    if layer.is_color:
        shown = pixels if alpha else pixels[..., :3]
        return to_display(shown, display=display, view=view, straight=True)
    if layer.unit == UNIT_VECTOR:
        return np.clip(0.5 * pixels + 0.5, 0.0, 1.0)
    if layer.unit == SCENE_UNITS:
        return _stretched(pixels)
    if layer.unit == ID:
        return show_ids(pixels, layer.background)
    if layer.source == "matte":
        return np.clip(show_matte(pixels), 0.0, 1.0)
    return np.clip(show_coordinates(pixels) if pixels.shape[-1] == 2 else pixels, 0.0, 1.0)


@cache
def _config() -> oiio.ColorConfig:
    config = oiio.ColorConfig()
    if reason := config.geterror():
        raise UsageError(f"the OCIO config cannot be used: {reason}")
    return config


def _finite(pixels: Pixels) -> Pixels:
    """Without NaN and infinity, on which OCIO's SIMD paths spoil the alpha of the pixel too."""
    if abs(pixels.min()) <= BRIGHTEST and abs(pixels.max()) <= BRIGHTEST:
        return pixels
    return np.nan_to_num(pixels, nan=0.0).clip(-BRIGHTEST, BRIGHTEST)


def _stretched(pixels: Pixels) -> Pixels:
    finite = pixels[np.isfinite(pixels)]
    if not finite.size or finite.min() == finite.max():
        return np.isfinite(pixels).astype(np.float32)
    near, far = finite.min(), finite.max()
    return np.nan_to_num((far - pixels) / (far - near), nan=0.0, neginf=0.0)
