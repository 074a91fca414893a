"""A stage's file in another of USD's formats."""

from __future__ import annotations

from pathlib import Path

from pxr import Sdf, UsdUtils

from defshade_cli.errors import OutputError


def write_as(stage: Path, suffix: str) -> Path:
    """Write the layer beside itself as .usda, .usdc or, with all that it depends on, .usdz. Raises OutputError."""
    path = stage.with_suffix(suffix)
    if suffix == ".usdz":
        written = UsdUtils.CreateNewUsdzPackage(str(stage), str(path))
    else:
        layer = Sdf.Layer.FindOrOpen(str(stage))
        written = bool(layer) and layer.Export(str(path))
    if not written:
        raise OutputError(f"{path}: cannot be made of {stage}")
    return path
