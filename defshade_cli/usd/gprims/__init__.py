"""Cubes, planes, solids of revolution and points, and a shape that a prim places several times."""
