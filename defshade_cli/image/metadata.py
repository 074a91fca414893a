"""What a file's header says about its picture, under OpenEXR's standard names where there is one.

    colour     chromaticities, colorInteropID
    camera     worldToCamera, worldToNDC, screenWindowCenter, screenWindowWidth, pixelAspectRatio
    time       framesPerSecond, timeCode, capDate, utcOffset
    people     owner (Film.metadata's), comments, Software
    defshade/  scene, camera, frame, samples and all of Film.metadata; layers: what each one's numbers mean, as JSON;
               LAYER/manifest: what ids stand for, as JSON
    cryptomatte/  as its specification has them

Definitions: OpenEXR, "Standard Attributes". Matrices there act on row vectors, and its camera space is left-handed with
+z into the picture: USD's with z mirrored.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from defshade_cli import __version__
from defshade_cli.image.film import Film
from defshade_cli.image.layers import Layer
from defshade_cli.scene.camera import Camera
from defshade_cli.spaces import Matrix

PREFIX = "defshade/"


class Attribute(NamedTuple):
    """One header entry. type: OpenImageIO's name of it."""

    name: str
    type: str
    value: Any


def exr_attributes(film: Film, layers: tuple[str, ...]) -> Iterator[Attribute]:
    """All that an EXR with these layers carries, its colour space and compression apart."""
    chromaticities = film.render_space.chromaticities
    if chromaticities and any(film.row(name).is_color for name in layers):
        yield Attribute("chromaticities", "float[8]", chromaticities)
    yield from _camera(film)
    yield Attribute("FramesPerSecond", "rational", frame_rate(film.frames_per_second))
    if (code := time_code(film.frame, film.frames_per_second)) is not None:
        yield Attribute("smpte:TimeCode", "timecode", (code, 0))
    yield from text_attributes(film)
    for name, value in provenance(film).items():
        yield _attribute(PREFIX + name, value)
    yield Attribute(f"{PREFIX}layers", "string", json.dumps({name: _meaning(film.row(name)) for name in layers}))
    for name in layers:
        if name in film.manifests:
            yield from _manifest(film.row(name), film.manifests[name])


def _meaning(layer: Layer) -> dict[str, str | bool]:
    """For people and JSON parsers alike: an infinite background is the word inf."""
    return {
        "unit": layer.unit,
        "space": layer.space,
        "background": f"{layer.background:g}",
        "antialiased": layer.filtered,
    }


def _manifest(layer: Layer, names: dict[int, str]) -> Iterator[Attribute]:
    if layer.source != "matte":
        yield Attribute(f"{PREFIX}{layer.name}/manifest", "string", json.dumps(names))
        return
    from defshade_cli.image.cryptomatte import cryptomatte_header

    for key, value in cryptomatte_header(layer.exr_name, names).items():
        yield Attribute(key, "string", value)


def text_attributes(film: Film) -> Iterator[Attribute]:
    """What most formats can hold: software, date, owner, and the provenance as lines of text."""
    now = time.localtime()
    yield Attribute("Software", "string", f"defshade {__version__}")
    yield Attribute("DateTime", "string", time.strftime("%Y:%m:%d %H:%M:%S", now))
    yield Attribute("utcOffset", "float", float(-now.tm_gmtoff))
    facts = provenance(film)
    if "owner" in facts:
        yield Attribute("Copyright", "string", str(facts["owner"]))
    yield Attribute("ImageDescription", "string", "\n".join(f"{name}: {value}" for name, value in facts.items()))


def provenance(film: Film) -> dict[str, str | int | float]:
    """Where the picture comes from; nested values of Film.metadata as JSON."""
    facts: dict[str, Any] = {"scene": film.scene_name, "camera": film.camera.path, "samples": film.samples}
    if film.frame is not None:
        facts["frame"] = film.frame
    facts |= film.metadata
    return {
        name: value if isinstance(value, str | int | float) else json.dumps(value)
        for name, value in facts.items()
        if value is not None
    }


