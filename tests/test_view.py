"""`defshade view`: what a file says of its layers, text that terminals draw, and the page in a browser."""

from __future__ import annotations

import base64
import os
import pty
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from browser import needs_browser, told_by
from defshade_cli.cli import defshade
from defshade_cli.cli.terminal import Form, best_form
from defshade_cli.errors import UsageError
from defshade_cli.image.colour import display_transform
from defshade_cli.image.cryptomatte import name_ids
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.inline import packed
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.look import look_at
from defshade_cli.image.stored import StoredImage, open_image
from defshade_cli.image.terminal import blocks, kitty, sixel
from defshade_cli.settings import OutputSettings
from films import film, layer_values

PATH = "/World/Chair"


def labelled_film() -> Film:
    """Noise, but for a chair that covers a half of pixel (5, 20) and has number 7 everywhere."""
    source = film("beauty", "depth", "normal", "primId", "cryptoObject")
    source.layers["primId"][...] = 7.0
    matte = source.layers["cryptoObject"]
    matte[...] = 0.0
    matte[20, 5, :2] = name_ids([PATH]).view(np.float32)[0], 0.5
    return replace(source, manifests={"primId": {7: PATH}, "cryptoObject": {int(name_ids([PATH])[0]): PATH}})


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    return write(labelled_film(), OutputSettings(), tmp_path / "shot.exr")[0]


def gradient(height: int = 20, width: int = 30) -> NDArray[np.float32]:
    y, x = np.mgrid[0 : 1 : height * 1j, 0 : 1 : width * 1j]
    return np.stack([x, y, 1.0 - x], axis=-1).astype(np.float32)


@pytest.mark.parametrize("multipart", [False, True])
def test_a_file_says_what_its_layers_are(tmp_path: Path, multipart: bool) -> None:
    (path,) = write(labelled_film(), OutputSettings(multipart=multipart), tmp_path / "shot.exr")
    image = open_image(path)
    assert tuple(image.layers) == ("beauty", "depth", "normal", "primId", "cryptoObject")
    assert image.rows["depth"] == LAYERS["depth"]
    assert image.manifests["primId"] == {7: PATH}
    assert list(image.manifests["cryptoObject"].values()) == [PATH]
    assert image.named(["Combined", "Z"]) == ("beauty", "depth")
    with pytest.raises(UsageError, match="has no layer albedo"):
        image.named(["albedo"])


def test_layers_by_other_programs_have_looks(tmp_path: Path) -> None:
    """Blender's names are known, colours are colours, and a single channel is stretched."""
    names = ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "heat.V"]
    spec = oiio.ImageSpec(8, 4, 4, "float")
    spec.channelnames = names
    values = np.random.default_rng(3).random((4, 8, 4), np.float32) * 900.0
    output = oiio.ImageOutput.create(str(tmp_path / "their.exr"))
    output.open(str(tmp_path / "their.exr"), spec)
    output.write_image(values)
    output.close()
    image = open_image(tmp_path / "their.exr")
    assert image.rows["ViewLayer.Combined"].is_color and image.rows["heat"].unit == "as stored"
    look = look_at(image.rows["heat"], image.layers["heat"], display_transform(), names={})
    assert "more is bright" in look.caption
    lightness, heat = look.colors.mean(axis=-1).ravel(), image.layers["heat"].ravel()
    assert (np.diff(lightness[np.argsort(heat)]) >= -1e-3).all()


def test_kitty_is_a_png_in_chunks() -> None:
    noise = np.random.default_rng(1).random((60, 80, 3), np.float32)
    chunks = re.findall(r"\x1b_G(.*?);(.*?)\x1b\\", kitty(noise))
    assert len(chunks) > 1 and all(len(chunk) <= 4096 for _, chunk in chunks)
    assert [keys for keys, _ in chunks] == ["a=T,f=100,m=1", *["m=1"] * (len(chunks) - 2), "m=0"]
    content = base64.b64decode("".join(chunk for _, chunk in chunks))
    assert content.startswith(b"\x89PNG")


