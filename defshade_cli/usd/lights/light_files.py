"""The files of lights: images on rect lights, and IES profiles."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pxr import Ar, Sdf, Usd

from defshade_cli.scene.light import Light, RectLight
from defshade_cli.usd.materials.texture import Unreadable, image_file

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile


def with_files(light: Light, prim: Usd.Prim, time: Usd.TimeCode) -> tuple[Light, tuple[str, ...]]:
    """The light with its image and its profile, and why some are left out."""
    lost = []
    texture = _asset(prim, "texture:file", time)
    if texture and isinstance(light, RectLight):
        try:
            light = replace(light, texture=image_file(_resolved(texture)))
        except Unreadable as problem:
            lost.append(f"the texture {texture.path} is ignored: {problem}")
    profile = _asset(prim, "shaping:ies:file", time)
    if profile and light.shaping:
        try:
            light = replace(light, shaping=replace(light.shaping, ies=_read_profile(_resolved(profile))))
        except Unreadable as problem:
            lost.append(f"the profile {profile.path} is ignored: {problem}")
    return light, tuple(lost)


def _asset(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Sdf.AssetPath | None:
    attribute = prim.GetAttribute(f"inputs:{name}")
    asset = attribute.Get(time) if attribute else None
    return asset if asset and asset.path else None


def _resolved(asset: Sdf.AssetPath) -> str:
    if not asset.resolvedPath:
        raise Unreadable("there is no such file")
    return str(asset.resolvedPath)


def _read_profile(resolved: str) -> IesProfile:
    from defshade_cli.scene.ies import IesError, parse_ies

    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    if not asset:
        raise Unreadable("it cannot be opened")
    try:
        return parse_ies(bytes(asset.GetBuffer()).decode("latin-1"))
    except IesError as problem:
        raise Unreadable(str(problem)) from problem
