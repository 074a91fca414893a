"""What the plane of visible triangles says: ids a pixel, mattes, and the manifests of both."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.cryptomatte import Coverage, name_ids
from defshade_cli.plan import Plan
from defshade_cli.scene.identity import Identities, Table
from defshade_cli.scene.scene import Scene

log = logging.getLogger("defshade")

_EXACT = 1 << 24
"""Integers up to which float32 holds each."""

_SLOTS_PER_RANK = 2

Manifests = dict[str, dict[int, str]]
"""Layer → what its ids stand for."""


def id_values(layer: str, visible: NDArray[np.uint32], identities: Identities) -> NDArray[np.int32]:
    """(H, W, 1) of an id layer; visible: (H, W, 2) the plane."""
    numbers, triangles = visible[..., :1], visible[..., 1:]
    values = identities.faces(numbers, triangles) if layer == "elementId" else _tables(identities)[layer][numbers]
    if values.max(initial=0) > _EXACT:
        log.warning("%s: ids beyond %d are rounded", layer, _EXACT)
    return values


def id_manifests(layers: Mapping[str, NDArray[np.float32]], scene: Scene) -> Manifests:
    """What the ids of some layers (H, W, 1) stand for, those that the picture shows."""
    identities = Identities(scene)
    every = {layer: _names(layer, identities) for layer in layers}
    return {
        layer: {number: names[number] for number in np.unique(layers[layer]).astype(int).tolist() if number in names}
        for layer, names in every.items()
        if names
    }


class Mattes:
    """The Cryptomattes of a plan, gathered sample by sample; names are numbered as they are met."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._plan = plan
        self._numbers: dict[str, dict[str, int]] = {layer: {} for layer in plan.mattes}
        self._coverage = {layer: Coverage(_SLOTS_PER_RANK * plan.ranks) for layer in plan.mattes}
        self.see(scene)

    def see(self, scene: Scene) -> None:
        """The samples to come are of this scene: the same, maybe at another moment."""
        identities = Identities(scene)
        self._tables = {layer: self._table(layer, identities) for layer in self._coverage}

    def _table(self, layer: str, identities: Identities) -> Table:
        known = self._numbers[layer]
        numbers = [known.setdefault(name, len(known)) for name in _matte_names(layer, identities)]
        return np.array([*numbers, -1], np.int32)[_matte_table(layer, identities)]

    def add(self, visible: NDArray[np.uint32]) -> None:
        """One sample's plane (H, W, 2)."""
        for layer, coverage in self._coverage.items():
            coverage.add(self._tables[layer][visible[..., 0].ravel()])

    def layers(self, samples: int) -> dict[str, NDArray[np.float32]]:
        """(H, W, 2 · ranks) each, of so many samples."""
        width, height = self._plan.size
        return {
            layer: coverage.ranked(
                name_ids([*self._numbers[layer]]), self._plan.ranks, samples, width * height
            ).reshape(height, width, -1)
            for layer, coverage in self._coverage.items()
        }

    def manifests(self) -> dict[str, dict[int, str]]:
        """Names by the bits of their ids, those that the picture shows."""
        return {layer: self._manifest(layer) for layer in self._coverage}

    def _manifest(self, layer: str) -> dict[int, str]:
        every = [*self._numbers[layer]]
        names = [every[number] for number in self._coverage[layer].seen()]
        return dict(zip(name_ids(names).tolist(), names, strict=True))


def _tables(identities: Identities) -> dict[str, Table]:
    numbers = {text: number for number, text in enumerate(_labels(identities))}
    labels = {path: numbers[text] for path, text in identities.scene.labels.items()}
    return {
        "primId": identities.prim,
        "instanceId": identities.instance,
        "materialId": identities.material,
        "semantic": identities.of_prims(labels),
    }


def _labels(identities: Identities) -> list[str]:
    """Every set of labels, in alphabetic order, which does not depend on what else is drawn."""
    return sorted(set(identities.scene.labels.values()))


def _names(layer: str, identities: Identities) -> dict[int, str]:
    match layer:
        case "primId":
            return {number: path for path, number in identities.paths.items()}
        case "semantic":
            return dict(enumerate(_labels(identities)))
        case "materialId":
            return dict(enumerate(material.path for material in identities.scene.materials))
        case _:
            return {}


def _matte_names(layer: str, identities: Identities) -> list[str]:
    """Each once, by number."""
    if layer == "cryptoMaterial":
        return [material.path for material in identities.scene.materials]
    if layer == "cryptoAsset":
        return _distinct(identities.scene.assets.values())
    return list(identities.paths)


def _matte_table(layer: str, identities: Identities) -> Table:
    if layer == "cryptoMaterial":
        return identities.material
    if layer == "cryptoAsset":
        assets = identities.scene.assets
        numbers = {name: number for number, name in enumerate(_distinct(assets.values()))}
        return identities.of_prims({path: numbers[name] for path, name in assets.items()})
    return identities.prim


def _distinct(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))
