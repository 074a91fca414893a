"""IES profiles: every edition and symmetry of LM-63, what is wrong with a file in one sentence, and their light."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from build import at, beauty, bulb, quad, rotated, scene
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.light import ies_factor, irradiance_at
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.ies import IesError, IesProfile, parse_ies
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.shaping import Shaping
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.reader import StageReader
from stages import reasons, stage_of

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)


def ies(
    vertical: str, horizontal: str, candela: str, *, head: str = "IESNA91\n", tilt: str = "NONE", kind: int = 1
) -> str:
    counts = f"{len(vertical.split())} {len(horizontal.split())}"
    return f"{head}TILT={tilt}\n1 -1 1.0 {counts} {kind} 2 0.1 0.1 0\n1.0 1.0 10\n{vertical}\n{horizontal}\n{candela}\n"


AXIAL = ies("0 45 90", "0", "100 50 0")


# Parsing


@pytest.mark.parametrize(
    "head",
    [
        "Lamp of 1986\nwith no keywords\n",
        "IESNA91\n[TEST] 1\n[MORE] 2\n",
        "IESNA:LM-63-1995\n[TEST]\n",
        "IESNA:LM-63-2002\n[ISSUEDATE] 2002\n",
        "IES:LM-63-2019\n[TESTLAB] none\n",
        "",
    ],
)
def test_every_edition_is_read(head: str) -> None:
    profile = parse_ies(ies("0 45 90", "0", "100 50 0", head=head))
    assert profile.at([0, 22.5, 90, 91], 123).tolist() == [100, 75, 0, 0]


def test_numbers_may_be_parted_by_commas_and_wrapped_anywhere() -> None:
    text = AXIAL.replace("100 50 0", "100,\n 50 ,\r\n\t0").replace("TILT=NONE", "  tilt = NONE  ")
    assert parse_ies(text).candela.tolist() == parse_ies(AXIAL).candela.tolist()


def test_tilt_data_within_the_file_is_passed_over() -> None:
    text = AXIAL.replace("TILT=NONE\n", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8\n")
    assert parse_ies(text).peak == 100


def test_multiplier_and_ballast_scale_the_candela() -> None:
    text = AXIAL.replace("1 -1 1.0", "1 -1 2.0").replace("\n1.0 1.0 10\n", "\n0.5 0.25 10\n")
    assert parse_ies(text).peak == 100 * 2 * 0.5 * 0.25


@pytest.mark.parametrize(
    ("horizontal", "candela", "around"),
    [
        ("0", "7 7", {0: 7, 90: 7, 180: 7, 359: 7}),
        ("0 90", "1 1 2 2", {0: 1, 45: 1.5, 90: 2, 180: 1, 270: 2, 315: 1.5}),
        ("0 90 180", "1 1 2 2 3 3", {0: 1, 90: 2, 180: 3, 270: 2, 225: 2.5}),
        ("0 90 180 270 360", "1 1 2 2 3 3 4 4 1 1", {0: 1, 90: 2, 270: 4, 315: 2.5}),
        ("90 180 270", "1 1 2 2 3 3", {90: 1, 180: 2, 270: 3, 0: 2, 360: 2, 45: 1.5, 315: 2.5}),
        ("90 135 180 225 270", "1 1 2 2 3 3 4 4 5 5", {90: 1, 45: 2, 0: 3, 180: 3, 315: 4, 270: 5}),
    ],
)
def test_symmetric_files_are_unfolded(horizontal: str, candela: str, around: dict[int, float]) -> None:
    profile = parse_ies(ies("0 90", horizontal, candela))
    assert profile.at(30.0, list(around)).tolist() == pytest.approx(list(around.values()))


@pytest.mark.parametrize(
    ("kind", "candela"), [(2, "50 50 50 0 100 0 20 20 20"), (3, "0 50 0 0 100 0 0 20 0")], ids=["B", "A"]
)
def test_types_a_and_b_turn_about_an_axis_across(kind: int, candela: str) -> None:
    """Latitude of type A and longitude of type B go towards +Y, the other angle towards +X."""
    profile = parse_ies(ies("-90 0 90", "-90 0 90", candela, kind=kind))
    assert profile.at(0.0, 0.0) == pytest.approx(100)
    right, left = profile.at(90.0, 0.0), profile.at(90.0, 180.0)
    assert (right, left) == pytest.approx((20, 50))
    assert profile.at(90.0, 90.0) == pytest.approx(0, abs=1e-9) == profile.at(90.0, 270.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "it has no TILT line"),
        ("hello\nworld\n", "it has no TILT line"),
        (AXIAL[:60], "it ends amid its"),
        (AXIAL.replace("100 50 0", "100 50"), "it ends amid its candela values"),
        (AXIAL.replace("100 50 0", "100 fifty 0"), "'fifty' stands where a number should"),
        (AXIAL.replace("100 50 0", "100 nan 0"), "its candela values are not finite"),
        (AXIAL.replace("0 45 90", "0 90 45"), "its vertical angles do not ascend"),
        (ies("0 90", "0 100", "1 1 1 1"), "its horizontal angles go from 0 to 100"),
        (ies("0", "0", "1"), "it has one vertical angle"),
        (AXIAL.replace("1.0 3 1 1", "1.0 0 1 1"), "it has 0 vertical angles"),
        (AXIAL.replace("1.0 3 1 1", "1.0 3 -1 1"), "it has -1 horizontal angles"),
        (AXIAL.replace("1.0 3 1 1", "1.0 3 1 9"), "its photometric type is 9"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(text: str, sentence: str) -> None:
    with pytest.raises(IesError, match=sentence):
        parse_ies(text)


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet="0123456789.,- \nTILT=NONEabe[]", max_size=200))
def test_no_text_crashes_the_parser(text: str) -> None:
    try:
        profile = parse_ies(AXIAL[:30] + text)
    except IesError:
        return
    assert np.isfinite(profile.candela).all()


# Power


def test_the_mean_is_over_what_the_verticals_span() -> None:
    assert parse_ies(ies("0 90 180", "0", "5 5 5")).mean == pytest.approx(5)
    assert parse_ies(ies("0 45 90", "0", "5 5 5")).mean == pytest.approx(5)
    cosine = " ".join(f"{math.cos(math.radians(v)):.9f}" for v in range(91))
    assert parse_ies(ies(" ".join(map(str, range(91))), "0", cosine)).mean == pytest.approx(0.5, rel=1e-4)


def lamp(profile: IesProfile, turned: float = 0.0, **options: object) -> Light:
    """At (0.3, 0.2, 1.5), shining along −Z."""
    shaping = Shaping(cone_angle=180.0, ies=profile, **options)  # type: ignore[arg-type]
    return replace(bulb(0, 0, 0), world_from_light=at(0.3, 0.2, 1.5) @ rotated("z", turned), shaping=shaping)


def test_a_normalized_profile_keeps_the_power() -> None:
    """Over rings of equal area around the axis."""
    profile = parse_ies(ies("0 30 60 90 135 180", "0 90 180", "9 5 0 0 2 1 3 7 1 0 0 1 1 1 1 1 1 1"))
    z, turn = np.meshgrid((np.arange(400) + 0.5) / 200 - 1, (np.arange(200) + 0.5) / 200 * math.tau)
    directions = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=-1)
    shaping = Shaping(ies=profile, ies_normalize=True)
    assert ies_factor(shaping, np.eye(3), directions).mean() == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize(
    ("scale", "angle", "read_at"), [(0, 40, 40), (0.5, 40, 80), (2, 40, 20), (-2, 140, 160), (-0.5, 170, 160)]
)
def test_the_angle_scale_stretches_from_either_pole(scale: float, angle: float, read_at: float) -> None:
    """θ / scale, or (θ − π) / −scale + π: the schema's formula, in the shader's form and in the reference's."""
    vertical = " ".join(str(v) for v in range(0, 181, 10))
    profile = parse_ies(ies(vertical, "0", vertical))
    shaping = Shaping(ies=profile, ies_angle_scale=scale)
    a, b = shaping.ies_vertical
    assert math.degrees(a * math.radians(angle) + b) == pytest.approx(read_at)
    emitted = -np.array([[math.sin(math.radians(angle)), 0.0, math.cos(math.radians(angle))]])
    assert ies_factor(shaping, np.eye(3), emitted)[0] == pytest.approx(read_at)


