"""What is drawn of polygons: triangles over vertices.

These are the points or, where something on the polygons splits points, the corners.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.geometry import Mesh
from defshade_cli.usd.polygons.polygons import Polygons, varying
from defshade_cli.usd.polygons.triangulation import Triangles


class Vertices(NamedTuple):
    """V vertices and T triangles over them; the arrays are those of a scene.Mesh.

    split: vertices are one a corner.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    faces: NDArray[np.int32]
    display_color: NDArray[np.float32] | None
    display_opacity: NDArray[np.float32] | None
    uvs: Mapping[str, NDArray[np.float32]]
    primvars: Mapping[str, NDArray[np.float32]]
    split: bool

    def mesh(self, path: str, *, double_sided: bool, level: int | None) -> Mesh:
        """Of the prim at `path`, refined `level` times."""
        return Mesh(
            path,
            self.points,
            self.normals,
            self.triangles,
            self.faces,
            self.display_color,
            self.display_opacity,
            double_sided,
            self.uvs,
            self.primvars,
            level,
        )

    def read_only(self) -> Vertices:
        """The same, whose arrays nobody writes to: nor to any part of them."""
        named = (*self.uvs.values(), *self.primvars.values())
        for array in (*self[:4], self.display_color, self.display_opacity, *named):
            if array is not None:
                array.flags.writeable = False
        return self

    def run(self, vertices: slice, triangles: slice) -> Vertices:
        """Of some meshes that stand end to end, one; its triangles count vertices from its own first."""
        color, opacity = self.display_color, self.display_opacity
        return Vertices(
            self.points[vertices],
            self.normals[vertices],
            self.triangles[triangles],
            self.faces[triangles],
            None if color is None else color[vertices],
            None if opacity is None else opacity[vertices],
            {name: uv[vertices] for name, uv in self.uvs.items()} if self.uvs else self.uvs,
            {name: values[vertices] for name, values in self.primvars.items()} if self.primvars else self.primvars,
            self.split,
        )


def vertices_of(whole: Polygons, triangulation: Triangles) -> Vertices:
    """Of polygons with normals, whose face-varying primvars lie on points where they can."""
    corners, face = triangulation
    if whole.left_handed:
        corners = corners[:, ::-1]
    split = any(primvar.splits_points for primvar in whole.primvars)
    place = whole.at_corners if split else whole.at_points
    color, opacity, normals = varying(whole.display_color), varying(whole.display_opacity), whole.normals
    assert normals is not None
    return Vertices(
        points=whole.points[whole.indices] if split else whole.points,
        normals=place(normals),
        triangles=(corners if split else whole.indices[corners]).astype(np.uint32),
        faces=whole.faces[face],
        display_color=place(color) if color else None,
        display_opacity=place(opacity) if opacity else None,
        uvs={name: place(uv) for name, uv in whole.uvs.items()},
        primvars={name: place(primvar) for name, primvar in whole.shown.items()},
        split=split,
    )
