"""The table of output layers."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

from defshade_cli.image.layers import LAYERS, in_order


def test_the_table_is_keyed_by_name_and_starts_with_the_beauty() -> None:
    assert all(name == layer.name for name, layer in LAYERS.items())
    assert next(iter(LAYERS)) == "beauty"


def test_channel_names_differ_across_all_layers() -> None:
    names = [channel for layer in LAYERS.values() for channel in layer.channel_names]
    assert len(names) == len(set(names))
    assert LAYERS["beauty"].channel_names == ("R", "G", "B", "A")
    assert LAYERS["normal"].channel_names == ("normal.X", "normal.Y", "normal.Z")


def test_lengths_are_infinite_where_nothing_is_seen() -> None:
    assert {name for name, layer in LAYERS.items() if np.isinf(layer.background)} == {"depth", "distance"}


def test_order_is_the_tables() -> None:
    assert in_order(["normal", "depth", "beauty"]) == ("beauty", "depth", "normal")


def test_the_table_loads_no_image_library() -> None:
    code = "import defshade_cli.image.film, defshade_cli.image.layers, sys; sys.exit('OpenImageIO' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
