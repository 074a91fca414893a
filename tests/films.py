"""Films of noise, for tests of what becomes of a finished frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.film import Film
from defshade_cli.image.layers import LAYERS
from defshade_cli.scene.camera import Camera

WIDTH, HEIGHT = 37, 21
WINDOW = (-0.5, 0.3, -0.2, 0.25)


def tilted_camera(**options: Any) -> Camera:
    """Off every axis, with an off-centre window."""
    u, _, vt = np.linalg.svd(np.random.default_rng(7).normal(size=(3, 3)))
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    world_from_camera[:3, 3] = 3.0, -2.0, 11.0
    return Camera("/World/Cam", world_from_camera, WINDOW, **options)


def layer_values(name: str, size: tuple[int, int] = (WIDTH, HEIGHT)) -> NDArray[np.float32]:
    """(H, W, C) of a layer's kind: depth with its infinite background, colour past 1, alpha within 0..1."""
    layer, rng = LAYERS[name], np.random.default_rng(sum(map(ord, name)))
    shape = (size[1], size[0], len(layer.channels))
    values = rng.random(shape, np.float32)
    if layer.is_color:
        values[..., :3] *= 4.0
    elif layer.unit == "unit vector":
        values = 2.0 * values - 1.0
    elif layer.unit == "scene units":
        values *= 1e4
    values[: size[1] // 4] = layer.background
    return values


def film(*names: str, size: tuple[int, int] = (WIDTH, HEIGHT), **fields: Any) -> Film:
    """A film with these layers, or with all of the table's."""
    layers = {name: layer_values(name, size) for name in names or LAYERS}
    fields.setdefault("metadata", {"command": "defshade render a.usda", "stage hash": "0123abcd", "seconds": 1.5})
    return Film(layers, tilted_camera(), "kitchen", frame=12.0, samples=16, **fields)


def with_beauty(values: NDArray) -> Film:
    """A film of these pixels, (H, W, 3 or 4)."""
    return replace(film("beauty"), layers={"beauty": np.asarray(values, np.float32)})
