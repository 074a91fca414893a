"""OpenColorIO configs: their displays and spaces.

A config is named by its file, or as `ocio://default` by what OpenColorIO has built in, which is the ACES one. No name
stands for $OCIO's, else for that. OpenImageIO takes four times as long to open one: only what converts by it does.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.image.kept import Arrays, kept
from defshade_cli.image.render_space import LINEAR_REC709, Matrix3, RenderSpace

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

_DEFAULT, _BUILT_IN = "ocio://default", "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
"""What OpenImageIO takes for the default: its OpenColorIO may be older than the one beside it."""

_IN_LIBRARY = "ocio://"
_NAMED_AS_DISPLAY = "<USE_DISPLAY_NAME>"


@dataclass(frozen=True, slots=True)
class Displays:
    """What a config shows pictures on.

    views: of each display, and the colour space that pixels have which it shows.  default_views: by display.
    """

    default: str
    views: Mapping[str, Mapping[str, str]]
    default_views: Mapping[str, str]
    looks: tuple[str, ...]


@cache
def read_config(name: str = "") -> ocio.Config:
    """What a config says. Raises UsageError for one that cannot be read."""
    import PyOpenColorIO as ocio

    try:
        return ocio.Config.CreateFromFile(_chosen(name))
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise UsageError(f"the OCIO config cannot be used: {error}") from error


@cache
def read_displays(name: str = "") -> Displays:
    """Raises UsageError for a config that cannot be read."""
    told = kept_answer(name, "displays", lambda: {"json": np.array(json.dumps(asdict(_displays(read_config(name)))))})
    said = json.loads(str(told["json"]))
    return Displays(**said | {"looks": tuple(said["looks"])})


def _displays(config: ocio.Config) -> Displays:
    views = {
        display: {view: _encoding(config, display, view) for view in config.getViews(display)}
        for display in config.getDisplays()
    }
    defaults = {display: config.getDefaultView(display) for display in views}
    return Displays(config.getDefaultDisplay(), views, defaults, tuple(config.getLookNames()))


def _encoding(config: ocio.Config, display: str, view: str) -> str:
    space = str(config.getDisplayViewColorSpaceName(display, view))
    return display if space == _NAMED_AS_DISPLAY else space


def kept_answer(name: str, question: str, answer: Callable[[], Arrays]) -> Arrays:
    """What OpenColorIO answers about a config. What is built in stays the same, so such answers are kept on disk.

    To load the library and a config takes longer than to draw a small picture.
    """
    chosen = _chosen(name)
    return (
        kept("ocio", f"{_library()} {chosen} {question}".encode(), answer)
        if chosen.startswith(_IN_LIBRARY)
        else answer()
    )


@cache
def _library() -> str:
    """Which OpenColorIO there is, without loading it: the files of its package."""
    spec = find_spec("PyOpenColorIO")
    assert spec and spec.submodule_search_locations
    with os.scandir(spec.submodule_search_locations[0]) as entries:
        files = [(entry.path, entry.stat().st_size, entry.stat().st_mtime_ns) for entry in entries if entry.is_file()]
    return repr(sorted(files))


def _chosen(name: str) -> str:
    chosen = name or os.environ.get("OCIO") or _DEFAULT
    return _BUILT_IN if chosen == _DEFAULT else chosen


@cache
def open_config(name: str = "") -> oiio.ColorConfig:
    """The same for OpenImageIO. Raises UsageError for a config that cannot be read."""
    config = oiio.ColorConfig(name) if name else oiio.ColorConfig()
    if reason := config.geterror():
        raise UsageError(f"the OCIO config cannot be used: {reason}")
    return config


def linear_spaces(name: str = "") -> tuple[str, ...]:
    """The config's scene-linear colour spaces."""
    config = open_config(name)
    scene = (space for space in config.getColorSpaceNames() if not space.endswith("Display-referred"))
    return tuple(space for space in scene if config.isColorSpaceLinear(space))


def find_render_space(name: str | None, config: str = "") -> RenderSpace:
    """The scene-linear space that a config knows by `name`, an alias or a role; None for linear Rec.709.

    Raises UsageError for a space that the config lacks, or one that is not linear.
    """
    if name is None:
        return RenderSpace(config=config)
    known = open_config(config)
    space = known.resolve(name)
    if space not in linear_spaces(config):
        raise UsageError(f"no scene-linear space '{name}'; the OCIO config has {', '.join(linear_spaces(config))}")
    chromaticities = known.get_chromaticities(space)
    return RenderSpace(
        name=space,
        interop_id=known.get_color_interop_id(space) or space,
        chromaticities=tuple(chromaticities) if chromaticities else None,
        from_rec709=_matrix(space, config),
        config=config,
    )


def _matrix(space: str, config: str) -> Matrix3:
    """What the config makes of the three primaries of Rec.709, as columns."""
    primaries = oiio.ImageBuf(np.eye(3, dtype=np.float32)[None])
    moved = oiio.ImageBufAlgo.colorconvert(primaries, LINEAR_REC709, space, unpremult=False, colorconfig=config)
    if moved.has_error:
        raise UsageError(f"the OCIO config cannot take {LINEAR_REC709} to '{space}': {moved.geterror()}")
    columns: NDArray[Any] = np.asarray(moved.get_pixels(oiio.FLOAT))[0]
    rounded = np.where(np.isclose(columns, np.eye(3), atol=1e-6), np.eye(3), columns)
    return tuple(tuple(float(value) for value in row) for row in rounded.T)
