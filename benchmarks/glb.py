"""A stage as binary glTF 2.0, for peers that read no USD: meshes, materials, camera and punctual lights.

Area lights become points of their intensity on axis, which is what KHR_lights_punctual has; textures are left out.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.measure.layouts import first_frame
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.light import DistantLight, Light, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene

_FLOAT, _UNSIGNED = 5126, 5125


def write_glb(stage: Path, path: Path) -> None:
    """The first frame of `stage`."""
    writer = _Writer()
    document = _document(first_frame(stage), writer)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = bytes(writer.binary)
    header = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path.write_bytes(header + chunks)


class _Writer:
    """Gathers arrays into one buffer, with views and accessors."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: NDArray, target: int) -> int:
        """The accessor of (N, 3) floats or of (N,) indices."""
        kind, component = ("VEC3", _FLOAT) if values.ndim == 2 else ("SCALAR", _UNSIGNED)
        data = np.ascontiguousarray(values, np.float32 if values.ndim == 2 else np.uint32).tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), "target": target})
        self.binary += data
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(values), "type": kind}
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()} if values.ndim == 2 else {}
        self.accessors.append(accessor | bounds)
        return len(self.accessors) - 1


def _document(scene: Scene, writer: _Writer) -> dict[str, Any]:
    meshes, nodes = [], []
    shared = [_attributes(mesh, writer) for mesh in scene.meshes]
    for drawable in scene.drawables:
        triangles = scene.meshes[drawable.mesh].triangles
        parts = [(part.material, triangles[part.first : part.first + part.count]) for part in drawable.subsets]
        primitives = [
            {"attributes": shared[drawable.mesh], "indices": writer.add(part.ravel(), 34963), "material": material}
            for material, part in parts
        ]
        meshes.append({"primitives": primitives})
        nodes += [{"mesh": len(meshes) - 1, "matrix": m.T.ravel().tolist()} for m in drawable.world_from_object]
    nodes.append({"camera": 0, "matrix": scene.camera.world_from_camera.T.ravel().tolist()})
    lights = [_light(light) for light in scene.lights]
    for number, light in enumerate(scene.lights):
        matrix = light.world_from_light.T.ravel().tolist()
        nodes.append({"matrix": matrix, "extensions": {"KHR_lights_punctual": {"light": number}}})
    return {
        "asset": {"version": "2.0", "generator": "defshade benchmarks"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "cameras": [_camera(scene.camera)],
        "materials": [_material(material) for material in scene.materials],
        "buffers": [{"byteLength": len(writer.binary)}],
        "bufferViews": writer.views,
        "accessors": writer.accessors,
    }


def _attributes(mesh: Mesh, writer: _Writer) -> dict[str, int]:
    return {"POSITION": writer.add(mesh.points, 34962), "NORMAL": writer.add(mesh.normals, 34962)}


def _material(material: Material) -> dict[str, Any]:
    surface = {
        "baseColorFactor": [*material.diffuse_color, 1.0],
        "metallicFactor": float(material.metallic),
        "roughnessFactor": float(material.roughness),
    }
    return {"pbrMetallicRoughness": surface, "doubleSided": True}


def _camera(camera: Camera) -> dict[str, Any]:
    left, right, bottom, top = camera.window
    perspective = {
        "yfov": 2.0 * math.atan((top - bottom) / 2.0),
        "aspectRatio": (right - left) / (top - bottom),
        "znear": 0.1,
        "zfar": 1000.0,
    }
    return {"type": "perspective", "perspective": perspective}


def _light(light: Light) -> dict[str, Any]:
    if isinstance(light, DistantLight):
        return {"type": "directional", **_strength(light.irradiance)}
    assert isinstance(light, SphereLight)
    strength = _strength(light.intensity_on_axis)
    if light.shaping is None or light.shaping.cone_angle >= 90.0:
        return {"type": "point", **strength}
    outer = math.radians(light.shaping.cone_angle)
    inner = outer * (1.0 - light.shaping.cone_softness)
    return {"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}, **strength}


def _strength(rgb: NDArray) -> dict[str, Any]:
    peak = float(max(rgb.max(), 1e-9))
    return {"color": (rgb / peak).tolist(), "intensity": peak}
