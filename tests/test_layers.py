"""The table of output layers."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from defshade_cli.errors import UsageError
from defshade_cli.image.layers import ALIASES, LAYERS, in_order, resolve


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


def test_aliases_lead_to_rows_and_hide_none() -> None:
    assert not set(ALIASES) & set(LAYERS)
    for theirs, ours in ALIASES.items():
        assert resolve([theirs]) == (LAYERS[ours].name,)


def test_a_request_names_each_layer_once() -> None:
    assert resolve(["Z", "depth", "RGBA"]) == ("depth", "beauty")
    assert resolve(["all"]) == resolve(["all", "depth"]) == tuple(LAYERS)


@pytest.mark.parametrize("names", [["shininess"], ["depth", "shininess"], []])
def test_an_unknown_name_lists_the_valid_on_one_line(names: list[str]) -> None:
    with pytest.raises(UsageError) as caught:
        resolve(names)
    assert all(name in str(caught.value) for name in LAYERS) and "\n" not in str(caught.value)
    assert ("shininess" in str(caught.value)) == bool(names)
