"""Materials as prims wear them: primvars in their fields, and what stands in for coordinates that they lack."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from defshade_cli.scene.material import Material
from stages import reasons
from test_material import BINDS, DIFFUSE_FROM_READER, READER, network, read, read_inputs, surface


def metallic_of(primvars: str, kind: str = "float") -> dict[str, float]:
    """By path, what of the cubes below `primvars` is metal by their primvar `rust`; 0.75 is the reader's fallback."""
    reader = READER.format(type=kind, name="rust", fallback=f"{kind} inputs:fallback = 0.75")
    material = surface("m", "float inputs:metallic.connect = </m/reader.outputs:result>", reader)
    scene = read(material + primvars)
    assert not any(m.primvars for m in scene.materials)
    return {path: scene.materials[d.subsets[0].material].metallic for d in scene.drawables for path in d.paths}


RUSTY = f'Xform "%s" {BINDS} {{\nrel material:binding = </m>\n%s\ndef Cube "cube" {{\n}}\n}}\n'


@pytest.mark.parametrize(
    ("primvar", "metallic"),
    [
        ("", 0.75),
        ("float primvars:rust = 0.25", 0.25),
        ("float[] primvars:rust = [0.25]", 0.25),
        ('float[] primvars:rust = [0.5, 0.25] (interpolation = "constant")\nint[] primvars:rust:indices = [1]', 0.25),
        ("half primvars:rust = 2", 1.0),
        ('string primvars:rust = "much"', 0.75),
    ],
)
def test_a_primvar_can_feed_any_number(primvar: str, metallic: float) -> None:
    assert metallic_of("def " + RUSTY % ("a", primvar)) == {"/a/cube": metallic}


def test_instances_have_the_primvars_that_they_inherit() -> None:
    copies = (
        f'def Xform "{name}" (\ninstanceable = true\ninherits = </tree>\n) {{\n{primvar}\n}}\n'
        for name, primvar in (("a", "float primvars:rust = 0"), ("b", ""), ("c", "float primvars:rust = 0"))
    )
    found = metallic_of("class " + RUSTY % ("tree", "") + "".join(copies))
    assert found == {"/a/cube": 0.0, "/b/cube": 0.75, "/c/cube": 0.0}


def test_a_primvar_that_varies_over_a_prim_feeds_no_number_and_is_named() -> None:
    reader = READER.format(type="float", name="rust", fallback="")
    material = surface("m", "float inputs:metallic.connect = </m/reader.outputs:result>", reader)
    varying = 'float[] primvars:rust = [0, 1, 0, 1, 0, 1, 0, 1] (interpolation = "vertex")'
    scene = read(f'{material}\ndef Cube "cube" {BINDS} {{\n{varying}\nrel material:binding = </m>\n}}')
    assert scene.materials == (Material("/m"),)
    assert reasons(scene, "/cube") == ["primvars:rust is left out: only colours may vary over a prim"]


@pytest.mark.parametrize(
    ("primvar", "told"),
    [
        ("float[] primvars:rust = []", []),
        (
            'float[] primvars:rust = [0.5, 0.25] (interpolation = "constant")\nint[] primvars:rust:indices = [2]',
            ["primvars:rust is left out: its indices are out of range"],
        ),
        ("float primvars:rust = nan", ["without metallic (not finite)"]),
    ],
)
def test_a_primvar_without_a_sound_value_leaves_the_readers_fallback(primvar: str, told: list[str]) -> None:
    reader = READER.format(type="float", name="rust", fallback="float inputs:fallback = 0.75")
    material = surface("m", "float inputs:metallic.connect = </m/reader.outputs:result>", reader)
    scene = read(material + "def " + RUSTY % ("a", primvar))
    assert [found.metallic for found in scene.materials] == [0.75]
    assert [issue.reason for issue in scene.unsupported] == told


TRIANGLE = """int[] faceVertexCounts = [3]
int[] faceVertexIndices = [0, 1, 2]
point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
uniform token subdivisionScheme = "none"
"""


