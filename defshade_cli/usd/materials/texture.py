"""UsdUVTexture, and the nodes that give its texture coordinates, as scene.TextureInput."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, cast, get_args

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from defshade_cli.scene.texture import (
    FIRST_UDIM,
    IDENTITY,
    Affine,
    Channel,
    ColorSpace,
    Four,
    ImageFile,
    Texture,
    TextureInput,
    Wrap,
)
from defshade_cli.usd.color_space import is_known, texture_space, texture_space_of
from defshade_cli.usd.materials.network import Network, computed, node_of
from defshade_cli.usd.values import is_finite, resembles

_READERS = ("UsdPrimvarReader_float2", "UsdPrimvarReader_float3", "UsdPrimvarReader_float4")
_MOST_TRANSFORMS = 64
"""One after another; a network of more is taken for one that runs in a circle."""


class _Coordinates(NamedTuple):
    """As in TextureInput."""

    uv: str
    texture_from_uv: Affine
    fallback: tuple[float, float] = (0.0, 0.0)


class Unreadable(Exception):
    """A network, or a file, that no texture can be made of; its text says why in a few words."""


def read_texture_input(network: Network, output: Usd.Attribute) -> TextureInput:
    """What the output of a UsdUVTexture gives. Raises Unreadable."""
    node, _ = node_of(output)
    attribute = network.source(node, "file")
    asset = network.of(attribute) if attribute and not computed(attribute) else None
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        raise Unreadable("texture without file")
    coordinates = _coordinates(network, network.source(node, "st"))
    texture = Texture(
        tiles=image_tiles(asset, attribute),
        udim=UsdShade.UdimUtils.IsUdimIdentifier(asset.path),
        color_space=_space(network, node, attribute),
        wrap_s=_one_of(network.value(node, "wrapS"), get_args(Wrap), "useMetadata"),
        wrap_t=_one_of(network.value(node, "wrapT"), get_args(Wrap), "useMetadata"),
    )
    channel = cast(Channel, _one_of(output.GetName().rpartition(":")[2], get_args(Channel), "rgb"))
    return TextureInput(
        texture,
        channel,
        scale=_of_channel(channel, network.value(node, "scale", (1, 1, 1, 1))),
        bias=_of_channel(channel, network.value(node, "bias", (0, 0, 0, 0))),
        uv=coordinates.uv,
        texture_from_uv=coordinates.texture_from_uv,
        fallback=coordinates.fallback,
    )


def _space(network: Network, node: UsdShade.Shader, file: Usd.Attribute) -> ColorSpace:
    """As the node says; where it leaves it open, as the file's attribute does."""
    said = str(network.value(node, "sourceColorSpace") or "auto")
    if said != "auto" and is_known(said):
        return texture_space_of(said)
    if said != "auto":
        network.unknown_spaces[said] = None
    network.note_space(file)
    return texture_space(file)


def _of_channel(channel: Channel, value: Any) -> Four:
    """What the schema gives by texel channel, for the channels that come out."""
    four = _floats(value, 4)
    return four if channel == "rgb" else (four["rgba".index(channel)],) * 4


def _coordinates(network: Network, source: Usd.Attribute | None, left: int = _MOST_TRANSFORMS) -> _Coordinates:
    """What feeds `st`, transforms multiplied together; no primvar for a constant."""
    if source is None or not computed(source):
        u, v = _floats((source and network.of(source)) or (0, 0), 2)
        return _Coordinates("", ((0.0, 0.0, u), (0.0, 0.0, v)))
    node, identifier = node_of(source)
    if identifier in _READERS:
        return _Coordinates(str(network.value(node, "varname", "")), IDENTITY, _fallback(network, node))
    if identifier != "UsdTransform2d":
        raise Unreadable(f"texture coordinates of {identifier}")
    if not left:
        raise Unreadable("texture coordinates that run in a circle")
    below = _coordinates(network, network.source(node, "in"), left - 1)
    return below._replace(texture_from_uv=_product(_transform(network, node), below.texture_from_uv))


def _fallback(network: Network, node: UsdShade.Shader) -> tuple[float, float]:
    """Of a reader; the schema's own in the place of what is not finite, or no coordinates at all."""
    found = np.ravel(network.value(node, "fallback", (0.0, 0.0)))[:2]
    if not resembles(found, (0.0, 0.0)) or not is_finite(found):
        return 0.0, 0.0
    u, v = found.tolist()
    return u, v


def _transform(network: Network, node: UsdShade.Shader) -> Affine:
    """in · scale · rotate + translation, as the node's schema says."""
    angle = math.radians(float(network.value(node, "rotation", 0.0)))
    sx, sy = _floats(network.value(node, "scale", (1, 1)), 2)
    tx, ty = _floats(network.value(node, "translation", (0, 0)), 2)
    cosine, sine = math.cos(angle), math.sin(angle)
    return ((cosine * sx, -sine * sy, tx), (sine * sx, cosine * sy, ty))


def _product(outer: Affine, inner: Affine) -> Affine:
    a, b = (np.vstack([rows, (0.0, 0.0, 1.0)]) for rows in (outer, inner))
    first, second = (a @ b)[:2].tolist()
    return tuple(first), tuple(second)


def image_tiles(asset: Sdf.AssetPath, attribute: Usd.Attribute) -> tuple[tuple[int, ImageFile], ...]:
    """Files of the asset as Ar resolves it; back slashes, which exporters on Windows leave, count as slashes.

    Raises Unreadable where there is none.
    """
    layer = _layer_of_value(attribute)
    path = asset.path.replace("\\", "/")
    if UsdShade.UdimUtils.IsUdimIdentifier(path):
        found = UsdShade.UdimUtils.ResolveUdimTilePaths(path, layer)
        tiles = tuple((int(number), image_file(file)) for file, number in found)
    else:
        resolved = asset.resolvedPath or _resolved(layer, path)
        tiles = ((FIRST_UDIM, image_file(resolved)),) if resolved else ()
    if not tiles:
        raise Unreadable(f"no file {asset.path}")
    return tiles


def _layer_of_value(attribute: Usd.Attribute) -> Sdf.Layer:
    """What relative paths start from: a stronger layer may say another thing of the attribute."""
    specs = attribute.GetPropertyStack()
    valued = (spec for spec in specs if spec.HasInfo("default") or spec.HasInfo("timeSamples"))
    return next(valued, specs[0]).layer


def _resolved(layer: Sdf.Layer, path: str) -> str:
    return str(Ar.GetResolver().Resolve(Sdf.ComputeAssetPathRelativeToLayer(layer, path)))


def image_file(resolved: str) -> ImageFile:
    """The file that Ar resolved. Raises Unreadable for one that is missing in its package."""
    if not Ar.IsPackageRelativePath(resolved):
        return ImageFile(resolved)
    inside = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    if not inside:
        raise Unreadable(f"no file {resolved}")
    return ImageFile(resolved, inside.GetBuffer())


def _one_of(value: Any, allowed: tuple[str, ...], default: str) -> Any:
    return str(value) if value in allowed else default


def _floats(value: Any, count: int) -> Any:
    """`count` floats; a single one fills them."""
    return tuple(np.broadcast_to(np.asarray(value, np.float64), count).tolist())
