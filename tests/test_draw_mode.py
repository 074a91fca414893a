"""Models that are replaced by boxes, axes and cards."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from pxr import Usd

from defshade_cli.image.reading import read as read_image
from defshade_cli.image.texture import world_to_screen
from defshade_cli.rendering import render
from defshade_cli.scene.geometry import enclose, world_boxes
from defshade_cli.scene.scene import Scene
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from stages import move, read, stage_of

LOW, HIGH = (-1.0, -2.0, -3.0), (1.0, 2.0, 3.0)


def model(body: str = "", kind: str = "component", name: str = "model") -> str:
    """A box of 2x4x6 as a model."""
    return f"""def Xform "{name}" (
        prepend apiSchemas = ["GeomModelAPI"]
        kind = "{kind}"
    ) {{
        {body}
        def Cube "cube" {{
            float3 xformOp:scale = (1, 2, 3)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }}
    }}
    """


def inside(body: str, models: str, kind: str = "group") -> str:
    return f'def Xform "all" (kind = "{kind}") {{\n{body}\n{models}\n}}\n'


def mode(name: str) -> str:
    return f'uniform token model:drawMode = "{name}"\n'


def paths(scene: Scene) -> set[str]:
    return {path for drawable in scene.drawables for path in drawable.paths}


def bounds(scene: Scene) -> np.ndarray:
    (drawable,) = scene.drawables
    return enclose([world_boxes(scene.meshes[drawable.mesh].bounds, drawable.world_from_object)])


@pytest.mark.parametrize("drawn", ["bounds", "origin", "cards"])
def test_a_component_is_replaced(drawn: str) -> None:
    assert paths(read(model(mode(drawn)))) == {"/model"}


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        (model(), "/model/cube"),
        (model(mode("default")), "/model/cube"),
        (model(mode("inherited")), "/model/cube"),
        (model(mode("bounds") + "uniform bool model:applyDrawMode = false"), "/model/cube"),
        (model(mode("bounds"), kind="group"), "/model/cube"),
        (model(mode("bounds") + "uniform bool model:applyDrawMode = true", kind="group"), "/model"),
        (model(mode("bounds"), kind="subcomponent"), "/model/cube"),
        (inside(mode("bounds"), model()), "/all/model"),
        (inside(mode("bounds"), model(mode("default"))), "/all/model/cube"),
        (inside(mode("bounds"), model(), kind=""), "/all/model/cube"),
    ],
)
def test_where_a_draw_mode_takes_effect(text: str, drawn: str) -> None:
    assert paths(read(text)) == {drawn}


def test_bounds_are_the_models_edges() -> None:
    scene = read(model(mode("bounds") + move(x=10)))
    width = 0.008 * np.linalg.norm(np.subtract(HIGH, LOW))
    np.testing.assert_allclose(bounds(scene) - [10, 0, 0], [np.subtract(LOW, width / 2), np.add(HIGH, width / 2)])
    assert len(scene.drawables[0].world_from_object) == 12, "twelve edges, each a bar"


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_lines_are_no_thinner_than_a_pixel(scale: float) -> None:
    """Seen from 100 away by a camera of 45 degrees, 64 pixels are 2 * 100 * tan(22.5°) units."""
    eye = f"""def Camera "eye" {{
        float horizontalAperture = {20 * math.tan(math.pi / 8)}
        float verticalAperture = {20 * math.tan(math.pi / 8)}
        float focalLength = 10
        {move(z=100)}
    }}"""
    size = f"float3 xformOp:scale = ({scale}, {scale}, {scale})\nuniform token[] xformOpOrder = ['xformOp:scale']"
    stage = stage_of(model(mode("bounds") + size) + eye)
    (drawable,) = StageReader(stage, ReadOptions(size=(64, 64))).read(None).drawables
    pixel = 200 * math.tan(math.pi / 8) / 64
    widths = np.linalg.norm(drawable.world_from_object[:, :3, 1:3], axis=1)
    np.testing.assert_allclose(widths, pixel, rtol=0.04 * scale)


def test_the_hint_of_extents_goes_before_the_geometry() -> None:
    hint = "float3[] extentsHint = [(-5, -5, -5), (5, 5, 5)]"
    np.testing.assert_allclose(bounds(read(model(mode("bounds") + hint))), [[-5] * 3, [5] * 3], rtol=0.02)


def test_axes_are_of_unit_length() -> None:
    np.testing.assert_allclose(bounds(read(model(mode("origin")))), [[0] * 3, [1] * 3], atol=0.01)


def test_lines_shine_in_the_colour_of_the_draw_mode() -> None:
    (material,) = read(model(mode("bounds") + "uniform float3 model:drawModeColor = (1, 0.5, 0.25)")).materials
    assert material.emissive_color == (1, 0.5, 0.25) and material.diffuse_color == (0, 0, 0)


@pytest.mark.parametrize("geometry", ["cross", "box"])
def test_without_textures_six_cards_have_the_colour_of_the_draw_mode(geometry: str) -> None:
    scene = read(model(mode("cards") + f'uniform token model:cardGeometry = "{geometry}"'))
    assert len(scene.meshes[0].triangles) == 12
    np.testing.assert_allclose(bounds(scene), [LOW, HIGH])
    assert [m.diffuse_color for m in scene.materials] == [pytest.approx((0.18,) * 3)]


def card(name: str, file: str = "card.png") -> str:
    return f"asset model:cardTexture{name} = @{file}@\n"


def test_only_axes_with_a_texture_have_cards(tmp_path: Path) -> None:
    (tmp_path / "card.png").touch()
    body = mode("cards") + 'uniform token model:cardGeometry = "box"\n' + card("XPos", f"{tmp_path}/card.png")
    scene = read(model(body))
    assert len(scene.meshes[0].triangles) == 4, "the card and its opposite"
    assert [m.path for m in scene.materials] == ["/model.model:cardTextureXPos"]
    assert scene.materials[0].one_sided and scene.materials[0].opacity_threshold == 0.1


def test_the_card_of_the_up_axis_may_be_hidden(tmp_path: Path) -> None:
    (tmp_path / "card.png").touch()
    file = f"{tmp_path}/card.png"
    body = mode("cards") + card("XPos", file) + card("YPos", file) + 'uniform token model:cardVisibility = "simple"'
    np.testing.assert_allclose(bounds(read(model(body), metadata='upAxis = "Y"'))[:, 0], [0, 0])


@pytest.mark.parametrize(
    ("name", "own", "at", "texel"),
    [
        ("XPos", "XPos", (1, 1), (1, 1)),  # to the right is +y, up is +z
        ("XNeg", "XNeg", (1, 1), (0, 1)),
        ("YPos", "YPos", (1, 1), (0, 1)),
        ("YNeg", "YNeg", (1, 1), (1, 1)),
        ("ZPos", "ZPos", (1, 1), (1, 1)),
        ("ZNeg", "ZNeg", (1, 1), (1, 0)),
        ("XNeg", "XPos", (1, 1), (1, 1)),  # the opposite's, seen through it
        ("YPos", "YNeg", (1, 1), (1, 1)),
        ("ZPos", "ZNeg", (1, 1), (1, 0)),
        ("ZNeg", "ZPos", (1, 1), (1, 1)),
    ],
)
def test_textures_lie_on_cards_as_in_hydra(
    tmp_path: Path, name: str, own: str, at: tuple[int, int], texel: tuple[int, int]
) -> None:
    """at: a corner of the card by the two axes across it in alphabetical order."""
    (tmp_path / "card.png").touch()
    body = mode("cards") + 'uniform token model:cardGeometry = "box"\n' + card(own, f"{tmp_path}/card.png")
    mesh = read(model(body)).meshes[0]
    axis, end = "XYZ".index(name[0]), LOW if name.endswith("Neg") else HIGH
    wanted = np.insert(np.array(HIGH)[[i for i in range(3) if i != axis]] * at, axis, end[axis])
    (corner,) = np.flatnonzero((mesh.points == wanted.astype(np.float32)).all(axis=1))
    np.testing.assert_array_equal(mesh.uvs["cardsUv"][corner], texel)


FROM_TEXTURE = mode("cards") + 'uniform token model:cardGeometry = "fromTexture"\n'


def seen(path: Path, screen_from_model: np.ndarray) -> str:
    """A card's texture whose header says where it was seen from."""
    spec = oiio.ImageSpec(2, 2, 3, oiio.HALF)
    spec.attribute("worldtoscreen", oiio.TypeMatrix, tuple(screen_from_model.T.ravel().tolist()))
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI.All, np.full((2, 2, 3), 0.5, np.float32))
    assert image.write(str(path))
    return str(path)


