"""A scene's textures in texture arrays.

GL without bindless has a few sampler units for any number of textures: images of one size and format are the layers
of one array, a group. Where there are more groups than units, images are resized until there are not.
Each program has a sampler a group and chooses by a switch, since samplers take no index that varies between pixels.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.records import record
from defshade_cli.scene.material import TEXTURED_FIELDS, Material
from defshade_cli.scene.texture import FIRST_UDIM, Texture, TextureInput, Wrap

if TYPE_CHECKING:
    from defshade_cli.image.texture import Source, TexelImage

    Images = Mapping[Source, TexelImage]

_ANISOTROPY = 8.0
_WRAPS: tuple[Wrap, ...] = ("black", "clamp", "repeat", "mirror")  # then UDIM: shaders/lib/texture.glsl
_CHANNELS = ("r", "g", "b", "a", "rgb")
_NO_GROUP = 0xFFFFFFFF

Size = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class TextureSet:
    """arrays: one a group.  tiles: Tile records.  places: (first tile, tiles, wrap s, wrap t) of what could be read."""

    arrays: tuple[moderngl.TextureArray, ...] = ()
    tiles: NDArray[Any] = field(default_factory=lambda: np.zeros(0, record("Tile")))
    places: Mapping[Texture, tuple[int, int, int, int]] = field(default_factory=dict)

    def bind(self, program: moderngl.Program) -> None:
        """Give the program its samplers."""
        for unit, array in enumerate(self.arrays):
            if f"group_{unit}" in program:
                array.use(unit)
                program[f"group_{unit}"] = unit


class TextureStore:
    """Textures for one scene after another; those of the last are kept while the next has the same."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._worth: dict[Texture, float] = {}
        self._set = TextureSet()

    def update(self, textures: tuple[Texture, ...], texels: Mapping[Texture, float]) -> TextureSet:
        """Make the textures resident. texels: a side that they are worth, infinite for those that it does not name.

        Raises GpuError where the device's memory ends.
        """
        worth = {texture: texels.get(texture, math.inf) for texture in textures}
        if worth != self._worth:
            for array in self._set.arrays:
                array.release()
            self._set, self._worth = self._load(worth), worth
        return self._set

    def _load(self, worth: Mapping[Texture, float]) -> TextureSet:
        from defshade_cli.image.texture import Source, load_images

        textures = tuple(worth)
        sides: dict[Source, float] = {}
        for texture, side in worth.items():
            for source in (Source(file, texture.color_space) for _, file in texture.tiles):
                sides[source] = max(side, sides.get(source, 0.0))
        images = load_images(sides)
        groups = group_images(images, self._gpu.context.max_texture_units)
        rows = {}
        for number, group in enumerate(groups):
            for layer, (source, image) in enumerate(group.items()):
                rows[source] = (image.texels.shape[1::-1], number, layer)
        tiles, places = place_tiles(textures, rows, images)
        return TextureSet(tuple(self._upload(list(group.values())) for group in groups), tiles, places)

    def _upload(self, images: Sequence[TexelImage]) -> moderngl.TextureArray:
        height, width, components = images[0].texels.shape
        dtype = "f1" if images[0].texels.dtype == np.uint8 else "f2"
        array = self._gpu.texture_array((width, height, len(images)), components, dtype, srgb=images[0].srgb)
        for layer, image in enumerate(images):
            array.write(np.ascontiguousarray(image.texels), viewport=(0, 0, layer, width, height, 1), alignment=1)
        array.build_mipmaps()
        array.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        array.anisotropy = self._anisotropy()
        if components == 1:
            array.swizzle = "RRR1"
        return array

    def _anisotropy(self) -> float:
        """llvmpipe takes the footprint of one pixel in four, maybe one beside the triangle, and 20 times as long."""
        return 1.0 if self._gpu.is_software else min(_ANISOTROPY, self._gpu.context.max_anisotropy)


def group_images(images: Images, limit: int) -> list[dict[Source, TexelImage]]:
    """Images of one size and format together, in at most `limit` groups: resized as little as that takes."""
    from defshade_cli.image.texture import resized

    for fit in _FITS:
        groups: dict[tuple[Any, ...], dict[Source, TexelImage]] = defaultdict(dict)
        for source, image in images.items():
            size = fit(image.texels.shape[1::-1])
            groups[size, image.texels.shape[2], image.texels.dtype, image.srgb][source] = image
        if len(groups) <= limit:
            break
    return [{source: resized(image, key[0]) for source, image in group.items()} for key, group in groups.items()]


