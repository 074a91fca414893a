"""The sky of a dome light: radiance by direction, how to sample it, and the irradiance that it gives.

Directions are in the dome's own space, as OpenEXR lays out latitude-longitude maps: the image's centre is +Z, a quarter
from the left is +X, the top is +Y.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen

if TYPE_CHECKING:
    from defshade_cli.scene.distribution import GridDistribution

SkyLayout = Literal["automatic", "latlong", "mirroredBall", "angular", "cubeMapVerticalCross"]
"""Of an image of the sky, by UsdLux's names."""

_CELLS = (128, 256)
"""Rows and columns that directions are drawn from; a finer map is averaged into them."""

_ENOUGH_CELLS = (64, 128)
"""Whose middles stand for them to 0.02 % in all harmonics."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear Rec. 709."""

_COSINE_LOBE = np.array([math.pi, *[2 * math.pi / 3] * 3, *[math.pi / 4] * 5])


@dataclass(frozen=True, eq=False)
class Environment:
    """radiance: (H, W, 3) float32, scene-linear, row 0 at the top."""

    radiance: NDArray[np.float32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "radiance", frozen(self.radiance, np.float32, *self.radiance.shape[:2], 3))

    def sample(
        self, u: tuple[float, float], density: GridDistribution | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """A direction (3,) drawn by luminance or a `density` of cells, the radiance there over it, (3,), and 1 over it.

        The mean of the second over samples is the integral of the radiance over all directions; black skies give 0.
        The third is in steradians: the part of the sky that a single direction stands for.
        """
        row, column, down, right, chance = (density or self._distribution).draw(u)
        sine = self._sines[row] + (self._sines[row + 1] - self._sines[row]) * down
        longitude = self._longitudes[column] + (self._longitudes[column + 1] - self._longitudes[column]) * right
        cosine = math.sqrt(max(1.0 - sine * sine, 0.0))
        direction = np.array([math.sin(longitude) * cosine, sine, math.cos(longitude) * cosine])
        extent = float(self._solid_angles[row, column]) / chance if chance > 0 else 0.0
        return direction, self._cells[row, column] * extent, extent

    def density(self, distribution: GridDistribution | None = None) -> NDArray[np.float32]:
        """(H, W) by solid angle, of the directions that `sample` draws; as fine as the map or finer."""
        rows, columns = (np.diff(edges) for edges in self._edges)
        cells = (distribution or self._distribution).chances / self._solid_angles
        return cells.repeat(rows, axis=0).repeat(columns, axis=1).astype(np.float32)

    @property
    def cell_level(self) -> float:
        """How often the map is to be halved for pixels as large as the cells that directions are drawn from."""
        return max(math.log2(n / most) for n, most in zip((*self.radiance.shape[:2], 1), (*_CELLS, 1), strict=True))

    @cached_property
    def irradiance_sh(self) -> NDArray[np.float64]:
        """(9, 3) coefficients in real spherical harmonics of the irradiance on a surface by its normal.

        Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps": within 1 % on
        average for natural skies.
        """
        return _COSINE_LOBE[:, None] * self._moments

    def balance(self, directions: NDArray[np.float64], radiance: NDArray[np.float64]) -> NDArray[np.float64]:
        """(9, 3) of harmonics, whose sum and 1 are a factor by which drawn directions have the sky's own harmonics.

        directions: (N, 3).  radiance: (N, 3) over their density, as `sample` gives them. What N directions have too
        much of the sky's nine first harmonics, which a diffuse surface sees little beyond, is theirs by chance alone:
        calibration, as in Deville & Särndal 1992, "Calibration Estimators in Survey Sampling". It vanishes as N grows.
        """
        basis = harmonics(directions)
        missing = self._moments - basis.T @ radiance / len(basis)
        products = np.einsum("nk,nc,nl->ckl", basis, radiance, basis) / len(basis)
        channels = zip(products, missing.T, strict=True)
        return np.column_stack([np.linalg.lstsq(a, b, rcond=1e-6)[0] for a, b in channels])

    @cached_property
    def _moments(self) -> NDArray[np.float64]:
        """(9, 3) of the sky's radiance in real spherical harmonics; large cells count by several directions each."""
        height, width = self._cells.shape[:2]
        rows, columns = (math.ceil(enough / n) for enough, n in zip(_ENOUGH_CELLS, (height, width), strict=True))
        basis = harmonics(self._directions(rows, columns)).reshape(height, rows, width, columns, -1).mean(axis=(1, 3))
        return np.einsum("hwk,hw,hwc->kc", basis, self._solid_angles, self._cells)

    @cached_property
    def directions(self) -> NDArray[np.float64]:
        """(h, w, 3) unit, to the middles of the cells."""
        return self._directions(1, 1)

    def _directions(self, rows: int, columns: int) -> NDArray[np.float64]:
        """(h · rows, w · columns, 3) to the middles of so many equal parts of the cells."""
        sine = _middles(self._sines, rows)[:, None]
        longitude = _middles(self._longitudes, columns)[None, :]
        cosine = np.sqrt(1.0 - sine * sine)
        x, y, z = np.broadcast_arrays(np.sin(longitude) * cosine, sine, np.cos(longitude) * cosine)
        return np.stack([x, y, z], axis=-1)

    @cached_property
    def _fine(self) -> NDArray[np.float32]:
        """The map as it is interpolated between its pixels, which matters where they are hardly finer than cells."""
        if self.radiance.shape[0] > 2 * _CELLS[0]:
            return self.radiance
        rows = _doubled(np.pad(self.radiance, ((1, 1), (0, 0), (0, 0)), mode="edge"))
        columns = np.pad(rows, ((0, 0), (1, 1), (0, 0)), mode="wrap").swapaxes(0, 1)
        return _doubled(columns).swapaxes(0, 1)

    @cached_property
    def _edges(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the fine map at which cells begin, and the end."""
        shape = self._fine.shape[:2]
        edges = [np.linspace(0, n, min(n, most) + 1).astype(int) for n, most in zip(shape, _CELLS, strict=True)]
        return edges[0], edges[1]

    @cached_property
    def _cells(self) -> NDArray[np.float64]:
        """(h, w, 3) the map averaged over whole cells; its rows count by their solid angle."""
        rows, columns = self._edges
        height = len(self._fine)
        weight = np.sin(math.pi * (np.arange(height) + 0.5) / height)[:, None, None]
        summed = np.add.reduceat(self._fine * weight, rows[:-1], axis=0) / np.add.reduceat(weight, rows[:-1], axis=0)
        return np.add.reduceat(summed, columns[:-1], axis=1) / np.diff(columns)[:, None]

    @cached_property
    def _sines(self) -> NDArray[np.float64]:
        """(h + 1,) sine of the latitude at the rows' edges, from the top."""
        return np.cos(math.pi * self._edges[0] / self._fine.shape[0])

    @cached_property
    def _longitudes(self) -> NDArray[np.float64]:
        """(w + 1,) at the columns' edges, from the left: +π to −π."""
        return 2.0 * math.pi * (0.5 - self._edges[1] / self._fine.shape[1])

    @cached_property
    def _solid_angles(self) -> NDArray[np.float64]:
        """(h, w) of each cell."""
        return np.outer(np.diff(self._sines), np.diff(self._longitudes))

    @cached_property
    def _distribution(self) -> GridDistribution:
        from defshade_cli.scene.distribution import GridDistribution

        return GridDistribution(self.power)

    @cached_property
    def luminance(self) -> NDArray[np.float64]:
        """(h, w) of the cells."""
        return np.maximum(self._cells @ LUMINANCE, 0.0)

    @cached_property
    def power(self) -> NDArray[np.float64]:
        """(h, w) luminance times solid angle of the cells."""
        return self.luminance * self._solid_angles

    def cell_of(self, directions: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the cells that unit vectors (N, 3) point to."""
        rows = np.searchsorted(-self._sines, -directions[:, 1]) - 1
        columns = np.searchsorted(-self._longitudes, -np.arctan2(directions[:, 0], directions[:, 2])) - 1
        height, width = self.luminance.shape
        return np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)


def _middles(edges: NDArray[np.float64], parts: int) -> NDArray[np.float64]:
    """(N · parts,) of equal parts of the spans between edges (N + 1,)."""
    along = (np.arange(parts) + 0.5) / parts
    return (edges[:-1, None] + np.diff(edges)[:, None] * along).ravel()


def _doubled(padded: NDArray[np.float32]) -> NDArray[np.float32]:
    """(2N, …) means of the halves of pixels that are interpolated linearly, of N pixels and one beside either end."""
    middle = 0.75 * padded[1:-1]
    return np.stack([middle + 0.25 * padded[:-2], middle + 0.25 * padded[2:]], axis=1).reshape(-1, *padded.shape[1:])


def uniform_environment() -> Environment:
    """Radiance 1 from everywhere, in cells that are fine enough to tell directions apart."""
    return Environment(np.ones((64, 128, 3), np.float32))


def harmonics(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nine real spherical harmonics up to degree 2 at unit vectors (..., 3); (..., 9)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    c0, c1 = 0.5 / math.sqrt(math.pi), math.sqrt(3.0 / (4.0 * math.pi))
    c2, c20, c22 = (math.sqrt(k / (16.0 * math.pi)) for k in (60.0, 5.0, 15.0))
    bands = [c0 * np.ones_like(x), c1 * y, c1 * z, c1 * x]
    bands += [c2 * x * y, c2 * y * z, c20 * (3 * z * z - 1), c2 * x * z, c22 * (x * x - y * y)]
    return np.stack(bands, axis=-1)
