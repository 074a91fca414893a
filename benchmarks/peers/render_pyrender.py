"""pyrender: the GLB of a stage, rasterised. It leaves out shadows here, area lights and USD, and takes 4 lights a kind.

Without a display it needs PYOPENGL_PLATFORM=egl.
"""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyrender
import trimesh
from PIL import Image

_MOST = 4


def main(stage: str, image: str, width: int, height: int) -> None:
    scene = pyrender.Scene.from_trimesh_scene(trimesh.load(stage), ambient_light=np.zeros(3))
    document = _document(Path(stage))
    lens = document["cameras"][0]["perspective"]
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    placed = dict.fromkeys(("directional", "point", "spot"), 0)
    for node in document["nodes"]:
        pose = np.reshape(node.get("matrix", np.eye(4).ravel()), (4, 4)).T
        if "camera" in node:
            scene.add(pyrender.PerspectiveCamera(lens["yfov"], znear=lens["znear"], zfar=lens["zfar"]), pose=pose)
        if "extensions" in node:
            light = lights[node["extensions"]["KHR_lights_punctual"]["light"]]
            placed[light["type"]] += 1
            if placed[light["type"]] <= _MOST:
                scene.add(_light(light), pose=pose)
    renderer = pyrender.OffscreenRenderer(width, height)
    pixels, _depth = renderer.render(scene)
    Image.fromarray(pixels).save(image)


def _light(light: dict[str, Any]) -> Any:
    kinds = {"directional": pyrender.DirectionalLight, "point": pyrender.PointLight, "spot": pyrender.SpotLight}
    return kinds[light["type"]](color=light["color"], intensity=light["intensity"])


def _document(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
