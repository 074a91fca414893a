"""Polygon meshes: what lies on them, their normals, refinement and triangles; those of small ones all at once."""
