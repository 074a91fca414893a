"""What layers are called elsewhere, and how a request for some becomes rows of the table."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping

from defshade_cli.errors import UsageError
from defshade_cli.image.layers.layer import Layer
from defshade_cli.image.layers.table import ROWS

ALIASES: dict[str, str] = {
    # Hydra: HdAovTokens
    "color": "beauty",
    "cameraDepth": "depth",
    "primvars:st": "uv",
    # Arnold
    "RGBA": "beauty",
    "A": "alpha",
    "Z": "depth",
    "P": "position",
    "N": "normal",
    "Ng": "geometricNormal",
    "ID": "primId",
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
    "DiffCol": "albedo",
    "Emit": "emission",
    "IndexMA": "materialId",
    "CryptoObject": "cryptoObject",
    "CryptoMaterial": "cryptoMaterial",
    "CryptoAsset": "cryptoAsset",
}
"""Another renderer's name → ours."""


class LayerTable(Mapping[str, Layer]):
    """The rows in their order; iteration and length are those of the fixed ones."""

    def __getitem__(self, name: str) -> Layer:
        return ROWS[name]

    def __iter__(self) -> Iterator[str]:
        return iter(ROWS)

    def __len__(self) -> int:
        return len(ROWS)


LAYERS = LayerTable()


def resolve(names: Iterable[str]) -> tuple[str, ...]:
    """Our names of the layers asked for, each once; `all` stands for every row of the table.

    Raises UsageError for a name that nobody has.
    """
    asked = [each for name in names for each in (LAYERS if name == "all" else [ALIASES.get(name, name)])]
    unknown = [name for name in asked if name not in LAYERS]
    if unknown or not asked:
        raise UsageError(f"no layer named {_guess(unknown)}; there are {', '.join(LAYERS)}")
    return tuple(dict.fromkeys(asked))


def _guess(unknown: list[str]) -> str:
    """The names that nobody has, with what the first may have meant."""
    close = difflib.get_close_matches(unknown[0], [*LAYERS, *ALIASES], 1) if unknown else []
    return (", ".join(unknown) or "(none given)") + (f" (did you mean '{close[0]}'?)" if close else "")


def layer_in_file(prefix: str) -> str:
    """The layer of which a file's channels named `prefix.…` are a part: those of mattes count through."""
    known = {layer.exr_name: name for name, layer in LAYERS.items()}
    return known.get(prefix) or known.get(prefix.rstrip("0123456789"), prefix)


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """`names` as the table orders them, so that files do not depend on the order of a request."""
    return tuple(sorted(names, key=list(LAYERS).index))
