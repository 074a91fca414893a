"""The GBuffer's planes: one table of name, format, encoding and need; GLSL on both sides is generated from it.

`rgba8` is the seed's layout bit for bit, `packed` spends the same bytes better, `float` keeps everything.
The planes behind the first two exist only when a material or a requested layer needs them; the last ones, which the
lighting does not read, only for layers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.material import Material
from defshade_cli.settings import Layout

MOST_PRIMVARS = 4
"""Primvars that layers can show at a time: a vertex has four numbers of each."""

MOST_TARGETS = 8
"""Colour attachments that every OpenGL 4.5 has."""


@dataclass(frozen=True, slots=True)
class Encoding:
    """One plane in one layout.

    dtype: moderngl's, f1 for 8-bit unorm, f2 half, f4 float, u4 for integers.
    write: GLSL value from `Surface s` and `Detail d`.
    read: GLSL statements that set members of `s` from `vec4 t`; empty for what the lighting does not read.
    """

    dtype: str
    write: str
    read: str


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """One render target.

    needed: does this material make it necessary for the lighting?
    inputs: what the GBuffer's shaders must interpolate for it, as defines.
    """

    name: str
    components: int
    encodings: dict[Layout, Encoding]
    needed: Callable[[Material], bool]
    inputs: tuple[str, ...] = ()

    @property
    def define(self) -> str:
        """The macro by which shaders know that the plane is there."""
        return f"PLANE_{self.name.upper()}"


def _encodings(write: str, read: str, narrow: str = "f1", wide: str = "f4") -> dict[Layout, Encoding]:
    """The same expression in all three layouts."""
    return {
        "rgba8": Encoding(narrow, write, read),
        "packed": Encoding(narrow, write, read),
        "float": Encoding(wide, write, read),
    }


def _always(_: Material) -> bool:
    return True


def _detail(name: str, components: int, write: str, *inputs: str, dtype: str = "f4") -> Plane:
    """A plane that only layers show."""
    return Plane(name, components, _encodings(write, "", narrow=dtype, wide=dtype), lambda _: False, inputs)


_BASE_READ = "s.metallic = t.a; set_metallic_fresnel(s, DEFAULT_F0);"
_ROUGHNESS_READ = "s.roughness = t.a;"

PLANES: tuple[Plane, ...] = (
    Plane(
        "base",
        4,
        {
            "rgba8": Encoding("f1", "vec4(s.base, s.metallic)", f"s.base = t.rgb; {_BASE_READ}"),
            "packed": Encoding(
                "f1",
                "vec4(srgb_from_linear(s.base), s.metallic)",
                f"s.base = linear_from_srgb(t.rgb); {_BASE_READ}",
            ),
            "float": Encoding("f4", "vec4(s.base, s.metallic)", f"s.base = t.rgb; {_BASE_READ}"),
        },
        _always,
    ),
    Plane(
        "normal",
        4,
        {
            "rgba8": Encoding(
                "f1",
                "vec4(s.normal * 0.5 + 0.5, s.roughness)",
                f"s.normal = normalize(t.xyz * 2.0 - 1.0); {_ROUGHNESS_READ}",
            ),
            "packed": Encoding(
                "f1",
                "vec4(bytes_from_unit(s.normal), s.roughness)",
                f"s.normal = unit_from_bytes(t.xyz); {_ROUGHNESS_READ}",
            ),
            "float": Encoding("f4", "vec4(s.normal, s.roughness)", f"s.normal = t.xyz; {_ROUGHNESS_READ}"),
        },
        _always,
    ),
    Plane(
        "emission",
        4,
        _encodings("vec4(s.emission, 0.0)", "s.emission = t.rgb;", narrow="f2"),
        lambda material: any(material.emissive_color) or "emissive_color" in material.inputs,
    ),
    Plane(
        "specular",
        4,
        _encodings(
            "vec4(s.f0, 0.0)",
            "s.f0 = t.rgb;",  # F90 needs no plane: the specular workflow has metallic 0, for which it is white
            narrow="f2",
        ),
        lambda material: material.use_specular_workflow or material.ior != 1.5 or "ior" in material.inputs,
    ),
    Plane(
        "clearcoat",
        2,
        _encodings(
            "vec4(s.clearcoat, s.clearcoat_roughness, 0.0, 0.0)",
            "s.clearcoat = t.x; s.clearcoat_roughness = t.y;",
        ),
        lambda material: material.clearcoat > 0.0 or "clearcoat" in material.inputs,
    ),
    Plane(
        "links",  # whether it is needed is the lights' affair
        1,
        _encodings("vec4(float(s.link_set))", "s.link_set = uint(t.r);", narrow="f4"),
        lambda _: False,
    ),
    Plane(
        "weights",  # whether they are needed is known with displayOpacity
        4,
        _encodings(
            "vec4(s.weights, s.turn, 0.0)",
            "s.weights = t.xy; s.turn = t.z;",
            narrow="f4",  # the lobes of a surface that is hardly there weigh millions
        ),
        lambda _: False,
    ),
    Plane(
        "triangle",  # whether it is needed is known with what lets through, and with shadows
        4,
        _encodings("vec4(d.facet, 0.0)", "s.triangle = t.xyz;", narrow="f2"),
        lambda _: False,
        ("POSITION",),
    ),
    _detail("facet", 4, "vec4(d.facet, 0.0)", "POSITION"),
    _detail("tangent", 4, "vec4(d.tangent, 0.0)", "POSITION", "LAYER_UV"),
    _detail("uv", 2, "vec4(d.uv, 0.0, 0.0)", "LAYER_UV"),
    _detail("occlusion", 1, "vec4(d.occlusion)"),
    *(_detail(f"primvar_{i}", 4, f"d.primvars[{i}]", "PRIMVARS") for i in range(MOST_PRIMVARS)),
    _detail("motion", 4, "d.motion", "MOTION"),
    _detail("visible", 2, "uvec4(d.visible, 0u, 0u)", "DRAW_ROW", dtype="u4"),
)


def needed_planes(materials: Iterable[Material]) -> tuple[Plane, ...]:
    """The planes without which the lighting cannot see some material, in the table's order."""
    materials = list(materials)
    return tuple(p for p in PLANES if any(p.needed(m) for m in materials))


