"""The .mtlx files of a stage, which usd-core has no file format for, put in the place of the references to them."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable

from pxr import Ar, Sdf, Usd

log = logging.getLogger("defshade")

INSTALL = "pip install 'defshade[materialx]'"

_SUFFIX = ".mtlx"
_UNREADABLE = re.compile(r"Could not (?:open asset|load sublayer) @[^@]*\.mtlx\]*@")


def is_about_documents(diagnostic: str) -> bool:
    """Is this USD's complaint about a reference to a document?"""
    return bool(_UNREADABLE.search(diagnostic))


def supply_documents(stage: Usd.Stage) -> None:
    """Read the documents that layers of the stage refer to, and point those references at what they hold.

    The layers are changed in memory alone. What cannot be read is logged, and stays a reference to nothing.
    """
    supplied: dict[str, Sdf.Layer | None] = {}
    try:
        for layer in stage.GetUsedLayers():
            for name in layer.GetCompositionAssetDependencies():
                if _suffix(name) == _SUFFIX:
                    _supply(layer, name, supplied)
    except ImportError:
        log.warning("MaterialX documents are not read, and their materials missing: %s", INSTALL)


def files_of(paths: Iterable[str]) -> list[str]:
    """The files that documents name. Nothing is known without the package, or of what is no document."""
    return [file for path in paths if _suffix(path) == _SUFFIX for file in _named_by(path)]


def _named_by(path: str) -> list[str]:
    from defshade_cli.usd.materials.materialx.document import NotADocument, named_files, read_document

    try:
        return [*named_files(read_document(path), path)]
    except (ImportError, NotADocument):
        return []


def _supply(layer: Sdf.Layer, name: str, supplied: dict[str, Sdf.Layer | None]) -> None:
    resolved = str(Ar.GetResolver().Resolve(Sdf.ComputeAssetPathRelativeToLayer(layer, name.replace("\\", "/"))))
    if resolved not in supplied:
        supplied[resolved] = _read(resolved, name)
    document = supplied[resolved]
    if document:
        layer.UpdateCompositionAssetDependency(name, document.identifier)


def _read(resolved: str, name: str) -> Sdf.Layer | None:
    if not resolved:
        log.warning("no MaterialX document %s", name)
        return None
    from defshade_cli.usd.materials.materialx.document import NotADocument, layer_of, read_document

    try:
        return layer_of(read_document(resolved), resolved)
    except NotADocument as reason:
        log.warning("%s is no MaterialX document: %s", resolved, reason)
        return None


def _suffix(path: str) -> str:
    return path.rstrip("]")[-len(_SUFFIX) :].lower()
