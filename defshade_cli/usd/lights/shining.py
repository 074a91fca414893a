"""What lights a frame: lights where they stand, surfaces that glow, and lights of ours where there are none."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from defshade_cli.scene.light import Light
from defshade_cli.scene.scene import Scene
from defshade_cli.usd.drawables import Glowing
from defshade_cli.usd.facing import PlacedSurface
from defshade_cli.usd.instancing.instancing import Piece
from defshade_cli.usd.lights.light import camera_light
from defshade_cli.usd.lights.mesh_light import Glows, glowing_lights
from defshade_cli.usd.palette import Palette
from defshade_cli.usd.surfaces.geometry import Gprim, Surface

log = logging.getLogger("defshade")


def glowing_surfaces(
    drawn: Iterable[PlacedSurface], gprims: Mapping[Surface, Gprim], glows: Glows, palette: Palette
) -> dict[Piece, Glowing]:
    """The surfaces that are lights, and these."""
    found = ((piece, gprims[surface], glows[surface.path]) for piece, surface in drawn if surface.path in glows)
    return {
        piece: (glow, tuple(glowing_lights(piece, gprim, glow, palette.material)))
        for piece, gprim, glow in found
        if gprim.groups and len(piece.root_from_object)
    }


def shining(pieces: Iterable[Piece], glowing: Mapping[Piece, Glowing]) -> Iterator[Light]:
    """All lights in world space: those with shapes of their own, then surfaces that glow."""
    for piece in pieces:
        if isinstance(piece.content, Light):
            yield from _placed(piece, piece.content)
    for _, lights in glowing.values():
        yield from lights


def _placed(piece: Piece, light: Light) -> Iterator[Light]:
    count = len(piece.root_from_object)
    paths = piece.paths if len(piece.paths) == count else piece.paths * count
    for path, world_from_object in zip(paths, piece.root_from_object, strict=True):
        yield replace(light, path=path, world_from_light=world_from_object @ light.world_from_light)


def lit(scene: Scene, *, studio: bool) -> Scene:
    """The scene with lights of ours where it has none: the studio, or one at the camera as usdrecord has it."""
    if scene.lights:
        if studio:
            log.info("the stage has lights of its own: no studio is added")
        return scene
    log.info("no light that is supported: %s", "the studio lights it" if studio else "one shines from the camera")
    if not studio:
        return replace(scene, lights=(camera_light(scene.camera),), lit_by="camera light")
    from defshade_cli.scene.studio import studio_lights

    return replace(scene, lights=studio_lights(scene), lit_by="studio")