def named_planes(names: Iterable[str]) -> tuple[Plane, ...]:
    """The planes of these names, in the table's order; names of other things are passed over."""
    wanted = set(names)
    return tuple(p for p in PLANES if p.name in wanted)


def write_source(planes: Sequence[Plane], layout: Layout) -> str:
    """GLSL: the outputs, and `void write_planes(Surface s, Detail d)`."""
    integers = integer_attachments(planes, layout)
    types = ["uvec4" if i in integers else "vec4" for i in range(len(planes))]
    outputs = [f"layout(location = {i}) out {types[i]} plane_{p.name};" for i, p in enumerate(planes)]
    body = [f"    plane_{p.name} = {p.encodings[layout].write};" for p in planes]
    return "\n".join(
        ['#include "lib/encode.glsl"', *outputs, "", "void write_planes(Surface s, Detail d) {", *body, "}"]
    )


def planes_read(planes: Sequence[Plane], layout: Layout) -> list[Plane]:
    """Those that the lighting reads, each from the image unit of its place among them."""
    return [plane for plane in planes if plane.encodings[layout].read]


def read_source(planes: Sequence[Plane], layout: Layout) -> str:
    """GLSL: the images, `BACKGROUND_DEPTH`, and `Surface read_planes(ivec2 pixel)`.

    Images and not samplers: a software rasteriser loads a texel in half the time that it takes to fetch one.
    """
    read = planes_read(planes, layout)
    return "\n".join(
        [
            '#include "lib/encode.glsl"',
            "uniform sampler2D plane_depth;",
            *(_image(unit, plane, layout) for unit, plane in enumerate(read)),
            f"const float BACKGROUND_DEPTH = {background_depth(layout)};",
            "",
            "Surface read_planes(ivec2 pixel) {",
            "    Surface s;",
            "    s.blur = 0.0;",
            "#ifdef PATCHES",
            "    s.footprint = POINT;",
            "#endif",
            "    vec4 t;",
            *(f"    t = imageLoad(plane_{plane.name}, pixel); {plane.encodings[layout].read}" for plane in read),
            "    return s;",
            "}",
        ]
    )


def _image(unit: int, plane: Plane, layout: Layout) -> str:
    """Its declaration; images have one, two or four components."""
    stored = {1: "r", 2: "rg", 4: "rgba"}[plane.components]
    stored += {"f1": "8", "f2": "16f", "f4": "32f"}[plane.encodings[layout].dtype]
    return f"layout(binding = {unit}, {stored}) readonly restrict uniform image2D plane_{plane.name};"


def integer_attachments(planes: Sequence[Plane], layout: Layout) -> list[int]:
    """Which of the targets hold unsigned integers."""
    return [i for i, plane in enumerate(planes) if plane.encodings[layout].dtype == "u4"]


def uses_standard_depth(layout: Layout) -> bool:
    """The seed compares depth with LESS, 0 at the near plane; the other layouts reverse it."""
    return layout == "rgba8"


def background_depth(layout: Layout) -> float:
    """What is stored where nothing is drawn."""
    return 1.0 if uses_standard_depth(layout) else 0.0