# Light


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


@pytest.mark.parametrize("options", [{}, {"ies_angle_scale": 0.7}, {"ies_angle_scale": -1.5}, {"ies_normalize": True}])
def test_the_shader_reads_the_profile_as_the_reference_does(pipeline: Pipeline, options: dict) -> None:
    profile = parse_ies(ies("0 15 30 60 90 180", "0 90 180 270 360", " ".join(str(k % 24 % 13) for k in range(30))))
    plain, shaped = bulb(0.3, 0.2, 1.5), lamp(profile, 25.0, **options)
    render = RenderSettings(size=(64, 64), shadows=False, light_points=1)
    images = []
    for light in (plain, shaped):
        of = scene([quad(5.0)], [light], [WHITE])
        images.append(beauty(pipeline.render(of, make_plan(of, render)).layers)[..., 0])
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    points = np.stack([*np.meshgrid(x, -x), np.zeros((64, 64))], axis=-1).reshape(-1, 3)
    expected = (irradiance_at(shaped, points)[1] / irradiance_at(plain, points)[1])[:, 0].reshape(64, 64)
    np.testing.assert_allclose(images[1] / images[0], expected, rtol=2e-3, atol=2e-3 * profile.peak)


def test_profiles_are_read_from_a_stage(tmp_path: Path) -> None:
    (tmp_path / "lamp.ies").write_text(AXIAL, encoding="latin-1")
    (tmp_path / "torn.ies").write_text(AXIAL[:60], encoding="latin-1")
    text = "".join(
        f"""def SphereLight "{name}" (prepend apiSchemas = ["ShapingAPI"]) {{
            asset inputs:shaping:ies:file = @{tmp_path}/{name}.ies@
            float inputs:shaping:ies:angleScale = 0.5
            bool inputs:shaping:ies:normalize = 1
        }}
        """
        for name in ("lamp", "torn", "lost")
    )
    found = StageReader(stage_of('def Cube "cube" {}\n' + text)).read(None)
    shapings = {light.path: light.shaping for light in found.lights}
    good = shapings["/lamp"]
    assert good and good.ies and (good.ies.peak, good.ies_angle_scale, good.ies_normalize) == (100, 0.5, True)
    assert [shapings[path].ies for path in ("/torn", "/lost")] == [None, None]  # type: ignore[union-attr]
    assert "torn.ies is ignored: it ends amid its" in reasons(found, "/torn")[0]
    assert "lost.ies is ignored: there is no such file" in reasons(found, "/lost")[0]