def _rounded_up(base: int, smallest: int) -> Callable[[int], int]:
    return lambda side: max(smallest, base ** int(np.ceil(np.log(side) / np.log(base) - 1e-9)))


def _powers_of_two(size: Size) -> Size:
    up = _rounded_up(2, 1)
    return up(size[0]), up(size[1])


def _squares(size: Size) -> Size:
    side = _rounded_up(4, 64)(max(size))
    return side, side


_FITS: tuple[Callable[[Size], Size], ...] = (lambda size: size, _powers_of_two, _squares, lambda _: (1024, 1024))


def place_tiles(
    textures: Sequence[Texture], rows: Mapping[Source, tuple[Size, int, int]], images: Images
) -> tuple[NDArray[Any], dict[Texture, tuple[int, int, int, int]]]:
    """Tile records (N,), dense by UDIM number, and where each texture that has any tile finds its own."""
    from defshade_cli.image.texture import Source

    records: list[NDArray[Any]] = []
    places, first = {}, 0
    for texture in textures:
        found = {number: Source(file, texture.color_space) for number, file in texture.tiles}
        found = {number - FIRST_UDIM: source for number, source in found.items() if source in rows}
        if not found:
            continue
        tiles = np.zeros(max(found) + 1, record("Tile"))
        tiles["group"] = _NO_GROUP
        for index, source in found.items():
            tiles[index] = rows[source]
        places[texture] = (first, len(tiles), *_wraps(texture, images[next(iter(found.values()))]))
        records.append(tiles)
        first += len(tiles)
    return np.concatenate(records) if records else np.zeros(0, record("Tile")), places


def _wraps(texture: Texture, image: TexelImage) -> tuple[int, int]:
    if texture.udim:
        return len(_WRAPS), len(_WRAPS)
    s, t = texture.wrap_s, texture.wrap_t
    return (
        _WRAPS.index(image.wrap[0] if s == "useMetadata" else s),
        _WRAPS.index(image.wrap[1] if t == "useMetadata" else t),
    )


def input_records(
    materials: Sequence[Material], found: TextureSet, slots: Mapping[str, int]
) -> tuple[NDArray[Any], list[int]]:
    """TextureInput records (N,), material by material, and how many each has.  slots: see gpu.vertices.uv_slots."""
    usable = [
        [(name, i) for name, i in m.inputs.items() if i.texture in found.places and (i.uv in slots or not i.uv)]
        for m in materials
    ]
    records = np.zeros(sum(map(len, usable)), record("TextureInput"))
    row = 0
    for inputs in usable:
        for name, texture_input in inputs:
            _fill(records[row], name, texture_input, slots.get(texture_input.uv, 0), found)
            row += 1
    return records, [len(inputs) for inputs in usable]


def _fill(row: NDArray[Any], name: str, texture_input: TextureInput, uv: int, found: TextureSet) -> None:
    (a, b, x), (c, d, y) = texture_input.texture_from_uv
    row["scale"], row["bias"] = texture_input.scale, texture_input.bias
    row["texture_from_uv"], row["texture_offset"] = (a, c, b, d), (x, y)
    row["uv_set"], row["channel"] = uv, _CHANNELS.index(texture_input.channel)
    row["field"] = TEXTURED_FIELDS.index(name)
    row["first_tile"], row["tile_count"], row["wrap_s"], row["wrap_t"] = found.places[texture_input.texture]


def textures_source(groups: int) -> str:
    """GLSL: a sampler a group, `read_group`, the numbers of the fields, and `set_field` of a Material."""
    samplers = [f"uniform sampler2DArray group_{i};" for i in range(groups)]
    cases = [f"    case {i}u: return textureGrad(group_{i}, at, dx, dy);" for i in range(groups)]
    fields = [f"const uint FIELD_{name.upper()} = {i}u;" for i, name in enumerate(TEXTURED_FIELDS)]
    return "\n".join(
        [
            *samplers,
            *fields,
            "vec4 read_group(uint group, vec3 at, vec2 dx, vec2 dy) {",
            *(["    switch (group) {", *cases, "    }"] if cases else []),
            "    return vec4(0.0);",
            "}",
            "void set_field(inout Material material, uint field, vec4 value) {",
            "    switch (field) {",
            *[f"    case FIELD_{n.upper()}: material.{n} = {_in_range(n)}; break;" for n in TEXTURED_FIELDS[:-1]],
            "    }",
            "}",
        ]
    )


def _in_range(field: str) -> str:
    if field.endswith("_color"):
        return "max(value.rgb, 0.0)"
    return "max(value.r, 0.0)" if field == "ior" else "clamp(value.r, 0.0, 1.0)"
