"""Cryptomatte 1.2: hashes, coverage, and files that its readers understand."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import camera, drawable, quad, scene, sphere, sun
from defshade_cli import render
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.cryptomatte import Coverage, cryptomatte_header, murmur3_32, name_ids
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.reading import read
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import OutputSettings, RenderSettings

GLASS = Material("/glass", opacity=0.4)


def through_the_ball() -> Scene:
    """A half transparent ball over the edge of a wall."""
    wall = replace(drawable(quad(1.5)), paths=("/wall",))
    ball = replace(drawable(sphere(), 1, material=1), paths=("/sphère [1]",))
    return scene([quad(1.5), sphere()], [sun()], [Material("/stone"), GLASS], camera(5.0, 0.5), [wall, ball])


@pytest.fixture(scope="module")
def film(gpu: Gpu) -> Film:
    of = through_the_ball()
    layers = ("beauty", "cryptoObject", "cryptoMaterial")
    return Pipeline(gpu).render(of, make_plan(of, RenderSettings(size=(40, 40), samples=16, layers=layers)))


@pytest.mark.parametrize(
    ("text", "digest"),
    [
        ("", 0),
        ("hello", 0x248BFA47),
        ("Hello, world!", 0xC0363E43),
        ("The quick brown fox jumps over the lazy dog", 0x2E4FF723),
    ],
)
def test_murmur3_of_known_texts(text: str, digest: int) -> None:
    assert murmur3_32([text, "another, longer one"])[0] == digest


@given(st.lists(st.text(max_size=40).filter(lambda text: "\0" not in text), min_size=1, max_size=8))
def test_murmur3_of_many_is_that_of_each(texts: list[str]) -> None:
    assert murmur3_32(texts).tolist() == [_murmur3(text.encode()) for text in texts]


def _murmur3(data: bytes) -> int:
    """MurmurHash3_x86_32 as its author wrote it."""
    mask, h = 0xFFFFFFFF, 0

    def scrambled(k: int) -> int:
        k = k * 0xCC9E2D51 & mask
        return ((k << 15 | k >> 17) & mask) * 0x1B873593 & mask

    whole = len(data) // 4 * 4
    for start in range(0, whole, 4):
        h ^= scrambled(int.from_bytes(data[start : start + 4], "little"))
        h = ((h << 13 | h >> 19) & mask) * 5 + 0xE6546B64 & mask
    if whole < len(data):
        h ^= scrambled(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        h = (h ^ h >> shift) * factor & mask
    return h


def test_ids_are_those_of_the_specification() -> None:
    """The examples of its reference implementation's tests."""
    known = {"hello": 6.0705627102400005616e-17, "cube": -4.08461912519e15, "sphere": 2.79018604383e15}
    ids = name_ids(list(known)).view(np.float32)
    np.testing.assert_allclose(ids, list(known.values()), rtol=1e-7)


def test_ids_are_finite_and_normal_floats() -> None:
    ids = name_ids([f"/World/prim_{i}" for i in range(20_000)]).view(np.float32)
    assert np.isfinite(ids).all() and (np.abs(ids) >= np.finfo(np.float32).tiny).all()


@given(st.lists(st.lists(st.integers(-1, 4), min_size=3, max_size=3), min_size=1, max_size=12))
def test_coverage_counts_every_sample(samples: list[list[int]]) -> None:
    """Of three pixels, each against a count of its own."""
    coverage, ids = Coverage(5), name_ids([f"n{i}" for i in range(5)])
    for sample in samples:
        coverage.add(np.array(sample, np.int32))
    ranked = coverage.ranked(ids, 6, len(samples), 3)
    for pixel, pairs in enumerate(ranked.reshape(3, 6, 2)):
        counted = Counter(sample[pixel] for sample in samples if sample[pixel] >= 0)
        found = {bits: share for bits, share in zip(pairs[:, 0].view(np.uint32), pairs[:, 1], strict=True) if share}
        assert found == {ids[n]: np.float32(count / len(samples)) for n, count in counted.items()}
        assert (np.diff(pairs[:, 1]) <= 0).all()


def test_more_ids_than_slots_cost_no_memory() -> None:
    coverage = Coverage(2)
    for number in range(10):
        coverage.add(np.full(4, number, np.int32))
    assert coverage.seen().tolist() == [0, 1]


@pytest.mark.parametrize("name", ["cryptoObject", "cryptoMaterial"])
def test_mattes_sum_to_alpha(film: Film, name: str) -> None:
    """Opacity included: a ball of 0.4 beyond the wall's edge covers as much of it."""
    coverage = film.layers[name][..., 1::2]
    np.testing.assert_allclose(coverage.sum(axis=-1), film.layers["beauty"][..., 3], atol=1e-6)
    assert len(np.unique(film.layers[name][..., ::2])) == 3
    assert (np.diff(coverage, axis=-1) <= 0).all()


def test_a_matte_is_the_coverage_of_its_prim(film: Film) -> None:
    """The ball's centre: 0.4 of it and 0.6 of the wall behind, give or take the coins of 16 samples."""
    bits, coverage = film.layers["cryptoObject"][20, 20, ::2].view(np.uint32), film.layers["cryptoObject"][20, 20, 1::2]
    shares = {film.manifests["cryptoObject"][int(b)]: c for b, c in zip(bits, coverage, strict=True) if c}
    assert shares.keys() == {"/wall", "/sphère [1]"}
    assert sum(shares.values()) == 1.0


