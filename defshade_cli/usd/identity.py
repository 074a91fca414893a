"""What a drawn prim is part of."""

from __future__ import annotations

from collections.abc import Iterable

from pxr import Kind, Sdf, Usd


def read_assets(stage: Usd.Stage, paths: Iterable[str]) -> dict[str, str]:
    """For each path that of the nearest component at or above it, by model kind; without one that of its root prim."""
    known: dict[Sdf.Path, Sdf.Path] = {}
    return {path: str(_component(stage, Sdf.Path(path), known)) for path in paths}


def _component(stage: Usd.Stage, path: Sdf.Path, known: dict[Sdf.Path, Sdf.Path]) -> Sdf.Path:
    if path not in known:
        prim = stage.GetPrimAtPath(path)
        is_component = bool(prim) and Kind.Registry.IsA(Usd.ModelAPI(prim).GetKind(), Kind.Tokens.component)
        if is_component or path.IsRootPrimPath():
            known[path] = path
        else:
            known[path] = _component(stage, path.GetParentPath(), known)
    return known[path]