def test_cards_are_placed_by_their_textures(tmp_path: Path) -> None:
    """One 4 wide and 2 high at x = 5, of an orthographic view along +x with -y to the right and z up."""
    screen_from_model = np.array([[0, -0.5, 0, 0], [0, 0, -1, 1], [1, 0, 0, -5], [0, 0, 0, 1]])
    file = seen(tmp_path / "seen.exr", screen_from_model)
    scene = read(model(FROM_TEXTURE + card("XPos", file) + card("ZNeg", file)), seen_from=world_to_screen)
    mesh, (drawable,) = scene.meshes[0], scene.drawables
    assert len(mesh.triangles) == 4 and len(drawable.paths) == 1
    np.testing.assert_allclose(mesh.bounds, [[5, -2, 0], [5, 2, 2]])
    top_left = (mesh.points == np.array([5, 2, 2], np.float32)).all(axis=1)
    np.testing.assert_array_equal(mesh.uvs["cardsUv"][top_left], [[0, 1]] * 2)
    assert (mesh.normals[:, 0] < 0).all(), "they face the viewer"
    assert [m.path for m in scene.materials] == ["/model.model:cardTextureXPos", "/model.model:cardTextureZNeg"]


def test_cards_may_be_seen_in_perspective(tmp_path: Path) -> None:
    """From the origin along +z, 2 away: what is at (x, y, z) is seen at (x, y) / z."""
    screen_from_model = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -2], [0, 0, 1, 0]])
    text = model(FROM_TEXTURE + card("YPos", seen(tmp_path / "seen.exr", screen_from_model)))
    scene = read(text, seen_from=world_to_screen)
    np.testing.assert_allclose(scene.meshes[0].bounds, [[-2, -2, 2], [2, 2, 2]])


