"""What the user asked for, frozen: a RenderJob is one stage, its frames, its outputs and the RenderSettings."""

from __future__ import annotations

import re
from dataclasses import field, fields
from pathlib import Path
from typing import Literal, Self

from defshade_cli.dataclass import dataclass

Layout = Literal["rgba8", "packed", "float"]
Shading = Literal["preview-surface", "classic"]
Existing = Literal["overwrite", "skip", "error"]
Complexity = Literal["auto", "low", "medium", "high", "veryhigh"]
Lighting = Literal["auto", "volumes", "tiles", "whole"]
Filter = Literal["box", "gaussian", "blackman-harris"]
Payloads = Literal["all", "none"]
OnNan = Literal["error", "warn", "fill"]
Compression = Literal["zip", "zips", "piz", "dwaa", "none"]
Bits = Literal[8, 16]
Debug = Literal["volumes"]

LAYOUTS: tuple[Layout, ...] = ("rgba8", "packed", "float")
SHADINGS: tuple[Shading, ...] = ("preview-surface", "classic")
EXISTING: tuple[Existing, ...] = ("overwrite", "skip", "error")
COMPLEXITIES: tuple[Complexity, ...] = ("auto", "low", "medium", "high", "veryhigh")
LIGHTINGS: tuple[Lighting, ...] = ("auto", "volumes", "tiles", "whole")
PAYLOADS: tuple[Payloads, ...] = ("all", "none")
ON_NAN: tuple[OnNan, ...] = ("error", "warn", "fill")
COMPRESSIONS: tuple[Compression, ...] = ("zip", "zips", "piz", "dwaa", "none")
FILTERS: dict[Filter, float] = {"box": 1.0, "gaussian": 2.0, "blackman-harris": 3.0}
"""Widths in pixels, from end to end, where none is asked: those of Arnold."""
DEBUGS: tuple[Debug, ...] = ("volumes",)
BITS: tuple[Bits, ...] = (8, 16)
MOST_SAMPLES = 4096
"""Of a render that the error or the time ends."""
CHOICES: dict[str, tuple[str, ...]] = {
    "layout": LAYOUTS,
    "shading": SHADINGS,
    "complexity": COMPLEXITIES,
    "lighting": LIGHTINGS,
    "filter": tuple(FILTERS),
}
"""Of RenderSettings, by the names of their fields."""

PURPOSES = ("default", "render", "proxy", "guide")


@dataclass(frozen=True, slots=True)
class VariantChoice:
    """A variant of a set of a prim, written as in Sdf paths: /Prim{set=variant}. An empty one switches the set off."""

    prim: str
    set: str
    variant: str

    @classmethod
    def parse(cls, text: str) -> Self:
        """Raises ValueError for text that does not name a prim, a set and a variant."""
        match = re.fullmatch(r"(/[^{}]*)\{([^{}=]+)=([^{}=]*)\}", text.strip())
        if not match:
            raise ValueError(f"{text!r} does not choose a variant as '/Prim{{set=variant}}' does")
        return cls(*match.groups())

    def __str__(self) -> str:
        return f"{self.prim}{{{self.set}={self.variant}}}"


