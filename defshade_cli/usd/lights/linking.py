"""Light and shadow linking: the collections `lightLink` and `shadowLink` of each light against all that is drawn.

A collection without pattern expressions is a few paths, each with the rule for what lies below it; the nearest above a
prim counts. Over paths in order, everything below a path is one run, so a rule is one slice: no prim is asked alone.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdLux

from defshade_cli.scene.geometry import Drawable
from defshade_cli.scene.light import Light
from defshade_cli.scene.linking import Links

Bits = NDArray[np.bool_]

_COLLECTION = "collection:"
"""Of the names of what collections say. A light that says nothing of its own links everything."""


def link(
    stage: Usd.Stage, lights: Sequence[Light], drawables: Sequence[Drawable]
) -> tuple[tuple[Light, ...], tuple[Drawable, ...]]:
    """Lights with their Links and drawables with their sets, where some light leaves something out."""
    linking = {n: found for n, light in enumerate(lights) if (found := _collections(stage, light))}
    if not linking:
        return tuple(lights), tuple(drawables)
    paths = sorted({path for drawable in drawables for path in drawable.paths})
    table = np.array([_members(collection, paths) for pair in linking.values() for collection in pair])
    sets, set_of_path = np.unique(table.reshape(2 * len(linking), -1), axis=1, return_inverse=True)
    rows = {n: Links(sets[2 * k], sets[2 * k + 1]) for k, n in enumerate(linking)}
    set_at = dict(zip(paths, set_of_path.ravel().astype(np.uint32), strict=True))
    return (
        tuple(replace(light, links=rows.get(n)) for n, light in enumerate(lights)),
        tuple(replace(d, link_sets=_sets(d, set_at)) for d in drawables),
    )


def _collections(stage: Usd.Stage, light: Light) -> tuple[Usd.CollectionMembershipQuery, ...]:
    """The light's and the shadow's, or nothing where both hold everything."""
    prim = stage.GetPrimAtPath(light.path) if light.path.startswith("/") else None
    if not prim or not any(name.startswith(_COLLECTION) for name in prim.GetAuthoredPropertyNames()):
        return ()
    api = UsdLux.LightAPI(prim)
    pair = tuple(
        c.ComputeMembershipQuery() for c in (api.GetLightLinkCollectionAPI(), api.GetShadowLinkCollectionAPI())
    )
    return () if all(_holds_everything(query) for query in pair) else pair


def _holds_everything(query: Usd.CollectionMembershipQuery) -> bool:
    rules = {str(path): str(rule) for path, rule in query.GetAsPathExpansionRuleMap().items()}
    return "/" in rules and Usd.Tokens.exclude not in rules.values() and query.UsesPathExpansionRuleMap()


def _members(query: Usd.CollectionMembershipQuery, paths: Sequence[str]) -> Bits:
    """(P,) of sorted `paths`."""
    if not query.UsesPathExpansionRuleMap():
        return np.array([query.IsPathIncluded(path) for path in paths], bool)
    members = np.zeros(len(paths), bool)
    rules = {str(path): rule for path, rule in query.GetAsPathExpansionRuleMap().items()}
    for path in sorted(rules, key=len):  # what lies below comes later
        first, end = _run(path, paths)
        if rules[path] == Usd.Tokens.explicitOnly:
            end = first + (first < end and paths[first] == path)
        members[first:end] = rules[path] != Usd.Tokens.exclude
    return members


def _run(path: str, paths: Sequence[str]) -> tuple[int, int]:
    """Of `path` and all below it: a slash sorts before everything that names are made of."""
    if path == "/":
        return 0, len(paths)
    return bisect_left(paths, path), bisect_left(paths, path + chr(ord("/") + 1))


def _sets(drawable: Drawable, set_at: dict[str, np.uint32]) -> NDArray[np.uint32]:
    found = np.array([set_at[path] for path in drawable.paths], np.uint32)
    return np.broadcast_to(found, len(drawable.world_from_object)) if len(found) == 1 else found