def test_textures_that_place_no_card_are_reported(tmp_path: Path) -> None:
    other = f"{tmp_path}/other.png"
    oiio.ImageBuf(np.ones((2, 2, 3), np.float32)).write(other, "uint8")
    flat = seen(tmp_path / "flat.exr", np.zeros((4, 4)))
    textures = card("XPos", other) + card("YPos", flat) + card("ZPos", "gone.png")
    scene = read(model(FROM_TEXTURE + textures) + 'def Cube "other" {}', seen_from=world_to_screen)
    assert [issue.reason for issue in scene.unsupported] == [
        "model:cardTextureXPos has no card: its header has no worldtoscreen",
        "model:cardTextureYPos has no card: its worldtoscreen cannot be inverted",
        "model:cardTextureZPos has no card: no file gone.png",
    ]
    assert paths(scene) == {"/other"}


def test_a_card_without_its_file_is_reported() -> None:
    scene = read(model(mode("cards") + card("XPos", "gone.png")))
    assert [(i.path, i.reason) for i in scene.unsupported] == [("/model.model:cardTextureXPos", "no file gone.png")]


def test_a_model_without_bounds_is_reported() -> None:
    text = 'def Cube "other" {}\n' + model(mode("bounds") + 'token visibility = "inherited"').replace("Cube", "Xform")
    assert [issue.reason for issue in read(text).unsupported] == ["it has no bounds to draw"]


