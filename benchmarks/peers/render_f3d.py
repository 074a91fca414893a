"""F3D: the GLB of a stage, rasterised. It leaves out shadows, the falloff of lights and, in its wheel, USD."""

from __future__ import annotations

import sys

import f3d


def main(stage: str, image: str, width: int, height: int) -> None:
    f3d.Engine.autoload_plugins()
    engine = f3d.Engine.create(True)
    engine.window.size = width, height
    engine.options.update({"scene.camera.index": 0, "render.grid.enable": False})
    engine.scene.add(stage)
    engine.window.render_to_image().save(image)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
