"""Materials as a prim wears them: with its primvars in their fields, and what stands in for coordinates that it lacks.

A primvar that feeds a field is one value a prim, and is asked for by the prim's path on the stage: so each instance has
what it inherits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.materials.material import as_field, sound
from defshade_cli.usd.polygons.primvars import OUT_OF_RANGE, authored, find_display, followed

_DEFAULTS = {f.name: f.default for f in fields(Material)}

Value = tuple[object, ...] | None
"""The numbers of a primvar, None where a prim has no single value of it."""


def on_mesh(material: Material, mesh: Mesh) -> Material:
    """The material with its textures read at their fallbacks where the mesh has no such coordinates."""
    lacking = [name for name, i in material.inputs.items() if any(i.fallback) and i.uv and i.uv not in mesh.uvs]
    if not lacking:
        return material
    return replace(material, inputs={**material.inputs, **{n: material.inputs[n].at_fallback() for n in lacking}})


def with_primvars(material: Material, values: Mapping[str, Value], issues: list[str]) -> Material:
    """The material with what its primvars are; its own values, the readers' fallbacks, where one is None."""
    if not material.primvars:
        return material
    found: dict[str, object] = {}
    for name, primvar in material.primvars.items():
        if (value := values[primvar]) is None:
            continue
        try:
            found[name] = as_field(value, _DEFAULTS[name])
        except (TypeError, ValueError):
            issues.append(f"{name} from primvar {primvar}, which holds no numbers")
    return replace(material, primvars={}, **sound(found, issues))


def read_values(
    stage: Usd.Stage, path: str, names: tuple[str, ...], time: Usd.TimeCode, issues: dict[Unsupported, None]
) -> tuple[Value, ...]:
    """Of the primvars of a prim, its ancestors' included, one value each."""
    prim = stage.GetPrimAtPath(Sdf.Path(path))
    if not prim:
        return (None,) * len(names)
    reasons: list[str] = []
    values = tuple(_single(prim, name, time, reasons) for name in names)
    issues.update(dict.fromkeys(Unsupported(path, reason) for reason in reasons))
    return values


def _single(prim: Usd.Prim, name: str, time: Usd.TimeCode, issues: list[str]) -> Value:
    """Its numbers, where all values of the primvar are the same one."""
    primvar = find_display(prim, name)
    source = authored(primvar, time)
    if source is None or source.value is None:
        issues.extend(_of_copies(prim, name))
        return None
    values = np.asarray(source.value)
    rows = followed(values, source.indices) if primvar.GetTypeName().isArray else values[None]
    if rows is None:
        issues.append(f"{source.name} is left out: {OUT_OF_RANGE}")
        return None
    if len(rows) > 1 and (rows != rows[0]).any():
        issues.append(f"{source.name} is left out: only colours may vary over a prim")
        return None
    return tuple(np.ravel(rows[0]).tolist()) if len(rows) else None


def _of_copies(prim: Usd.Prim, name: str) -> Iterator[str]:
    """Why a prototype has not what its instancer says of each copy."""
    while prim := prim.GetParent():
        if prim.IsA(UsdGeom.PointInstancer) and UsdGeom.PrimvarsAPI(prim).GetPrimvar(name).HasAuthoredValue():
            yield f"primvars:{name} of {prim.GetPath()} is left out: only colours may differ between copies"