@pytest.mark.parametrize("options", [{}, {"compression": "dwaa"}, {"multipart": True}])
def test_files_hold_what_a_reader_of_cryptomatte_looks_for(film: Film, options: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write(film, OutputSettings(**options), path)
    for channels, header in (_by_openimageio(path), _by_openexr(path)):
        for name in ("CryptoObject", "CryptoMaterial"):
            mattes = _decoded(name, channels, header)
            assert set(mattes) == set(film.manifests[name[0].lower() + name[1:]].values())
            np.testing.assert_allclose(sum(mattes.values()), film.layers["beauty"][..., 3], atol=1e-6)
    np.testing.assert_array_equal(read(path)["cryptoObject"], film.layers["cryptoObject"])


def _decoded(name: str, channels: dict[str, NDArray], header: dict[str, str]) -> dict[str, NDArray]:
    """The matte of each name in the manifest, by the specification alone."""
    (prefix,) = (key.rpartition("/")[0] for key, value in header.items() if key.endswith("/name") and value == name)
    assert header[f"{prefix}/hash"] == "MurmurHash3_32" and header[f"{prefix}/conversion"] == "uint32_to_float32"
    manifest = json.loads(header[f"{prefix}/manifest"])
    pairs = [
        (channels[f"{name}{g:02d}.{i}"], channels[f"{name}{g:02d}.{c}"]) for g in range(3) for i, c in ("RG", "BA")
    ]
    mattes = {}
    for text, digits in manifest.items():
        bits = np.uint32(int(digits, 16))
        mattes[text] = sum(np.where(ids.view(np.uint32) == bits, coverage, 0.0) for ids, coverage in pairs)
        assert (mattes[text] > 0).any()
    return mattes


def _by_openimageio(path: Path) -> tuple[dict[str, NDArray], dict[str, str]]:
    source, channels, header, part = oiio.ImageInput.open(str(path)), {}, {}, 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
        channels |= {name: np.ascontiguousarray(pixels[..., i]) for i, name in enumerate(spec.channelnames)}
        header |= {a.name: a.value for a in spec.extra_attribs if a.name.startswith("cryptomatte/")}
        part += 1
    return channels, header


def _by_openexr(path: Path) -> tuple[dict[str, NDArray], dict[str, str]]:
    library = pytest.importorskip("OpenEXR")
    channels, header = {}, {}
    for part in library.File(str(path), separate_channels=True).parts:
        channels |= {name: channel.pixels for name, channel in part.channels.items()}
        header |= {key: value for key, value in part.header.items() if key.startswith("cryptomatte/")}
    return channels, header


def test_the_header_of_a_layer_is_known_by_its_hash() -> None:
    header = cryptomatte_header("CryptoObject", {0x12345678: "a"})
    prefix = f"cryptomatte/{int(murmur3_32(['CryptoObject'])[0]):08x}"[:19]
    assert header[f"{prefix}/manifest"] == '{"a":"12345678"}'
    assert all(len(key) <= 31 for key in header)


@pytest.mark.parametrize("ranks", [2, 4, 16])
def test_levels_are_chosen(ranks: int, gpu: Gpu, tmp_path: Path) -> None:
    of = through_the_ball()
    settings = RenderSettings(size=(16, 16), samples=4, layers=("cryptoObject",), cryptomatte_levels=ranks)
    found = Pipeline(gpu).render(of, make_plan(of, settings))
    assert found.layers["cryptoObject"].shape[2] == 2 * ranks
    write(found, OutputSettings(verify=True), tmp_path / "a.exr")


def test_assets_are_components(tmp_path: Path) -> None:
    stage = tmp_path / "a.usda"
    stage.write_text("""#usda 1.0
def Xform "Set" (kind = "assembly") {
    def Xform "Chair" (kind = "component") {
        def Sphere "seat" {
        }
        def Xform "parts" {
            def Cube "leg" {
            }
        }
    }
    def Sphere "loose" {
        double3 xformOp:translate = (3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""")
    film = render(stage, size=(32, 16), layers=("cryptoAsset", "cryptoObject"))
    assert set(film.manifests["cryptoAsset"].values()) == {"/Set/Chair", "/Set"}
    assert "/Set/Chair/parts/leg" in film.manifests["cryptoObject"].values()


def test_mattes_are_blurred_by_motion_and_names_keep_their_numbers(tmp_path: Path) -> None:
    """A ball that flies across while the shutter is open, and another that appears in the middle of it."""
    stage = tmp_path / "a.usda"
    stage.write_text("""#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 2
)
def Sphere "late" {
    token visibility.timeSamples = { 0.9: "invisible", 1.1: "inherited" }
    double3 xformOp:translate = (0, 2.5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "flying" {
    double3 xformOp:translate.timeSamples = { 0.5: (-2, 0, 0), 1.5: (2, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "cam" {
    float2 clippingRange = (1, 100)
    double shutter:open = -0.4
    double shutter:close = 0.4
    double3 xformOp:translate = (0, 1, 24)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""")
    film = render(stage, frame=1.0, size=(64, 48), samples=32, layers=("beauty", "cryptoObject"))
    coverage = film.layers["cryptoObject"][..., 1::2].sum(axis=-1)
    np.testing.assert_allclose(coverage, film.layers["beauty"][..., 3], atol=1e-5)
    assert set(film.manifests["cryptoObject"].values()) == {"/late", "/flying"}
    assert ((coverage > 0.1) & (coverage < 0.9)).sum() > 30
