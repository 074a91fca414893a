"""The corners: where numbers are least, greatest, equal, reversed, or no numbers at all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import radians, tan

import numpy as np

from defshade_cli.measure.stress.corner import EXACT, SEEN, Corner
from defshade_cli.measure.stress.pairs import pairs
from defshade_cli.measure.stress.stage import StressStage, transformed
from defshade_cli.settings import RenderSettings

_GRAZING = "positions are float32 relative to the eye: 6 units off they are known to 4e-7, and n·l is 1e-6 and less"
_DISTANT = "positions are float32 relative to the eye: 2,000 units off they are known to 1e-4, 20,000 units off to 1e-3"


def all_corners(lights: int = 1000) -> list[Corner]:
    """The corners of all families, and their pairs. lights: that overlap in one of them."""
    alone = [corner for family in _FAMILIES for corner in family()]
    return [
        *alone,
        *pairs(alone),
        Corner("crowd", f"{lights:,} overlapping lights", StressStage(lights=_swarm(lights))),
    ]


def _surfaces() -> Iterator[Corner]:
    for roughness in (0.0, 1e-6, 1e-4, 1e-3, 0.01, 0.02, 0.05, 0.1, 0.5, 1.0):
        for metallic in (0, 1):
            values = f"float inputs:roughness = {roughness!r}\nfloat inputs:metallic = {metallic}"
            yield Corner("surface", f"roughness {roughness:g}, metallic {metallic}", StressStage(surface=values))
    for ior in (-1.0, 0.0, 1e-6, 1.0, 1e3, 1e30, float("inf"), float("nan")):
        yield Corner("surface", f"ior {ior:g}", StressStage(surface=f"float inputs:ior = {_text(ior)}"))
    for color in ("-1, 0.5, 2", "1e20, 0, 0", "nan, 0.5, 0.5", "inf, 0.5, 0.5"):
        yield Corner("surface", f"diffuse {color}", StressStage(surface=f"color3f inputs:diffuseColor = ({color})"))
    for name in ("roughness", "metallic", "clearcoat", "clearcoatRoughness", "opacity"):
        for value in (-1.0, 2.0, float("nan"), float("inf")):
            text = f"float inputs:{name} = {_text(value)}"
            yield Corner("surface", f"{name} {value:g}", StressStage(surface=text))
    yield Corner("surface", "emission 1e30", StressStage(surface="color3f inputs:emissiveColor = (1e30, 0, 0)"))
    yield Corner("surface", "emission nan", StressStage(surface="color3f inputs:emissiveColor = (nan, 0, 0)"))


def _lights() -> Iterator[Corner]:
    for intensity in (1e-20, 1e-10, 1e10, 1e20, -1.0, float("nan"), float("inf")):
        yield _bulb(f"intensity {intensity:g}", f"float inputs:intensity = {_text(intensity)}", EXACT)
    for exposure in (-50.0, 50.0):
        yield _bulb(f"exposure {exposure:g}", f"float inputs:intensity = 1\nfloat inputs:exposure = {exposure}", EXACT)
    for kelvin in (-5, 0, 1, 999, 1e5, 1e20):
        text = "bool inputs:enableColorTemperature = 1\nfloat inputs:intensity = 30"
        yield _bulb(f"temperature {kelvin:g}", f"{text}\nfloat inputs:colorTemperature = {kelvin}")
    for color in ("-1, 1, 1", "nan, 1, 1", "1e30, 0, 0"):
        yield _bulb(f"colour {color}", f"float inputs:intensity = 1\ncolor3f inputs:color = ({color})")
    yield Corner("light", "on the floor", StressStage(light_at=(1.5, -1.0, 1.5)))
    yield Corner("light", "1e-6 above the floor", StressStage(light_at=(1.5, -1.0 + 1e-6, 1.5)), why=_GRAZING)
    yield Corner("light", "inside the ball", StressStage(light_at=(0.0, 0.0, 0.0)))
    yield Corner("light", "behind everything", StressStage(light_at=(0.0, -5.0, -9.0)))
    for radius in (0.0, 1e-20, 1e6, -1.0, float("nan"), float("inf")):
        for normalize in (0, 1):
            light = f"""def SphereLight "bulb" {{
                float inputs:intensity = 30
                bool inputs:normalize = {normalize}
                float inputs:radius = {_text(radius)}
                double3 xformOp:translate = (2, 3, 3)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }}"""
            yield Corner("light", f"radius {radius:g}, normalize {normalize}", StressStage(lights=light), EXACT)
    for angle in (0.0, 0.53, 180.0, 360.0, 1e6, -1.0, float("nan")):
        light = f'def DistantLight "sun" {{\nfloat inputs:intensity = 3\nfloat inputs:angle = {_text(angle)}\n}}'
        yield Corner("light", f"distant angle {angle:g}", StressStage(lights=light))


def _shapings() -> Iterator[Corner]:
    for angle in (-1.0, 0.0, 1e-4, 30.0, 90.0, 180.0, 200.0, 1e6, float("nan"), float("inf")):
        for softness in (0.0, 1.0):
            text = f"float inputs:shaping:cone:angle = {_text(angle)}\nfloat inputs:shaping:cone:softness = {softness}"
            yield _shaped(f"cone {angle:g}, softness {softness:g}", text)
    for focus in (-1.0, 0.0, 1e-6, 1.0, 1e4, 1e30, float("nan")):
        yield _shaped(f"focus {focus:g}", f"float inputs:shaping:focus = {_text(focus)}")
    for softness in (-1.0, 5.0, float("nan")):
        text = f"float inputs:shaping:cone:angle = 40\nfloat inputs:shaping:cone:softness = {_text(softness)}"
        yield _shaped(f"softness {softness:g}", text)


def _worlds() -> Iterator[Corner]:
    for scale in (1e-6, 1e-3, 1e3, 1e6, 1e9):
        yield Corner("world", f"scale {scale:g}", StressStage(scale=scale))
    for origin in (1e4, 1e6, 1e8, -1e8):
        yield Corner("world", f"origin {origin:g}", StressStage(origin=origin))


def _cameras() -> Iterator[Corner]:
    for near, far in ((1e-6, 1e12), (100.0, 0.1), (0.0, 100.0), (-1.0, 100.0), (0.1, 0.1), (float("nan"), 1.0)):
        yield Corner("camera", f"clipping {near:g}..{far:g}", StressStage(clipping=(near, far)))
    for degrees, distance in ((0.01, 20000.0), (0.1, 2000.0), (10.0, 20.0), (150.0, 3.0), (179.0, 2.0)):
        why = _DISTANT if distance > 1000.0 else ""
        yield Corner("camera", f"field of view {degrees:g}°", _wide(degrees, distance), why=why)
    for name, text in {
        "orthographic": 'token projection = "orthographic"\nfloat horizontalAperture = 80\nfloat verticalAperture = 45',
        "no aperture": "float horizontalAperture = 0\nfloat verticalAperture = 0",
        "no focal length": "float focalLength = 0",
        "focal length nan": "float focalLength = nan",
        "shift of ten apertures": "float horizontalApertureOffset = 209.55",
        "exposure 50": "float exposure = 50",
        "exposure -50": "float exposure = -50",
        "exposure nan": "float exposure = nan",
        "fStop 0.001": "float fStop = 0.001\nfloat focusDistance = 6",
        "fStop 1e-20": "float fStop = 1e-20\nfloat focusDistance = 6",
        "focus at 1e-20": "float fStop = 2\nfloat focusDistance = 1e-20",
        "focus at 1e20": "float fStop = 2\nfloat focusDistance = 1e20",
        "shutter 1e9": "double shutter:open = 0\ndouble shutter:close = 1e9",
    }.items():
        yield Corner("camera", name, StressStage(camera=text), EXACT)
    for size in ((1, 1), (1, 1000), (1001, 1), (16384, 1)):
        yield Corner("camera", f"{size[0]}x{size[1]}", settings=replace(SEEN, size=size))


def _transforms() -> Iterator[Corner]:
    for name, rows in {
        "sheared": ((1, 0, 0, 0), (3, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "mirrored": ((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "stretched a million to one": ((1, 0, 0, 0), (0, 1e-6, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "singular": ((1, 0, 0, 0), (0, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "zero": ((0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 1)),
        "nan": ((1, 0, 0, 0), (0, "nan", 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "inf": ((1, 0, 0, 0), (0, "inf", 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        "projective": ((1, 0, 0, 0.1), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 0)),
    }.items():
        ops = transformed(*rows).replace("'", "")  # type: ignore[arg-type]
        yield Corner("transform", f"ball {name}", StressStage(ball_ops=ops))
        light = f'def SphereLight "bulb" {{\nfloat inputs:intensity = 30\n{ops}\n}}'
        yield Corner("transform", f"light {name}", StressStage(lights=light))
    yield Corner("transform", "nothing there", StressStage(lights="", ball='token visibility = "invisible"'))


def _meshes() -> Iterator[Corner]:
    triangle = "int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0, 1, 2, 0, 2, 3]"
    points = "point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]"
    usual = f"{triangle}\n{points}"
    for name, text in {
        "no area": f"{triangle}\npoint3f[] points = [(-1, 0, 0), (0, 0, 0), (1, 0, 0), (2, 0, 0)]",
        "one point": f"{triangle}\npoint3f[] points = [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)]",
        "duplicate faces": f"{points}\nint[] faceVertexCounts = [4, 4]\nint[] faceVertexIndices = [0,1,2,3,0,1,2,3]",
        "three at an edge": f"{points[:-1]}, (0, 0, 1)]\nint[] faceVertexCounts = [3, 3, 3]\n"
        "int[] faceVertexIndices = [0, 2, 1, 0, 2, 3, 0, 2, 4]",
        "no faces": f"{points}\nint[] faceVertexCounts = []\nint[] faceVertexIndices = []",
        "nothing": "point3f[] points = []\nint[] faceVertexCounts = []\nint[] faceVertexIndices = []",
        "reversed twin": f"{points}\nint[] faceVertexCounts = [4, 4]\nint[] faceVertexIndices = [0,1,2,3,3,2,1,0]",
        "one index thrice": f"{points}\nint[] faceVertexCounts = [3, 4]\nint[] faceVertexIndices = [1,1,1,0,1,2,3]",
        "nan point": f"{triangle}\npoint3f[] points = [(-1, -1, 0), (1, nan, 0), (1, 1, 0), (-1, 1, 0)]",
        "inf point": f"{triangle}\npoint3f[] points = [(-1, -1, 0), (inf, -1, 0), (1, 1, 0), (-1, 1, 0)]",
        "far point": f"{triangle}\npoint3f[] points = [(-1, -1, 0), (1e30, -1, 0), (1, 1, 0), (-1, 1, 0)]",
        "zero normals": f"{usual}\nnormal3f[] normals = [(0,0,0),(0,0,0),(0,0,0),(0,0,0)]",
        "nan normals": f"{usual}\nnormal3f[] normals = [(nan,0,1),(0,0,1),(0,0,1),(0,0,1)]",
        "opposed normals": f"{usual}\nnormal3f[] normals = [(0,0,1),(0,0,1),(0,0,-1),(0,0,-1)]",
        "normals 1e-30": f"{usual}\nnormal3f[] normals = [(0,0,1e-30),(0,0,1e-30),(0,0,1e-30),(0,0,1e-30)]",
        "normals 1e30": f"{usual}\nnormal3f[] normals = [(0,0,1e30),(0,0,1e30),(0,0,1e30),(0,0,1e30)]",
        "nan colours": f"{usual}\ncolor3f[] primvars:displayColor = [(nan, 1, 1)]",
        "nan uvs": f'{usual}\ntexCoord2f[] primvars:st = [(nan,0),(0,0),(0,0),(0,0)] (interpolation = "vertex")',
        "indices out of range": f"{points}\nint[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 99]",
        "negative indices": f"{points}\nint[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, -1]",
        "counts that disagree": f"{points}\nint[] faceVertexCounts = [4, 4]\nint[] faceVertexIndices = [0, 1, 2, 3]",
        "absurd counts": f"{points}\nint[] faceVertexCounts = [2147483647]\nint[] faceVertexIndices = [0, 1, 2, 3]",
        "counts of wrong type": f'{points}\nstring faceVertexCounts = "four"\nint[] faceVertexIndices = [0, 1, 2, 3]',
    }.items():
        for scheme, suffix in (("none", ""), ("catmullClark", ", subdivided")):
            mesh = f'uniform token subdivisionScheme = "{scheme}"\n{text}'
            yield Corner("mesh", name + suffix, StressStage(ball_kind="Mesh", ball=mesh))


def _swarm(count: int) -> str:
    """So many bulbs over the ball, as bright as one together."""
    places = np.random.default_rng(1).uniform((-3.0, 1.5, -3.0), (3.0, 4.0, 3.0), (count, 3)).round(4)
    return f"""def PointInstancer "swarm" {{
        rel prototypes = </swarm/bulb>
        int[] protoIndices = {[0] * count}
        point3f[] positions = {list(map(tuple, places.tolist()))}
        def SphereLight "bulb" {{
            float inputs:intensity = {30.0 / count!r}
            float inputs:radius = 0.2
        }}
    }}"""


def _bulb(name: str, text: str, settings: RenderSettings = SEEN) -> Corner:
    return Corner("light", name, StressStage(lights=f'def SphereLight "bulb" {{\n{text}\nLIGHT_OPS\n}}'), settings)


def _shaped(name: str, text: str) -> Corner:
    light = f"""def SphereLight "bulb" (prepend apiSchemas = ["ShapingAPI"]) {{
        float inputs:intensity = 90
        float inputs:radius = 0.2
        {text}
        double3 xformOp:translate = (0, 3, 0)
        float xformOp:rotateX = -90
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }}"""
    return Corner("shaping", name, StressStage(lights=light))


def _wide(degrees: float, distance: float) -> StressStage:
    """The ball in about the middle of a view of so many degrees."""
    aperture = 48.0
    lens = f"float horizontalAperture = {aperture}\nfloat verticalAperture = 27\n"
    lens += f"float focalLength = {aperture / 2.0 / tan(radians(degrees) / 2.0)!r}"
    return StressStage(camera=lens, eye=(0.0, 0.0, distance), clipping=(distance / 10.0, distance * 10.0))


def _text(value: float) -> str:
    return repr(value)


_FAMILIES = (_surfaces, _lights, _shapings, _worlds, _cameras, _transforms, _meshes)
