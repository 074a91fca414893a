"""A file, what is laid over it, and what is chosen of it, as a stage."""

from __future__ import annotations

from pathlib import Path

from pxr import Sdf, Tf, Usd

from defshade_cli.errors import StageError, StageNotFound
from defshade_cli.settings import Composition
from defshade_cli.usd.opening.diagnostics import commentary


def compose(path: Path, composition: Composition, camera: str | None) -> Usd.Stage:
    """The stage of the file at `path`. camera: as the user names it; it is there whatever the mask.

    Raises StageNotFound for a file that is missing or is not USD, StageError for layers that cannot be composed,
    PrimNotFound for a prim, variant set or variant that the stage lacks.
    """
    root, session = read_layer(path), _session(composition.session_layers)
    try:
        return _composed(root, session, composition, camera)
    except Tf.ErrorException as error:
        raise StageError(f"{path} cannot be composed: {_first_line(error)}") from None


def _composed(root: Sdf.Layer, session: Sdf.Layer, composition: Composition, camera: str | None) -> Usd.Stage:
    load = Usd.Stage.LoadNone if composition.payloads == "none" else Usd.Stage.LoadAll
    if composition.mask or composition.variants:
        return _limited(root, session, composition, camera, load)
    return Usd.Stage.Open(root, session, load)


def _limited(
    root: Sdf.Layer, session: Sdf.Layer, composition: Composition, camera: str | None, load: Usd.Stage.InitialLoadSet
) -> Usd.Stage:
    from defshade_cli.usd.opening.mask import add_what_is_referred_to, limited_to
    from defshade_cli.usd.opening.variants import choose_variant

    if composition.mask:
        stage = Usd.Stage.OpenMasked(root, session, limited_to(composition.mask, camera), load)
    else:
        stage = Usd.Stage.Open(root, session, load)
    for choice in composition.variants:
        choose_variant(stage, choice)
    if composition.mask:
        add_what_is_referred_to(stage, composition.mask)
    return stage


def read_layer(path: Path) -> Sdf.Layer:
    """Raises StageNotFound."""
    if not path.exists():
        raise StageNotFound(f"no such file: {path}")
    try:
        layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as error:
        raise StageNotFound(f"{path} is not a USD stage: {_first_line(error)}") from None
    if not layer:
        raise StageNotFound(f"{path} is not a USD stage: it has no root layer")
    return layer


def _session(paths: tuple[Path, ...]) -> Sdf.Layer:
    """A layer of ours over the files, in which variants are chosen."""
    session = Sdf.Layer.CreateAnonymous("session.usda")
    session.subLayerPaths = [read_layer(path).identifier for path in paths]
    return session


def _first_line(error: Tf.ErrorException) -> str:
    return commentary(error.args[0]).partition("\n")[0]
