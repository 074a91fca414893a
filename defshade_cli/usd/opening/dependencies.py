"""The files that a stage is made of."""

from __future__ import annotations

import os
from pathlib import Path

from pxr import Ar, Sdf, Tf, UsdUtils

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import StageError
from defshade_cli.usd.materials.materialx.documents import files_of


@dataclass(frozen=True, slots=True)
class Dependencies:
    """files: path on disk by name, which is relative to the stage's folder.  missing: what could not be resolved."""

    files: dict[str, Path]
    missing: tuple[str, ...]


def read_dependencies(stage: Path) -> Dependencies:
    """Layers, textures and other assets of a stage, through every reference, payload, clip, variant and document.

    A package (.usdz) is one file, whatever is used of it. Raises StageError where one of the layers cannot be read.
    """
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # what ails the stage is logged where it is opened
    try:
        layers, assets, missing = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(stage)))
    except Tf.ErrorException as error:
        raise StageError(f"{stage} depends on a layer that cannot be read") from error
    finally:
        del delegate
    documents = {name: _source_of(name) for name in missing}
    named = [*(layer.realPath for layer in layers), *assets, *documents.values()]
    paths = {_outermost(path) for path in (*named, *files_of(named)) if path}
    folder = stage.resolve().parent
    files = {os.path.relpath(path, folder): Path(path) for path in paths if Path(path).is_file()}
    elsewhere = (path for path in paths if not Path(path).is_file())
    return Dependencies(
        files, tuple(sorted({*(name for name, document in documents.items() if not document), *elsewhere}))
    )


def _source_of(name: str) -> str:
    from defshade_cli.usd.materials.materialx.document import source_of

    return source_of(name)


def _outermost(path: str) -> str:
    return os.path.realpath(Ar.SplitPackageRelativePathOuter(path)[0])
