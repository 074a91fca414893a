"""Lamps as shaders/lib/lamps.glsl reads them: a Lamp record each, and the cells of what rectangles show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.records import record
from defshade_cli.plan import PlannedLight
from defshade_cli.scene.lamp import Lamp, Shape, lamp_of

_SHAPES: tuple[Shape, ...] = ("ball", "sphere", "disk", "rect", "cylinder", "cone")


def lamp_records(
    lights: Sequence[PlannedLight], samples: int, eye: NDArray[np.float64], towards: NDArray[np.float64]
) -> tuple[NDArray[Any], NDArray[np.float32]]:
    """(L,) records, relative to the eye (3,), and (C, 4) cells.

    samples: of a pixel.  towards: (3,) as for `emitter_at`.
    """
    records = np.zeros(len(lights), record("Lamp"))
    cells: list[NDArray[np.float32]] = []
    first = 0
    for row, planned in zip(records, lights, strict=True):
        lamp = lamp_of(planned.light, towards, inside=planned.is_empty)
        assert lamp is not None
        _set_shape(row, lamp, eye)
        row["area"] = lamp.area / (planned.points * samples)
        row["radiance"], row["centre"] = planned.light.radiance, planned.light.position - eye
        row["casts_shadow"] = planned.light.casts_shadow
        if lamp.shown:
            shown = lamp.shown.cells
            row["first_cell"], row["cells"] = first, shown.shape[1::-1]
            cells.append(shown.reshape(-1, 4))
            first += len(cells[-1])
    return records, np.concatenate(cells) if cells else np.zeros((1, 4), np.float32)


def _set_shape(row: np.void, lamp: Lamp, eye: NDArray[np.float64]) -> None:
    lamp_from_world = np.linalg.inv(lamp.world_from_lamp[:3, :3])
    offset = lamp_from_world @ (eye - lamp.world_from_lamp[:3, 3])
    row["x"], row["y"], row["z"] = np.column_stack([lamp_from_world, offset])
    row["shape"] = _SHAPES.index(lamp.shape)
    row["radius"], row["stretch"], row["bias"] = lamp.radius, lamp.stretch, lamp.bias
