"""What a drawn prim is, and what it is part of."""

from __future__ import annotations

from collections.abc import Iterable

from pxr import Kind, Sdf, Usd, UsdSemantics


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


def read_labels(stage: Usd.Stage, paths: Iterable[str], time: Usd.TimeCode) -> dict[str, str]:
    """For each path that has any, its own and inherited semantic labels: `class:chair,furniture part:leg`.

    Taxonomies and their labels stand in alphabetic order, so that equal sets are equal texts.
    """
    prims = ((path, stage.GetPrimAtPath(path)) for path in paths)
    labels = {path: _labels(prim, time) for path, prim in prims if prim}
    return {path: text for path, text in labels.items() if text}


def _labels(prim: Usd.Prim, time: Usd.TimeCode) -> str:
    taxonomies = sorted(str(name) for name in UsdSemantics.LabelsAPI.ComputeInheritedTaxonomies(prim))
    queries = ((name, UsdSemantics.LabelsQuery(name, time)) for name in taxonomies)
    found = ((name, sorted(map(str, query.ComputeUniqueInheritedLabels(prim)))) for name, query in queries)
    return " ".join(f"{name}:{','.join(labels)}" for name, labels in found if labels)
