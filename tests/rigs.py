"""In-memory stages with a skeleton: a root joint and one that bends, a unit above it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.scene import Scene

IDENTITY = "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))"
LIFTED = "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 1, 0, 1))"

SKELETON = f"""def Skeleton "skeleton" (prepend apiSchemas = ["SkelBindingAPI"]) {{
    uniform token[] joints = ["root", "root/bend"]
    uniform matrix4d[] bindTransforms = [{IDENTITY}, {LIFTED}]
    uniform matrix4d[] restTransforms = [{IDENTITY}, {LIFTED}]
    SOURCE
}}
"""


def quaternion(axis: Sequence[float], degrees: float) -> str:
    half = math.radians(degrees) / 2
    return str((math.cos(half), *(math.sin(half) * np.array(axis, float)).tolist()))


def animation(name: str, *samples: tuple[float, float], extra: str = "") -> str:
    """Rotations of the bending joint about z, in degrees at time codes; one at the default time where it is alone."""
    rotations = [f"{time}: [{quaternion((0, 0, 1), angle)}]" for time, angle in samples]
    value = f".timeSamples = {{ {', '.join(rotations)} }}" if len(samples) > 1 else f" = {rotations[0].split(':')[1]}"
    return f"""def SkelAnimation "{name}" {{
        uniform token[] joints = ["root/bend"]
        float3[] translations = [(0, 1, 0)]
        quatf[] rotations{value}
        half3[] scales = [(1, 1, 1)]
        {extra}
    }}
    """


def triangle(name: str = "mesh", joint: int = 1, interpolation: str = "constant", extra: str = "") -> str:
    """A triangle that one joint moves, at (0, 2, 0), (1, 2, 0) and (0, 3, 0) in the bind pose."""
    count = 1 if interpolation == "constant" else 3
    return f"""def Mesh "{name}" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        rel skel:skeleton = <../skeleton>
        point3f[] points = [(0, 2, 0), (1, 2, 0), (0, 3, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        uniform token subdivisionScheme = "none"
        int[] primvars:skel:jointIndices = {[joint] * count} (
            elementSize = 1
            interpolation = "{interpolation}"
        )
        float[] primvars:skel:jointWeights = {[1] * count} (
            elementSize = 1
            interpolation = "{interpolation}"
        )
        {extra}
    }}
    """


def shape(name: str, offsets: str, extra: str = "") -> str:
    return f'def BlendShape "{name}" {{\nuniform vector3f[] offsets = {offsets}\n{extra}\n}}\n'


def moulded(weights: str, *shapes: str, names: tuple[str, ...] = ("up",)) -> str:
    """A triangle without joints whose blend shapes have weights."""
    targets = ", ".join(f"<{name}>" for name in names)
    order = ", ".join(f'"{name}"' for name in names)
    bound = f"uniform token[] skel:blendShapes = [{order}]\nrel skel:blendShapeTargets = [{targets}]\n" + "".join(
        shapes
    )
    mesh = triangle(extra=bound)
    mesh = mesh[: mesh.index("int[] primvars")] + mesh[mesh.index("uniform token[] skel:blendShapes") :]
    source = f"uniform token[] blendShapes = [{order}]\nfloat[] blendShapeWeights = {weights}"
    return rig(animation("anim", (0, 0), extra=source) + mesh, "anim")


def rig(body: str, source: str = "", kind: str = "SkelRoot", name: str = "rig") -> str:
    """A SkelRoot with the skeleton, which `source` animates, and `body`."""
    bound = f"rel skel:animationSource = <../{source}>" if source else ""
    return f'def {kind} "{name}" {{\n{SKELETON.replace("SOURCE", bound)}{body}\n}}\n'


def world_points(scene: Scene) -> dict[str, NDArray[np.float64]]:
    """(P, 3) points in world space of each instance, by path."""
    found = {}
    for drawable in scene.drawables:
        points = scene.meshes[drawable.mesh].points.astype(np.float64)
        for path, matrix in zip(drawable.paths, drawable.world_from_object, strict=True):
            found[path] = points @ matrix[:3, :3].T + matrix[:3, 3]
    return found
