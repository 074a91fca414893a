"""Blender's Cycles or EEVEE: the USD stage itself, SAMPLES a pixel, no denoising, one bounce, their own lighting."""

from __future__ import annotations

import sys

import bpy

ENGINES = {"cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}


def main(stage: str, image: str, width: int, height: int, samples: int, engine: str = "cycles", seed: int = 0) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=stage)
    scene = bpy.context.scene
    scene.camera = next(each for each in scene.objects if each.type == "CAMERA")
    scene.world = scene.world or bpy.data.worlds.new("World")
    scene.render.engine = ENGINES[engine]
    scene.eevee.taa_render_samples = scene.cycles.samples = samples
    scene.cycles.device = "CPU"
    scene.cycles.seed = seed
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = image
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:6]), *sys.argv[6:7], *map(int, sys.argv[7:8]))
