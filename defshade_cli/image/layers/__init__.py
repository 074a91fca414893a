"""The output layers: one table from which --layers, the docs, `inspect` and the EXR metadata come.

table   the rows        layer   what a row says
names   what other renderers call them, and how a request becomes rows
"""

from defshade_cli.image.layers.layer import (
    AS_STORED,
    BEAUTY,
    ID,
    MAIN_PART,
    SCENE_LINEAR,
    SCENE_UNITS,
    UNIT_VECTOR,
    Layer,
)
from defshade_cli.image.layers.names import ALIASES, LAYERS, in_order, layer_in_file, resolve
from defshade_cli.image.layers.table import DEFAULT_GROUP, FAMILIES, LIGHT_FAMILY, PRIMVAR_FAMILY

__all__ = [
    "ALIASES",
    "AS_STORED",
    "BEAUTY",
    "DEFAULT_GROUP",
    "FAMILIES",
    "ID",
    "LAYERS",
    "LIGHT_FAMILY",
    "MAIN_PART",
    "PRIMVAR_FAMILY",
    "SCENE_LINEAR",
    "SCENE_UNITS",
    "UNIT_VECTOR",
    "Layer",
    "in_order",
    "layer_in_file",
    "resolve",
]
