"""Photometric and camera units.

defshade follows UsdLux: light is an RGB triple whose unit is the nit (cd/m²) for radiance-like and the lux
for irradiance-like quantities; distances are scene units, `metersPerUnit` metres each.
"""

from __future__ import annotations

import math


def exposure_scale(stops: float) -> float:
    """Linear factor of `stops` of exposure: 2^stops."""
    return math.exp2(stops)
