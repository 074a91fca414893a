"""What layers are called elsewhere, and how a request for some becomes rows of the table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from defshade_cli.errors import UsageError
from defshade_cli.image.layers.layer import Layer
from defshade_cli.image.layers.table import FAMILIES, LIGHT_FAMILY, ROWS, family_row

ALIASES: dict[str, str] = {
    # Hydra: HdAovTokens
    "color": "beauty",
    "cameraDepth": "depth",
    # RenderMan
    "Ci": "beauty",
    "a": "alpha",
    "z": "depth",
    "Nn": "normal",
    # Karma
    "C": "beauty",
    "ray:hitP": "position",
    "ray:hitN": "normal",
    "ray:hitPz": "depth",
    # Omniverse
    "LdrColor": "beauty",
    "HdrColor": "beauty",
    # files
    "rgba": "beauty",
    "rgb": "beauty",
    # Arnold
    "RGBA": "beauty",
    "A": "alpha",
    "Z": "depth",
    "P": "position",
    "N": "normal",
    "Ng": "geometricNormal",
    "ID": "primId",
    "motionvector": "motionForward",
    "crypto_object": "cryptoObject",
    "crypto_material": "cryptoMaterial",
    "crypto_asset": "cryptoAsset",
    # Blender: names of passes
    "Combined": "beauty",
    "Alpha": "alpha",
    "Depth": "depth",
    "Position": "position",
    "Normal": "normal",
    "UV": "uv",
    "DiffDir": "diffuse",
    "GlossDir": "specular",
    "Shadow": "shadow",
    "DiffCol": "albedo",
    "Emit": "emission",
    "Vector": "motionForward",
    "IndexMA": "materialId",
    "CryptoObject": "cryptoObject",
    "CryptoMaterial": "cryptoMaterial",
    "CryptoAsset": "cryptoAsset",
}
"""Another renderer's name → ours."""


class LayerTable(Mapping[str, Layer]):
    """The rows in their order; a look-up also finds those of families, such as `light:key`."""

    def __getitem__(self, name: str) -> Layer:
        row = ROWS.get(name) or family_row(name)
        if row is None:
            raise KeyError(name)
        return row

    def __iter__(self) -> Iterator[str]:
        return iter(ROWS)

    def __len__(self) -> int:
        return len(ROWS)


LAYERS = LayerTable()


def resolve(names: Iterable[str]) -> tuple[str, ...]:
    """Our names of the layers asked for, each once; `all` stands for every row of the table.

    Raises UsageError for a name that nobody has.
    """
    every = [each for name in names for each in (LAYERS if name == "all" else [_ours(name)])]
    asked = tuple(dict.fromkeys(every))
    unknown = [name for name in asked if name not in LAYERS]
    if unknown or not asked:
        families = (row.name for row in FAMILIES.values())
        raise UsageError(f"no layer named {_guess(unknown)}; there are {', '.join([*LAYERS, *families])}")
    in_file = Counter(LAYERS[name].exr_name for name in asked)
    if alike := [name for name in asked if in_file[LAYERS[name].exr_name] > 1]:
        raise UsageError(f"layers {' and '.join(alike)} would have one name in a file: {LAYERS[alike[0]].exr_name}")
    return asked


def _ours(name: str) -> str:
    """Arnold's light groups are RGBA_name."""
    group = name.removeprefix("RGBA_")
    return ALIASES.get(name, name) if group == name else LIGHT_FAMILY + group


def _guess(unknown: list[str]) -> str:
    """The names that nobody has, with what the first may have meant."""
    import difflib

    close = difflib.get_close_matches(unknown[0], [*LAYERS, *ALIASES], 1) if unknown else []
    return (", ".join(unknown) or "(none given)") + (f" (did you mean '{close[0]}'?)" if close else "")


def layer_in_file(prefix: str) -> str:
    """The layer of which a file's channels named `prefix.…` are a part: those of mattes count through."""
    known = {layer.exr_name: name for name, layer in LAYERS.items()}
    return known.get(prefix) or known.get(prefix.rstrip("0123456789"), prefix)


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """`names` as the table orders them, families last, so that files do not depend on the order of a request."""
    place = {name: number for number, name in enumerate(LAYERS)}
    return tuple(sorted(names, key=lambda name: (place.get(name, len(place)), name)))
