"""A ball on a floor under a bulb, as usda text, whose parts corners replace."""

from __future__ import annotations

from defshade_cli.dataclass import dataclass

_TRANSFORM = "xformOp:transform"


def translated(x: float, y: float, z: float) -> str:
    """xformOps of a translation in double."""
    return f'double3 xformOp:translate = ({x!r}, {y!r}, {z!r})\nuniform token[] xformOpOrder = ["xformOp:translate"]'


def transformed(*rows: tuple[float, float, float, float]) -> str:
    """xformOps of a matrix, in USD's row vectors."""
    return f'matrix4d {_TRANSFORM} = ({", ".join(map(str, rows))})\nuniform token[] xformOpOrder = ["{_TRANSFORM}"]'


@dataclass(frozen=True, slots=True)
class StressStage:
    """Text of a stage. All lengths are in units of `scale`, all places relative to `origin`.

    ball, floor, surface, camera: attributes added to those prims.  ball_ops, camera_ops: transforms.
    lights, more: prims, with LIGHT_OPS in the place of a light's transform.
    """

    scale: float = 1.0
    origin: float = 0.0
    surface: str = ""
    camera: str = "float focalLength = 20"
    ball: str = ""
    ball_ops: str = ""
    ball_kind: str = "Sphere"
    lights: str = 'def SphereLight "bulb" {\nfloat inputs:intensity = 30\nLIGHT_OPS\n}'
    light_at: tuple[float, float, float] = (2.0, 3.0, 3.0)
    eye: tuple[float, float, float] = (0.0, 0.5, 6.0)
    clipping: tuple[float, float] = (0.1, 100.0)
    more: str = ""

    def text(self) -> str:
        """The stage, as usda."""
        ops = {name: self._placed(place) for name, place in (("LIGHT_OPS", self.light_at), ("EYE_OPS", self.eye))}
        lights = self.lights.replace("LIGHT_OPS", f"float inputs:radius = {0.2 * self.scale!r}\n{ops['LIGHT_OPS']}")
        near, far = (limit * self.scale for limit in self.clipping)
        return f"""#usda 1.0
(
    upAxis = "Y"
    metersPerUnit = 1
)
def Camera "eye" {{
    float2 clippingRange = ({near!r}, {far!r})
    {self.camera}
    {ops["EYE_OPS"]}
}}
def Material "surface" {{
    token outputs:surface.connect = </surface/shader.outputs:surface>
    def Shader "shader" {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        {self.surface}
    }}
}}
def {self.ball_kind} "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </surface>
    {f"double radius = {self.scale!r}" if self.ball_kind == "Sphere" else ""}
    {self.ball}
    {self.ball_ops or self._placed((0.0, 0.0, 0.0))}
}}
def Mesh "floor" {{
    point3f[] points = {self._corners()}
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    {self._placed((0.0, -1.0, 0.0))}
}}
{lights}
{self.more}
"""

    def _placed(self, place: tuple[float, float, float]) -> str:
        x, y, z = (self.origin + at * self.scale for at in place)
        return translated(x, y, z)

    def _corners(self) -> str:
        side = 4.0 * self.scale
        return str([(-side, 0.0, side), (side, 0.0, side), (side, 0.0, -side), (-side, 0.0, -side)])
