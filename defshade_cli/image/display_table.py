"""A display transform as a table, for pictures of 8 bits: where it is within half a step of the transform itself.

The lattice is even in log2(1 + x / TOE) of each scene-linear channel, from 0 to MOST. Between its points the table is
linear in tetrahedra around the cells' diagonals, and each cell knows whether that is near enough at the 27 points that
halve it. What lies in a cell that is not, or in none, is for the transform. Baking takes as long as showing a large
picture, so tables are kept on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.kept import kept

if TYPE_CHECKING:
    from defshade_cli.image.display_shader import DisplayShader

CELLS = 64
"""Along each axis."""

TOE, MOST = 0.02, 256.0
NEAR_ENOUGH = 0.35 / 255.0
"""At the points that are tried; 0.46 steps were the most that a million others were off."""

Lattice = NDArray[np.float16]
"""(CELLS + 1,) * 3 + (4,) by blue, green, red: what is shown; alpha: is the cell from there on too coarse?"""

Show = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""The transform itself: (H, W, 3) scene-linear → shown."""


def kept_table(shader: DisplayShader, show: Show) -> Lattice:
    """The table of what `shader` does, baked by `show` the first time."""
    return kept("displays", _told(shader), lambda: {"table": bake(show)})["table"]


def bake(show: Show) -> Lattice:
    """By twice as many points along each axis as the table has cells."""
    axis = TOE * np.expm1(np.linspace(0.0, np.log1p(MOST / TOE), 2 * CELLS + 1))
    fine = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")[::-1], axis=-1).astype(np.float32)
    shown = show(fine.reshape(-1, fine.shape[2], 3)).reshape(fine.shape)
    table = np.zeros((*(CELLS + 1,) * 3, 4), np.float16)
    table[..., :3] = shown[::2, ::2, ::2]
    table[:-1, :-1, :-1, 3] = _coarse(np.abs(_halved(table[..., :3].astype(np.float32)) - shown).max(axis=-1))
    return table


def _halved(lattice: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, N, N, 3) → (2N - 1, ...): each point between others lies in the middle of an edge or a diagonal."""
    halved = np.empty((*(2 * n - 1 for n in lattice.shape[:3]), 3), np.float32)
    for z, y, x in product(range(2), repeat=3):
        first = lattice[: len(lattice) - z, : len(lattice) - y, : len(lattice) - x]
        halved[z::2, y::2, x::2] = 0.5 * (first + lattice[z:, y:, x:])
    return halved


def _coarse(errors: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(2N + 1,) * 3 errors → (N,) * 3 cells with a point that is too far off."""
    far, span = errors > NEAR_ENOUGH, 2 * CELLS
    corners = product(range(3), repeat=3)
    return np.any([far[z : z + span : 2, y : y + span : 2, x : x + span : 2] for z, y, x in corners], axis=0)


def _told(shader: DisplayShader) -> bytes:
    told = f"tetrahedra {CELLS} {TOE} {MOST} {NEAR_ENOUGH}\n{shader.source}".encode()
    return told + b"".join(table.values.tobytes() for table in shader.tables)
