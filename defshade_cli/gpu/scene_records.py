"""Placements and materials as the shaders read them: an Instance and a Material record each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.records import record
from defshade_cli.scene.geometry import Drawable
from defshade_cli.scene.material import Material


def instance_records(drawables: Sequence[Drawable], eye: NDArray[np.float64]) -> NDArray[Any]:
    """One Instance record a placement (P,), in the drawables' order; differences taken in float64."""
    if not drawables:
        return np.zeros(0, record("Instance"))
    matrices = np.concatenate([d.world_from_object for d in drawables])
    records = np.zeros(len(matrices), record("Instance"))
    relative = matrices.copy()
    relative[:, :3, 3] -= eye
    records["relative_from_object"] = relative.transpose(0, 2, 1)
    normal, handedness = _normal_matrices(matrices[:, :3, :3])
    records["relative_from_normal"][:, :3, :3] = normal.transpose(0, 2, 1)
    records["handedness"] = handedness
    records["link_set"] = np.concatenate([d.link_sets for d in drawables])
    records["display_color"] = np.concatenate([d.display_color for d in drawables])
    records["display_opacity"] = np.concatenate([d.display_opacity for d in drawables])
    return records


def _normal_matrices(linear: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cofactors of unit size with the determinant's sign: an inverse transpose that no singular matrix breaks."""
    columns = (
        linear.transpose(0, 2, 1) / np.maximum(np.abs(linear).max(axis=(1, 2)), np.finfo(float).tiny)[:, None, None]
    )
    x, y, z = columns[:, 0], columns[:, 1], columns[:, 2]
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)
    handedness = np.where(np.einsum("ni,ni->n", x, cofactors[..., 0]) < 0, -1.0, 1.0)
    size = np.maximum(np.abs(cofactors).max(axis=(1, 2)), np.finfo(float).tiny)
    return cofactors * (handedness / size)[:, None, None], handedness


def material_records(materials: Sequence[Material], input_counts: Sequence[int]) -> NDArray[Any]:
    """One Material record each, (M,); fields of the same name are copied. input_counts: texture inputs of each."""
    dtype = record("Material")
    records = np.zeros(len(materials), dtype)
    if not materials:
        return records
    for name in sorted(set(dtype.names or ()) - {"first_input", "input_count"}):
        records[name] = [getattr(material, name) for material in materials]
    records["input_count"] = input_counts
    records["first_input"] = np.cumsum([0, *input_counts])[:-1]
    return records