@dataclass(frozen=True, slots=True)
class Composition:
    """What a stage is composed of, beyond what its file says.

    session_layers: USD files over the stage, the strongest first.
    variants: chosen over them all, in order: a variant may bring the sets that later ones are of.
    mask: paths of the prims to which the stage is limited, see usd/opening/mask.py; empty for no limit.
    payloads: whether the stage's payloads are loaded.
    """

    session_layers: tuple[Path, ...] = ()
    variants: tuple[VariantChoice, ...] = ()
    mask: tuple[str, ...] = ()
    payloads: Payloads = "all"

    @property
    def choices(self) -> dict[str, str]:
        """What is not the default, as text by the names of the fields; layers without their folders."""
        texts = {
            "session_layers": ", ".join(path.name for path in self.session_layers),
            "variants": " ".join(map(str, self.variants)),
            "mask": ", ".join(self.mask),
            "payloads": self.payloads,
        }
        return {f.name: texts[f.name] for f in fields(self) if getattr(self, f.name) != f.default}


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """How a frame is made. Everything here changes pixels; nothing here names a file.

    size: (width, height) in pixels; None follows the stage's RenderSettings, then 1920x1080.
    width: pixels; the height then follows the camera's aspect. At most one of size and width is given.
    crop: (x, y, width, height) of the pixels that are rendered, from the image's top left corner, which they may leave;
        None follows the stage's RenderSettings, then the whole image.
    samples: jittered samples a pixel, or the most of them; 1 is a sample at the pixel's centre. None is 1, or
        MOST_SAMPLES where the error or the time ends the render.
    max_error: relative standard error to render to: passes/convergence.py.
    time_limit: seconds to draw a frame in; the sample that passes them is finished.
    cryptomatte_levels: ids a pixel of a Cryptomatte holds, the greatest coverage first; even.
    light_points: places on a light, in all samples together at least, where it looks large; 1 is its far field.
    filter: the samples of a pixel fall by it.  filter_width: pixels from end to end; None for the filter's own.
    render_space: the scene-linear colour space of the image, by a name that the OCIO config knows; None follows the
        stage's RenderSettings, then linear Rec.709.  ocio: the config, a file or ocio://NAME; empty for $OCIO's.
    layers: names of the table in image/layers; None follows the stage's product, then the beauty alone.
    purposes: of the geometry that is drawn; None follows the stage's RenderSettings, then default and render.
    exposure: stops added to the camera's own.
    shadows: False lights every surface that faces a light.
    complexity: how finely subdivision surfaces are refined: by their size in the image, or 0 to 3 levels all alike.
    fit: a camera of ours sees all of the stage, whatever cameras it has.
    turntable: frames in which one goes around it, from frame 1 on; None for none.
    direction: (azimuth, elevation) in degrees from where these two look; None for scene.framing's.
    studio: a stage without lights gets those of scene/studio.py in place of one at the camera.
    debug: what is drawn over the beauty: the lights' volumes.
    background: dome lights are seen behind the geometry, and cover there.
    motion_blur: several samples see as many moments of the camera's shutter.
    lighting: lights as blended volumes, by tiles of the image or all on the whole of it; auto takes what is predicted
        to be cheapest.
    light_tolerance: scene-linear value that all dropped light together may reach in one pixel.
    """

    size: tuple[int, int] | None = None
    width: int | None = None
    crop: tuple[int, int, int, int] | None = None
    samples: int | None = None
    light_points: int = 16
    max_error: float | None = None
    time_limit: float | None = None
    filter: Filter = "box"
    filter_width: float | None = None
    cryptomatte_levels: int = 6
    layout: Layout = "float"
    shading: Shading = "preview-surface"
    layers: tuple[str, ...] | None = None
    render_space: str | None = None
    ocio: str = ""
    exposure: float = 0.0
    purposes: tuple[str, ...] | None = None
    light_tolerance: float = 1e-5
    lighting: Lighting = "auto"
    shadows: bool = True
    complexity: Complexity = "auto"
    fit: bool = False
    turntable: int | None = None
    direction: tuple[float, float] | None = None
    studio: bool = False
    debug: Debug | None = None
    background: bool = True
    motion_blur: bool = True

    @property
    def most_samples(self) -> int:
        """`samples`, or what stands for it."""
        open_ended = self.max_error is not None or self.time_limit is not None
        return self.samples or (MOST_SAMPLES if open_ended else 1)


@dataclass(frozen=True, slots=True)
class NamedLayer:
    """A layer as a file shall have it: under another name, and with its first `width` channels."""

    layer: str
    name: str
    width: int


@dataclass(frozen=True, slots=True)
class OutputSettings:
    """How a film becomes files.

    patterns: file names with frame and name tokens; the suffix picks the format. One file per pattern and frame.
    fallback: the pattern where there are none and the stage's products have no names either; empty writes no file.
    variables: what the stage's product has in a file, and under which names; empty has the layers as they are.
    display, view, look: of the OCIO config, for display-referred formats; None takes the config's default, and no look.
    full_float: 32-bit channels in EXR in place of half (data layers are always 32-bit).
    sheet: pictures hold all layers, as labelled tiles.
    multipart: a part of the EXR for each layer.  tiled: EXR in tiles; mipmaps: in tiles with all smaller levels.
    bits: a channel of a picture; None takes the format's default.  dither: 8-bit colours, against banding.
    verify: read each file back and compare, before it takes its name.
    on_nan: what becomes of a frame in which values are no numbers: an error once it is written, a warning, or the
        values of the nearest sound pixels.
    """

    patterns: tuple[str, ...] = ()
    fallback: str = ""
    variables: tuple[NamedLayer, ...] = ()
    existing: Existing = "overwrite"
    display: str | None = None
    view: str | None = None
    look: str | None = None
    full_float: bool = False
    compression: Compression = "zip"
    split_layers: bool = False
    sheet: bool = False
    multipart: bool = False
    tiled: bool = False
    mipmaps: bool = False
    bits: Bits | None = None
    dither: bool = False
    verify: bool = False
    on_nan: OnNan = "error"


@dataclass(frozen=True, slots=True)
class RenderJob:
    """One stage rendered over frames.

    frames: USD time codes, None standing for the default time; empty means the stage's first frame, or the frames of
        the turntable, which are 1 and on.
    camera: prim path or name; None picks by the rule in usd/camera.py.
    render_settings: path of a RenderSettings or RenderPass prim; None finds one by usd/render_settings/products.py.
    product: path or name of a product of theirs; None makes all that the output's names can hold.
    given: names of the RenderSettings that the user chose; the stage may say the others.
    device: EGL device index, None for the driver's default.
    """

    stage: Path
    frames: tuple[float | None, ...] = ()
    camera: str | None = None
    render_settings: str | None = None
    product: str | None = None
    composition: Composition = field(default_factory=Composition)
    settings: RenderSettings = field(default_factory=RenderSettings)
    output: OutputSettings = field(default_factory=OutputSettings)
    device: int | None = None
    given: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if self.settings.turntable and not self.frames:
            object.__setattr__(self, "frames", tuple(float(frame + 1) for frame in range(self.settings.turntable)))
