"""Our own settings on RenderSettings prims: attributes in the namespace `defshade`, read and written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Tf, Usd, UsdRender, Vt

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import OutputError
from defshade_cli.scene.product import Variable
from defshade_cli.usd.render_settings.products import find_settings

_NAMESPACE = "defshade"
_TYPES: dict[type, Sdf.ValueTypeName] = {
    bool: Sdf.ValueTypeNames.Bool,
    int: Sdf.ValueTypeNames.Int,
    float: Sdf.ValueTypeNames.Double,
    str: Sdf.ValueTypeNames.Token,
}


@dataclass(frozen=True, slots=True)
class SavedSettings:
    """What UsdRender has a place for, and what it has none for.

    camera: path of a prim; None for a camera of ours.  resolution: pixels.
    data_window: (xmin, ymin, xmax, ymax), 0..1 over the image, y up.
    own: bool, int, float or str by the names of RenderSettings' fields.
    """

    camera: str | None
    resolution: tuple[int, int]
    data_window: tuple[float, float, float, float]
    purposes: tuple[str, ...]
    rendering_space: str
    variables: tuple[Variable, ...]
    own: Mapping[str, Any] = field(default_factory=dict)


def read_own_settings(stage: Usd.Stage, path: str | None) -> dict[str, Any]:
    """What the settings at `path`, or those found without one, say in our namespace. Raises PrimNotFound."""
    settings = find_settings(stage, path)
    if not settings:
        return {}
    attributes = settings.GetPrim().GetAuthoredPropertiesInNamespace(_NAMESPACE)
    return {
        attribute.GetBaseName(): attribute.Get() for attribute in attributes if isinstance(attribute, Usd.Attribute)
    }


def write_settings(saved: SavedSettings, path: Path) -> None:
    """A USD file with the settings at /Render/settings, to lay over a stage. Raises OutputError."""
    stage = Usd.Stage.CreateInMemory()
    stage.SetMetadata("renderSettingsPrimPath", "/Render/settings")
    settings = UsdRender.Settings.Define(stage, "/Render/settings")
    if saved.camera:
        settings.CreateCameraRel().SetTargets([saved.camera])
    settings.CreateResolutionAttr(Gf.Vec2i(saved.resolution))
    settings.CreateDataWindowNDCAttr(Gf.Vec4f(saved.data_window))
    settings.CreateIncludedPurposesAttr(Vt.TokenArray(saved.purposes))
    settings.CreateRenderingColorSpaceAttr(saved.rendering_space)
    for name, value in saved.own.items():
        attribute = settings.GetPrim().CreateAttribute(f"{_NAMESPACE}:{name}", _TYPES[type(value)], custom=True)
        attribute.Set(value)
    _define_product(stage, settings, saved.variables)
    try:
        stage.GetRootLayer().Export(str(path))
    except Tf.ErrorException as error:
        raise OutputError(f"{path}: the settings cannot be written: {error}") from None


def _define_product(stage: Usd.Stage, settings: UsdRender.Settings, variables: tuple[Variable, ...]) -> None:
    product = UsdRender.Product.Define(stage, "/Render/product")
    settings.CreateProductsRel().SetTargets([product.GetPath()])
    for variable in variables:
        var = UsdRender.Var.Define(stage, f"/Render/Vars/{Tf.MakeValidIdentifier(variable.name)}")
        var.CreateSourceNameAttr(variable.source)
        var.CreateDataTypeAttr(variable.data_type)
        product.CreateOrderedVarsRel().AddTarget(var.GetPath())
