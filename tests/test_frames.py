"""Frames from text and paths from patterns."""

from __future__ import annotations

import math
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import UsdUtils

from defshade_cli.errors import UsageError
from defshade_cli.farm.frames import MOST_FRAMES, parse_frames
from defshade_cli.farm.names import expand, has_frame_token, safe_name


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1", (1,)),
        ("-5", (-5,)),
        ("1.5", (1.5,)),
        ("1:5", (1, 2, 3, 4, 5)),
        ("5:1", (5, 4, 3, 2, 1)),
        ("1:10x2", (1, 3, 5, 7, 9)),
        ("10:1x-3", (10, 7, 4, 1)),
        ("-2:2x2", (-2, 0, 2)),
        ("1:10x20", (1,)),
        ("101:102x0.25", (101, 101.25, 101.5, 101.75, 102)),
        ("0:1x0.1", (0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1)),
        ("1:10x2,15", (1, 3, 5, 7, 9, 15)),
        ("15, 1:3", (15, 1, 2, 3)),
        ("1:3,2:4", (1, 2, 3, 4)),
        ("1-10x3", (1, 4, 7, 10)),
        ("1-3", (1, 2, 3)),
        ("-5--1x2", (-5, -3, -1)),
    ],
)
def test_frames_of_a_spec(text: str, frames: tuple[float, ...]) -> None:
    assert parse_frames(text) == frames


@pytest.mark.parametrize(
    "text",
    ["", ",", "1,", "a", "1:", ":5", "1:5x", "1:5x0", "1:5x-1", "5:1x2", "1:5:2", "1e1", "nan", "inf", "1 2", "1..5"],
)
def test_nonsense_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="frames"):
        parse_frames(text)


def test_negative_zero_is_zero() -> None:
    assert math.copysign(1, parse_frames("-0")[0]) == 1


@pytest.mark.parametrize(("text", "instead"), [("1-10:2", "1:10x2"), ("-4--2:1", "-4:-2x1")])
def test_ambiguous_dash_says_what_to_write(text: str, instead: str) -> None:
    with pytest.raises(UsageError, match=f"other frames in other tools.*write {instead}$"):
        parse_frames(text)


def test_endless_range_is_refused_before_it_is_built() -> None:
    with pytest.raises(UsageError, match=str(MOST_FRAMES)):
        parse_frames("0:1000000000000")


@given(st.text(alphabet="0123456789-:x,. e+af", max_size=12))
def test_any_text_is_frames_or_refused(text: str) -> None:
    try:
        frames = parse_frames(text)
    except UsageError:
        return
    assert 0 < len(frames) <= MOST_FRAMES
    assert all(math.isfinite(frame) for frame in frames)


numbers = st.integers(-4000, 4000).map(lambda quarters: quarters / 4)


@given(numbers, numbers, st.integers(1, 40).map(lambda quarters: quarters / 4))
def test_ranges_are_usds(start: float, end: float, stride: float) -> None:
    spec = f"{start}:{end}x{math.copysign(stride, end - start)}"
    usd = UsdUtils.TimeCodeRange.CreateFromFrameSpec(spec)
    assert parse_frames(spec) == tuple(code.GetValue() for code in usd)


@pytest.mark.parametrize(
    ("pattern", "frame", "path"),
    [
        ("a.####.exr", 7, "a.0007.exr"),
        ("a.####.exr", 12345, "a.12345.exr"),
        ("a.####.exr", -7, "a.-007.exr"),
        ("a.###.##.exr", 1.5, "a.001.50.exr"),
        ("a.##.#.exr", 1.0, "a.01.0.exr"),
        ("a.%04d.exr", 7, "a.0007.exr"),
        ("a.%d.exr", 7, "a.7.exr"),
        ("a.$F4.exr", 7, "a.0007.exr"),
        ("a.$F.exr", 7, "a.7.exr"),
        ("a.{frame}.exr", 1.25, "a.1.25.exr"),
        ("a.{frame}.exr", -0.0, "a.0.exr"),
        ("{scene}/{camera}.##.png", 7, "kitchen/World_Cam.07.png"),
        ("still.png", 7, "still.png"),
    ],
)
def test_expanded_patterns(pattern: str, frame: float, path: str) -> None:
    assert expand(pattern, frame=frame, scene="kitchen", camera="/World/Cam").as_posix() == path


@pytest.mark.parametrize("pattern", ["a.####.exr", "a.%04d.exr", "a.$F4.exr", "a.###.#.exr"])
def test_a_frame_that_its_token_cannot_tell_apart_is_refused(pattern: str) -> None:
    with pytest.raises(UsageError, match="neighbours"):
        expand(pattern, frame=1.25, scene="s", camera="c")


def test_tokens_that_cannot_be_filled_are_refused() -> None:
    with pytest.raises(UsageError, match="default time"):
        expand("a.####.exr", frame=None, scene="s", camera="c")
    with pytest.raises(UsageError, match=r"\{shot\} is none of"):
        expand("{shot}.exr", frame=1, scene="s", camera="c")


@pytest.mark.parametrize("pattern", ["a.#.exr", "a.%04d.exr", "a.$F4.exr", "a.{frame}.exr"])
def test_frame_tokens_are_found(pattern: str) -> None:
    assert has_frame_token(pattern)
    assert not has_frame_token("{scene}.{camera}.exr")


@given(st.text(alphabet=string.printable + "é/\\.\0"))
def test_names_stay_one_component(text: str) -> None:
    name = safe_name(text)
    assert name and not name.startswith(".") and not set(name) & set("/\\\0\n")
    assert expand("out/{scene}.exr", frame=1, scene=text, camera="c").parts[0] == "out"


@given(st.integers(-99999, 99999), st.integers(1, 6))
def test_padded_frames_read_back(frame: int, width: int) -> None:
    name = expand("#" * width, frame=frame, scene="s", camera="c").name
    assert int(name) == frame and len(name) >= width
