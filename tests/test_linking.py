"""Light and shadow linking: who is a member by the rules of USD's collections, and what it does to the light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pxr import Usd, UsdLux

from build import beauty, bulb, camera, drawable, quad, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.linking import ALL_LINKED, link_bits
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.environment import uniform_environment
from defshade_cli.scene.light import DomeLight, Light
from defshade_cli.scene.linking import Links
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import LAYOUTS, Layout, RenderSettings
from stages import TREE, instance, read, stage_of

GEOMETRY = """def Xform "set" {
    def Cube "a" {
    }
    def Xform "group" {
        def Cube "b" {
        }
        def Cube "c" {
        }
    }
}
def Cube "setting" {
}
"""
PATHS = ["/set/a", "/set/group/b", "/set/group/c", "/setting"]


def members(found: Scene, which: str = "lights", light: int = 0) -> set[str]:
    """Paths of all placements that a light lights, or that cast its shadows."""
    links = found.lights[light].links
    rows = [(p, s) for d in found.drawables for p, s in zip(d.paths, d.link_sets, strict=False)]
    return {path for path, link_set in rows if links is None or getattr(links, which)[link_set]}


# Membership


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("rel collection:lightLink:excludes = </set/group>", {"/set/a", "/setting"}),
        ("rel collection:lightLink:excludes = </set>", {"/setting"}),
        ("uniform bool collection:lightLink:includeRoot = 0", set()),
        (
            "uniform bool collection:lightLink:includeRoot = 0\nrel collection:lightLink:includes = </set/group>",
            {"/set/group/b", "/set/group/c"},
        ),
        (
            """uniform bool collection:lightLink:includeRoot = 0
            rel collection:lightLink:includes = [</set>, </set/group/c>]
            rel collection:lightLink:excludes = </set/group>""",
            {"/set/a", "/set/group/c"},
        ),
        (
            """uniform bool collection:lightLink:includeRoot = 0
            uniform token collection:lightLink:expansionRule = "explicitOnly"
            rel collection:lightLink:includes = [</set>, </set/group/c>]""",
            {"/set/group/c"},
        ),
        (
            """uniform bool collection:lightLink:includeRoot = 0
            pathExpression collection:lightLink:membershipExpression = "//c /setting" """,
            {"/set/group/c", "/setting"},
        ),
    ],
)
def test_membership_follows_the_collections_rules(body: str, expected: set[str]) -> None:
    found = read(f'{GEOMETRY}def SphereLight "light" {{\n{body}\n}}')
    assert members(found) == expected
    assert members(found, "casts") == set(PATHS)


def test_lights_that_leave_nothing_out_have_no_links() -> None:
    body = (
        'rel collection:lightLink:includes = </set>\nuniform token collection:lightLink:expansionRule = "expandPrims"'
    )
    found = read(f'{GEOMETRY}def SphereLight "light" {{\n{body}\n}}')
    assert found.lights[0].links is None and not found.light_linked
    assert all(not d.link_sets.any() for d in found.drawables)


def test_a_collection_may_include_another() -> None:
    text = f"""{GEOMETRY}def Scope "looks" (prepend apiSchemas = ["CollectionAPI:inner"]) {{
        rel collection:inner:includes = </set/group>
        rel collection:inner:excludes = </set/group/b>
    }}
    def SphereLight "light" {{
        uniform bool collection:shadowLink:includeRoot = 0
        rel collection:shadowLink:includes = </looks.collection:inner>
    }}"""
    found = read(text)
    assert members(found, "casts") == {"/set/group/c"}
    assert members(found) == set(PATHS)


targets = st.lists(st.sampled_from(["/", "/set", *PATHS, "/set/group", "/se"]), max_size=4, unique=True)


@settings(max_examples=60, deadline=None)
@given(targets, targets, st.booleans(), st.sampled_from(["expandPrims", "explicitOnly"]))
def test_runs_of_paths_agree_with_usds_own_answer(includes: list, excludes: list, root: bool, rule: str) -> None:
    includes, excludes = ([p for p in some if p != "/"] for some in (includes, excludes))
    stage = stage_of(GEOMETRY + 'def SphereLight "light" {\n}')
    link = UsdLux.LightAPI(stage.GetPrimAtPath("/light")).GetLightLinkCollectionAPI()
    link.GetIncludeRootAttr().Set(root)
    link.GetExpansionRuleAttr().Set(rule)
    link.GetIncludesRel().SetTargets(includes)
    link.GetExcludesRel().SetTargets(excludes)
    query = link.ComputeMembershipQuery()
    assert members(_read(stage)) == {path for path in PATHS if query.IsPathIncluded(path)}


def _read(stage: Usd.Stage) -> Scene:
    from defshade_cli.usd.reader import StageReader

    return StageReader(stage).read(None)


def test_instances_are_linked_one_by_one_and_their_lights_within_them() -> None:
    lamp = """def SphereLight "lamp" {
        uniform bool collection:lightLink:includeRoot = 0
        rel collection:lightLink:includes = </tree/trunk>
    }
    """
    tree = TREE.replace('class Xform "tree" {', 'class Xform "tree" {\n' + lamp, 1)
    sun_on_b = 'def DistantLight "sun" {\nrel collection:lightLink:excludes = </a>\n}'
    found = read(tree + instance("a") + instance("b") + sun_on_b)
    lit = {light.path: members(found, light=n) for n, light in enumerate(found.lights)}
    assert lit["/sun"] == {"/b/trunk", "/b/crown/leaves"}
    assert (lit["/a/lamp"], lit["/b/lamp"]) == ({"/a/trunk"}, {"/b/trunk"})


# Bits


def test_bits_hold_as_many_sets_as_there_are() -> None:
    rng = np.random.default_rng(3)
    rows = rng.random((4, 70)) < 0.5
    lights = [
        replace(sun(), links=Links(rows[0], rows[1])),
        sun(),
        replace(sun(), links=Links(rows[2], rows[3] | True)),
    ]
    bits = link_bits(lights)
    for light, row in ((lights[0], rows[0]), (lights[2], rows[2])):
        first = bits.lights[light]
        read_back = [bool(bits.words[first + s // 32] >> (s % 32) & 1) for s in range(70)]
        assert read_back == row.tolist()
    assert bits.casts[lights[2]] == ALL_LINKED and lights[1] not in bits.lights


# Light


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def render(pipeline: Pipeline, of: Scene, **options: object) -> NDArray[np.float64]:
    plan = make_plan(of, RenderSettings(size=(64, 64), **options))  # type: ignore[arg-type]
    return beauty(pipeline.render(of, plan).layers)


def pair(lights: list[Light], sets: tuple[int, int] = (0, 1)) -> Scene:
    """A floor, set 0, and a ball of set 1 before it, each placed once."""
    meshes = [quad(5.0, -1.0), sphere()]
    drawables = [
        replace(drawable(m, i), link_sets=np.array([s])) for i, (m, s) in enumerate(zip(meshes, sets, strict=True))
    ]
    return scene(meshes, lights, view=camera(6.0), drawables=drawables)


def only(*sets: int) -> NDArray[np.bool_]:
    return np.isin(np.arange(2), sets)


EVERYTHING = only(0, 1)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("kind", ["sun", "bulb", "cone"])
def test_a_light_lights_what_it_is_linked_to(pipeline: Pipeline, kind: str, layout: Layout) -> None:
    light = {"sun": sun(), "bulb": bulb(1, 1, 4), "cone": bulb(0, 0, 4, cone=60.0)}[kind]
    options = {"layout": layout, "shadows": False}
    whole = render(pipeline, pair([light]), **options)
    parts = [render(pipeline, pair([replace(light, links=Links(only(s), EVERYTHING))]), **options) for s in (0, 1)]
    np.testing.assert_allclose(parts[0] + parts[1], whole, rtol=1e-6)
    assert parts[0][32, 32].max() == 0 < parts[0][2, 2].max()
    assert parts[1][2, 2].max() == 0 < parts[1][32, 32].max()


@pytest.mark.parametrize("samples", [1, 4])
def test_a_dome_lights_what_it_is_linked_to(pipeline: Pipeline, samples: int) -> None:
    options = {"path": "/dome", "world_from_light": np.eye(4), "color": (1, 1, 1), "environment": uniform_environment()}
    dome = DomeLight(**options, links=Links(only(1), EVERYTHING))  # type: ignore[arg-type]
    image = render(pipeline, pair([dome]), samples=samples)
    assert image[2, 2].max() == 0 < image[32, 32].min()


@pytest.mark.parametrize("samples", [1, 4])
def test_only_linked_casters_shade(pipeline: Pipeline, samples: int) -> None:
    light = bulb(1.5, 1.5, 4, intensity=30)
    without = render(pipeline, pair([replace(light, links=Links(EVERYTHING, only(0)))]), samples=samples)
    floor_alone = replace(pair([light]), drawables=pair([light]).drawables[:1])
    floor = render(pipeline, replace(floor_alone, meshes=floor_alone.meshes[:1]), samples=samples)
    seen = np.isclose(without, floor, rtol=1e-3).all(-1)
    shaded = render(pipeline, pair([light]), samples=samples)
    assert (seen & (shaded < 0.5 * floor).all(-1)).sum() > 20, "the ball's shadow is gone"


def test_the_instances_of_one_mesh_may_differ(pipeline: Pipeline) -> None:
    from build import at

    ball = sphere(0.6)
    placed = replace(drawable(ball, where=[at(-1, 0, 0), at(1, 0, 0)]), link_sets=np.array([0, 1]))
    light = replace(sun(), links=Links(only(1), EVERYTHING))
    image = render(pipeline, scene([ball], [light], drawables=[placed]))
    assert image[:, :32].max() == 0 < image[32, 45].min()


def test_nothing_is_paid_for_where_nothing_links(pipeline: Pipeline) -> None:
    plan = make_plan(pair([sun()]), RenderSettings())
    assert "links" not in [plane.name for plane in plan.planes] and not plan.shadow_linked
    plan = make_plan(pair([replace(sun(), links=Links(EVERYTHING, only(0)))]), RenderSettings())
    assert "links" not in [plane.name for plane in plan.planes] and plan.shadow_linked
    plan = make_plan(pair([replace(sun(), links=Links(only(0), EVERYTHING))]), RenderSettings())
    assert "links" in [plane.name for plane in plan.planes] and not plan.shadow_linked