def test_a_model_of_a_purpose_that_is_not_drawn_is_not_looked_into() -> None:
    """The bounds that are drawn are those of other purposes."""
    scene = read(model(mode("bounds"), name="a") + model(mode("bounds") + 'uniform token purpose = "guide"', name="b"))
    assert (paths(scene), scene.unsupported) == ({"/a"}, ())


def test_a_pass_hides_models_in_any_draw_mode() -> None:
    hides = """def RenderSettings "settings" {
    }
    def RenderPass "pass" {
        rel renderSource = </settings>
        uniform bool collection:renderVisibility:includeRoot = 1
        rel collection:renderVisibility:excludes = </b>
    }
    """
    text = model(mode("bounds"), name="a") + model(mode("bounds"), name="b") + hides
    assert paths(read(text, render_settings="/pass")) == {"/a"}


def test_an_instance_may_be_replaced() -> None:
    text = f"""class Xform "tree" (kind = "component") {{
        def Cube "trunk" {{}}
    }}
    def Xform "all" (kind = "group") {{
        {mode("bounds")}
        def "a" (
            instanceable = true
            inherits = </tree>
        ) {{}}
        def "b" (
            instanceable = true
            inherits = </tree>
        ) {{ {mode("default")} }}
    }}"""
    assert paths(read(text)) == {"/all/a", "/all/b/trunk"}


def test_prototypes_of_an_instancer_inherit_its_mode() -> None:
    text = f"""def PointInstancer "swarm" (kind = "group") {{
        {mode("bounds")}
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (5, 0, 0)]
        rel prototypes = </swarm/model>
        {model()}
    }}"""
    (drawable,) = read(text).drawables
    assert drawable.paths == ("/swarm/model",) and drawable.instance_ids.tolist() == [0] * 12 + [1] * 12


def test_a_stand_in_is_the_same_object_in_every_frame() -> None:
    stage: Usd.Stage = stage_of(model(mode("bounds")))
    reader = StageReader(stage)
    assert reader.read(1.0).meshes[0] is reader.read(2.0).meshes[0]


def test_cards_are_seen_from_one_side_only(scenes: Path, tmp_path: Path) -> None:
    """A single card, seen from its front and from behind."""
    body = mode("cards") + 'uniform token model:cardGeometry = "box"\n' + card("ZNeg", f"{scenes}/textures/tile.png")
    eye = 'def Camera "eye" {{\nfloat2 clippingRange = (0.1, 100)\n{}\n}}'
    (tmp_path / "far.usda").write_text("#usda 1.0\n" + model(body) + eye.format(move(z=20)))
    alpha = render(tmp_path / "far.usda", size=(9, 9)).layers["beauty"][4, 4, 3]
    assert alpha == 1.0, "its opposite shows the same texture"
    (tmp_path / "within.usda").write_text("#usda 1.0\n" + model(body) + eye.format(move()))
    assert render(tmp_path / "within.usda", size=(9, 9)).layers["beauty"][4, 4, 3] == 0.0


def test_draw_modes_are_where_usdview_draws_them(assets: Path) -> None:
    """The reference is a screenshot of usdview; parts of its cards are as grey as its background."""
    folder = assets / "wg_teapot"
    picture = read_image(folder / "reference" / "DrawModes.png")["beauty"][..., :3]
    assert picture.shape[:2] == (843, 1631)
    view = picture[217:700, 491:1619]
    lit = np.abs(view - view[5, 5]).max(axis=2) > 0.02
    film = render(folder / "DrawModes.usd", size=(view.shape[1], view.shape[0]), samples=4)
    covered = film.layers["beauty"][..., 3] > 0.0
    cards = slice(220, 360), slice(100, None)  # the width of lines differs, and the viewer draws a grid
    both = (lit & covered)[cards].sum()
    assert both / lit[cards].sum() > 0.99 and both / covered[cards].sum() > 0.8
