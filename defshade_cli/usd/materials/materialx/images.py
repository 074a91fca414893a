"""The nodes that read image files."""

from __future__ import annotations

from typing import NamedTuple

from pxr import Sdf, Usd, UsdShade

from defshade_cli.scene.texture import STATED_SPACES, ColorSpace, Texture, Wrap
from defshade_cli.usd.color_space import is_known, texture_space_of
from defshade_cli.usd.materials.materialx.coordinates import Coordinates, gltf_placed, read_coordinates, tiled
from defshade_cli.usd.materials.materialx.graph import Graph
from defshade_cli.usd.materials.materialx.signal import Lookup, Signal, constant, texel
from defshade_cli.usd.materials.network import computed
from defshade_cli.usd.materials.texture import Unreadable, image_tiles

_WRAPS: dict[str, Wrap] = {
    "constant": "black",
    "black": "black",
    "clamp": "clamp",
    "periodic": "repeat",
    "repeat": "repeat",
    "mirror": "mirror",
}
"""uaddressmode's names, and those of UsdUVTexture."""

_CHANNELS = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgb": (0, 1, 2), "rgba": (0, 1, 2, 3)}


class _Names(NamedTuple):
    """Of the inputs that say what stands in for the image, and what lies outside it."""

    default: str
    u: str
    v: str


_IMAGE = _Names("default", "uaddressmode", "vaddressmode")
_UV_TEXTURE = _Names("fallback", "wrapS", "wrapT")


def image(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """MaterialX's `image` and its kin."""
    return _read(graph, node, read_coordinates(graph, node), width)


def tiled_image(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """MaterialX's `tiledimage`."""
    return _read(graph, node, tiled(graph, node), width)


def gltf_image(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """MaterialX's `gltf_image` and `gltf_colorimage`: an image times its factor."""
    return _read(graph, node, gltf_placed(graph, node), width) * graph.signal(node, "factor", 1.0)


def gltf_color_image(graph: Graph, node: UsdShade.Shader, output: str, width: int) -> Signal:
    """`outcolor` and `outa`, each times the node's two colours."""
    tint = graph.signal(node, "color", (1, 1, 1, 1)) * graph.signal(node, "geomcolor", (1, 1, 1, 1))
    found = _read(graph, node, gltf_placed(graph, node), 4) * tint
    return found.pick(_CHANNELS["a"]) if output == "outa" else found.pick(range(width))


def gltf_normal_map(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """MaterialX's `gltf_normalmap`: [0, 1] → [-1, 1]."""
    found = _read(graph, node, gltf_placed(graph, node), width, default=(0.5, 0.5, 1.0))
    return found * constant(2.0) - constant(1.0)


def uv_texture(graph: Graph, node: UsdShade.Shader, output: str, width: int) -> Signal:
    """UsdUVTexture, whose scale and bias follow the texel."""
    found = _read(graph, node, read_coordinates(graph, node, "st"), 4, _UV_TEXTURE, (0, 0, 0, 1))
    if not found.is_constant:
        found = found * graph.signal(node, "scale", 1.0).widened(4) + graph.signal(node, "bias", 0.0).widened(4)
    return found.pick(_CHANNELS.get(output, range(width)))


def _read(
    graph: Graph,
    node: UsdShade.Shader,
    coordinates: Coordinates,
    width: int,
    names: _Names = _IMAGE,
    default: object = 0.0,
) -> Signal:
    """Texels, or the node's default for a file that is missing, which is then lost."""
    attribute = graph.network.source(node, "file")
    asset = graph.network.of(attribute) if attribute and not computed(attribute) else None
    try:
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            raise Unreadable("image without file")
        tiles = image_tiles(asset, attribute)
    except Unreadable as reason:
        graph.lost.append(str(reason))
        return graph.signal(node, names.default, default).widened(width)
    texture = Texture(
        tiles,
        udim=UsdShade.UdimUtils.IsUdimIdentifier(asset.path),
        color_space=_stated(graph, node) or _space(graph, attribute),
        wrap_s=_wrap(graph, node, names.u),
        wrap_t=_wrap(graph, node, names.v),
    )
    return texel(Lookup(texture, coordinates.uv, coordinates.affine), width)


def _stated(graph: Graph, node: UsdShade.Shader) -> ColorSpace:
    """As UsdUVTexture says it outside MaterialX, of which exporters leave it on the node; empty for nothing."""
    said = graph.text(node, "sourceColorSpace", "")
    return said if said in STATED_SPACES else ""


def _space(graph: Graph, file: Usd.Attribute) -> ColorSpace:
    """As the file's attribute says; MaterialX takes texels for linear where nothing does."""
    graph.network.note_space(file)
    name = str(file.GetColorSpace()) if file.HasColorSpace() else ""
    return texture_space_of(name) if name and is_known(name) else "raw"


def _wrap(graph: Graph, node: UsdShade.Shader, name: str) -> Wrap:
    return _WRAPS.get(graph.text(node, name, "periodic"), "repeat")