def test_blocks_hold_two_pixels_each() -> None:
    colors = gradient(4, 5)
    lines = blocks(colors).splitlines()
    assert [line.count("▀") for line in lines] == [5, 5]
    numbers = [list(map(int, cell)) for cell in re.findall(r"38;2;(\d+);(\d+);(\d+);48;2;(\d+);(\d+);(\d+)m", lines[1])]
    expected = np.concatenate([colors[2], colors[3]], axis=-1) * 255.0
    assert np.abs(np.array(numbers) - expected).max() <= 0.5


def drawn_by_sixels(text: str) -> NDArray[np.float64]:
    """(H, W, 3) what a terminal makes of them, −1 where nothing is drawn."""
    width, height = map(int, re.match(r'\x1bP0;1q"1;1;(\d+);(\d+)', text).groups())  # type: ignore[union-attr]
    palette = {int(i): rgb for i, *rgb in re.findall(r"#(\d+);2;(\d+);(\d+);(\d+)", text)}
    body = re.sub(r'^.*?"[\d;]+', "", re.sub(r"#\d+;2;\d+;\d+;\d+", "", text)).removesuffix("\x1b\\\n")
    image = np.full((height + 6, width, 3), -1.0)
    for band, row in enumerate(body.split("-")):
        for index, letters in re.findall(r"#(\d+)([^#$]*)", row):
            spelled = re.sub(r"!(\d+)(.)", lambda run: run[2] * int(run[1]), letters)
            for x, letter in enumerate(spelled):
                for bit in range(6):
                    if ord(letter) - 63 >> bit & 1:
                        image[6 * band + bit, x] = np.array(palette[int(index)], float) / 100.0
    assert (image[height:] == -1.0).all()
    return image[:height]


def test_sixels_draw_the_picture() -> None:
    """Each pixel once, within a shade of its colour, and the mean over a neighbourhood much closer."""
    colors = gradient(32, 48)
    drawn = drawn_by_sixels(sixel(colors))
    assert (drawn >= 0.0).all()
    assert np.abs(drawn - colors).max() <= 1.0 / 5.0 + 0.01
    means = (drawn - colors).reshape(8, 4, 12, 4, 3).mean(axis=(1, 3))
    assert np.abs(means).max() < 0.03


@contextmanager
def terminal_that_says(answer: bytes) -> Iterator[int]:
    """The user's end of a terminal that gives this answer once it is asked for its attributes."""
    far, near = pty.openpty()

    def reply() -> None:
        heard = b""
        while not heard.endswith(b"\x1b[c"):
            heard += os.read(far, 1024)
        os.write(far, answer)

    listener = threading.Thread(target=reply, daemon=True)
    listener.start()
    yield near
    listener.join(5.0)
    os.close(near)
    os.close(far)


@pytest.mark.parametrize(
    ("answer", "form"),
    [
        (b"\x1b_Gi=31;OK\x1b\\\x1b[?62;4c", "kitty"),
        (b"\x1b[?62;4;22c", "sixel"),
        (b"\x1b[?64;1;2c", "blocks"),
        (b"", "blocks"),
    ],
)
def test_the_terminal_is_asked(monkeypatch: pytest.MonkeyPatch, answer: bytes, form: Form) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    with terminal_that_says(answer) as descriptor:
        assert best_form(descriptor, patience=0.3) == form


def test_a_pipe_gets_blocks(shot: Path) -> None:
    result = CliRunner().invoke(defshade, ["view", str(shot)], color=True)
    assert result.exit_code == 0, result.output
    *lines, told = result.output.splitlines()
    assert len(lines) == 11 and all(line.count("▀") == 37 for line in lines)
    assert told.endswith("37x21  beauty; also depth, normal, primId, cryptoObject")


def test_exposure_is_of_light(shot: Path) -> None:
    bright, dark = (
        CliRunner().invoke(defshade, ["view", str(shot), "--exposure", stops]).output for stops in ["5", "0"]
    )
    assert bright != dark
    args = ["view", str(shot), "--layers", "depth", "--exposure"]
    assert CliRunner().invoke(defshade, [*args, "5"]).output == CliRunner().invoke(defshade, [*args, "0"]).output