def read_provenance(header: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """The `defshade/…` facts of a header, without the prefix; from the lines of its description where it has none."""
    entries = dict(header)
    facts = {name.removeprefix(PREFIX): value for name, value in entries.items() if name.startswith(PREFIX)}
    lines = str(entries.get("ImageDescription", "")).splitlines()
    described = dict(line.split(": ", 1) for line in lines if ": " in line)
    return described | facts


def frame_rate(frames_per_second: float) -> tuple[int, int]:
    """(numerator, denominator), with NTSC's rates (24000/1001 …) found behind their decimals."""
    from fractions import Fraction

    ntsc = Fraction(round(frames_per_second * 1.001) * 1000, 1001)
    exact = ntsc if abs(float(ntsc) - frames_per_second) < 5e-4 else Fraction(frames_per_second)
    rate = exact.limit_denominator(1001)
    return rate.numerator, rate.denominator


def time_code(frame: float | None, frames_per_second: float) -> int | None:
    """Frame 0 is 00:00:00:00, in SMPTE 12M's digits as OpenEXR packs them: frames, seconds, minutes, hours.

    None for the default time, parts of frames, negative ones, and what a day does not hold.
    """
    rate = round(frames_per_second)
    if frame is None or frame < 0 or frame != int(frame) or rate < 1:
        return None
    seconds, frames = divmod(int(frame), rate)
    minutes, hours = seconds // 60, seconds // 3600
    if hours > 23 or frames > 39:
        return None
    fields = (frames, seconds % 60, minutes % 60, hours)
    return sum((value // 10 * 16 + value % 10) << 8 * place for place, value in enumerate(fields))


def world_to_camera(camera: Camera) -> Matrix:
    """(4, 4) for row vectors: `p_camera = p_world @ matrix`, left-handed, +z ahead."""
    return (np.diag([1.0, 1.0, -1.0, 1.0]) @ camera.camera_from_world).T


def world_to_ndc(camera: Camera) -> Matrix:
    """(4, 4) for row vectors; after the divide (0, 0) is the top left of the image and (1, 1) its bottom right.

    z is without meaning, as the standard has it.
    """
    left, right, bottom, top = camera.window
    width, height = right - left, top - bottom
    ahead = [0.0, 0.0, 1.0, 0.0]
    if camera.projection == "perspective":
        across, down = [1 / width, 0, -left / width, 0], [0, -1 / height, top / height, 0]
        ndc_from_camera = np.array([across, down, ahead, ahead])
    else:
        across, down = [1 / width, 0, 0, -left / width], [0, -1 / height, 0, top / height]
        ndc_from_camera = np.array([across, down, ahead, [0.0, 0.0, 0.0, 1.0]])
    return world_to_camera(camera) @ ndc_from_camera.T


def _camera(film: Film) -> Iterator[Attribute]:
    camera = film.camera
    left, right, bottom, top = camera.window
    width, height = film.display_size
    yield Attribute("worldToCamera", "matrix", _floats(world_to_camera(camera)))
    yield Attribute("worldToNDC", "matrix", _floats(world_to_ndc(camera)))
    yield Attribute("screenWindowCenter", "float2", (0.5 * (left + right), 0.5 * (bottom + top)))
    yield Attribute("screenWindowWidth", "float", right - left)
    yield Attribute("PixelAspectRatio", "float", round(camera.aspect * height / width, 6))


def _floats(matrix: Matrix) -> tuple[float, ...]:
    return tuple(float(value) for value in matrix.ravel())


def _attribute(name: str, value: str | int | float) -> Attribute:
    if isinstance(value, str):
        return Attribute(name, "string", value)
    if isinstance(value, int) and abs(value) < 2**31:
        return Attribute(name, "int", int(value))
    return Attribute(name, "float", float(value))