@pytest.mark.parametrize(("primvar", "uv"), [("", ""), ("texCoord2f primvars:map = (1, 1)", "map")])
def test_a_prim_without_coordinates_is_read_at_the_readers_fallback(tmp_path: Path, primvar: str, uv: str) -> None:
    (tmp_path / "wood.png").touch()
    stage = Path(network(tmp_path, "wood.png"))
    text = stage.read_text().replace(
        "string inputs:varname", "float2 inputs:fallback = (0.5, 0.25)\nstring inputs:varname"
    )
    mesh = text.replace('def Cube "cube"', 'def Mesh "cube"').replace("rel mat", f"{TRIANGLE}{primvar}\nrel mat")
    stage.write_text(mesh)
    read_at = read_inputs(str(stage))["diffuse_color"]
    assert read_at.uv == uv
    if not uv:  # turned by 90 degrees, scaled and moved, as COORDINATES says
        np.testing.assert_allclose(read_at.texture_from_uv, [[0, 0, 4 - 0.25 * 3], [0, 0, 5 + 0.5 * 2]], atol=1e-12)


@pytest.mark.parametrize("fallback", ["float inputs:fallback = 0.5", "float2 inputs:fallback = (nan, 0)"])
def test_a_fallback_that_is_no_coordinates_counts_as_none(tmp_path: Path, fallback: str) -> None:
    (tmp_path / "wood.png").touch()
    stage = Path(network(tmp_path, "wood.png"))
    stage.write_text(stage.read_text().replace("string inputs:varname", f"{fallback}\nstring inputs:varname"))
    assert read_inputs(str(stage))["diffuse_color"].fallback == (0.0, 0.0)


@pytest.mark.parametrize(
    ("body", "left_out"),
    [
        ("float inputs:displacement = 0\nnormal3f inputs:normal = (0, 0, 1)", []),
        ("float inputs:displacement = 0.5", ["without displacement (the same everywhere)"]),
        ("normal3f inputs:normal = (1, 0, 0)", ["without normal (the same everywhere)"]),
        ("float inputs:metallic.connect = </m/gone.outputs:r>", ["without metallic (connected to nothing)"]),
        ("float inputs:occlusion.connect = </m/gone.outputs:r>", []),
    ],
)
def test_what_a_surface_says_in_vain_is_named(body: str, left_out: list[str]) -> None:
    scene = read(f'{surface("m", body)}\ndef Cube "cube" {BINDS} {{\nrel material:binding = </m>\n}}')
    assert scene.materials == (Material("/m"),)
    assert reasons(scene, "/m") == left_out


TINTED = surface("m", DIFFUSE_FROM_READER, READER.format(type="float3", name="tint", fallback=""))
TINTS = {"a": (1, 0, 0), "b": (0, 1, 0)}


def test_instances_have_the_colour_that_they_inherit_of_any_primvar() -> None:
    """Not that of their displayColor, which the material does not read."""
    copies = (
        f'def Xform "{name}" (\ninstanceable = true\ninherits = </tree>\n) {{\n'
        f"color3f primvars:tint = {tint}\ncolor3f primvars:displayColor = (0, 0, 1)\n}}\n"
        for name, tint in TINTS.items()
    )
    scene = read(TINTED + "class " + RUSTY % ("tree", "") + "".join(copies))
    colors = {p: tuple(c) for d in scene.drawables for p, c in zip(d.paths, d.display_color.tolist(), strict=True)}
    assert colors == {f"/{name}/cube": tint for name, tint in TINTS.items()}


def test_copies_have_their_own_colour_of_any_primvar_but_no_numbers() -> None:
    readers = (
        READER.format(type="float3", name="tint", fallback="")
        + "\n"
        + READER.format(type="float", name="rust", fallback="").replace('"reader"', '"number"')
    )
    inputs = f"{DIFFUSE_FROM_READER}\nfloat inputs:metallic.connect = </m/number.outputs:result>"
    swarm = f"""def PointInstancer "swarm" {{
        point3f[] positions = [(0, 0, 0), (3, 0, 0)]
        int[] protoIndices = [0, 0]
        color3f[] primvars:tint = {list(TINTS.values())} (interpolation = "vertex")
        float[] primvars:rust = [0, 1] (interpolation = "vertex")
        rel prototypes = </swarm/p>
        {"def " + RUSTY % ("p", "")}
    }}"""
    scene = read(surface("m", inputs, readers) + swarm)
    (drawn,) = scene.drawables
    assert [tuple(color) for color in drawn.display_color.tolist()] == list(TINTS.values())
    assert scene.materials[0].metallic == 0.0
    reason = "primvars:rust of /swarm is left out: only colours may differ between copies"
    assert reasons(scene, "/swarm/p/cube") == [reason]