def test_what_is_not_there_is_said(shot: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(defshade, ["view", str(shot), "--layers", "depht"])
    assert "has no layer depht; it has beauty, depth" in str(result.exception)
    result = CliRunner().invoke(defshade, ["view", str(tmp_path / "none.exr")])
    assert "no such file" in str(result.exception)


@pytest.mark.parametrize(("values", "size"), [(layer_values("depth"), 4), (np.float32([[[0.5], [np.inf]]]), 2)])
def test_packing_takes_halves_only_where_nothing_is_lost(values: NDArray[np.float32], size: int) -> None:
    assert packed(values).size == size


def test_the_page_is_one_file(shot: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(defshade, ["view", str(shot), "--html", str(tmp_path / "shot.html")])
    assert result.output.strip() == str(tmp_path / "shot.html")
    page = (tmp_path / "shot.html").read_text()
    assert "http" not in page and "{{" not in page and 'src="' not in page


DRIVE = """
  const all = selector => [...document.querySelectorAll(selector)];
  const until = async done => { while (!done()) await new Promise(rest => setTimeout(rest, 20)); };
  const shown = name => until(() => document.body.dataset.shown === name);
  const click = name => all("nav button").find(button => button.textContent === name).click();
  const pixels = (...box) => [...context.getImageData(...box).data].filter((_, i) => i % 4 < 3);
  const slider = document.getElementById("stops");
  await shown("beauty");
  const box = canvas.getBoundingClientRect();
  const told = {layers: all("#layers button").map(button => button.textContent), size: [canvas.width, canvas.height]};
  told.beauty = pixels(0, 0, 37, 21);
  const place = {clientX: Math.ceil(box.left - 0.5) + 5, clientY: Math.ceil(box.top - 0.5) + 20};
  canvas.dispatchEvent(new PointerEvent("click", {bubbles: true, ...place}));
  await until(() => all("#probe tr").length);
  told.where = document.getElementById("where").textContent;
  told.probe = Object.fromEntries(all("#probe tr").map(row => [...row.children].map(cell => cell.textContent)));
  slider.value = 2;
  slider.dispatchEvent(new Event("input"));
  await shown("beauty");
  told.brighter = pixels(0, 0, 37, 21);
  told.stops = document.getElementById("told").textContent;
  click("depth");
  await shown("depth");
  told.depth = pixels(5, 20, 1, 1);
  told.data = [slider.disabled, !document.getElementById("legend").hidden];
  tell(told);
"""


def off_by(told: list[int], image: StoredImage, name: str, stops: float = 0.0) -> NDArray[np.float64]:
    """How far the page's bytes are from the layer's look, `stops` brighter."""
    brighter = image.layers[name] * np.float32([2.0**stops] * 3 + [1.0]) if stops else image.layers[name]
    look = look_at(image.rows[name], brighter, display_transform(), names={})
    return np.abs(np.array(told).reshape(look.colors.shape) - 255.0 * look.colors)


@needs_browser
def test_the_page_in_a_browser(shot: Path, tmp_path: Path) -> None:
    """Its picture is the display transform's, with any exposure; the probe has the file's own values."""
    CliRunner().invoke(defshade, ["view", str(shot), "--html", str(tmp_path / "shot.html")], catch_exceptions=False)
    told = told_by(tmp_path / "shot.html", DRIVE)
    image = open_image(shot)
    assert told["layers"] == list(image.layers) and told["size"] == [37, 21]
    for stops, key in ((0.0, "beauty"), (2.0, "brighter")):
        off = off_by(told[key], image, "beauty", stops)
        assert off.mean() < 0.5 and np.quantile(off, 0.99) < 2.0
    depth = look_at(image.rows["depth"], image.layers["depth"], display_transform(), names={})
    assert np.abs(np.array(told["depth"]) - 255.0 * depth.colors[20, 5]).max() <= 0.51
    assert (told["stops"], told["data"], told["where"]) == ("+2", [True, True], "pixel 5, 20 (held)")
    for name in ("beauty", "depth", "normal"):
        values = np.array(told["probe"][name].split(), float)
        assert values == pytest.approx(image.layers[name][20, 5], rel=1e-5)
    assert told["probe"]["primId"] == f"7  {PATH}"
    assert told["probe"]["cryptoObject"] == f"{PATH} 0.5"
