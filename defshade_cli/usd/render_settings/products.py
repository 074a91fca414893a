"""UsdRenderSettings prims and the products that they name."""

from __future__ import annotations

import logging
from collections.abc import Iterator

from pxr import Usd, UsdRender

from defshade_cli.errors import PrimNotFound
from defshade_cli.scene.product import Product, Variable

log = logging.getLogger("defshade")


def find_settings(stage: Usd.Stage, path: str | None = None) -> UsdRender.Settings | None:
    """The settings prim at `path`, or that a RenderPass there renders from; without a path the one that the stage's
    renderSettingsPrimPath names, else the first below /Render.

    Raises PrimNotFound for a path without settings.
    """
    if path is None:
        return UsdRender.Settings.GetStageRenderSettings(stage) or _first_settings(stage)
    prim = stage.GetPrimAtPath(path) if path.startswith("/") else None
    if prim and prim.IsA(UsdRender.Pass):
        sources = UsdRender.Pass(prim).GetRenderSourceRel().GetForwardedTargets()
        prim = stage.GetPrimAtPath(sources[0]) if sources else None
    if not prim or not prim.IsA(UsdRender.Settings):
        known = ", ".join(str(found.GetPath()) for found in _all_settings(stage)) or "none"
        raise PrimNotFound(f"there are no render settings at '{path}'; the stage has {known}")
    return UsdRender.Settings(prim)


def read_products(stage: Usd.Stage, settings: str | None, frame: float | None) -> tuple[Product, ...]:
    """The raster products of the settings, in order; one without a path where there are none.

    Raises PrimNotFound as find_settings.
    """
    time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
    found = find_settings(stage, settings)
    products = tuple(_product(product, time) for product in _raster_products(found)) if found else ()
    return products or (Product(),)


def lost_products(stage: Usd.Stage, settings: str | None) -> Iterator[str]:
    """A sentence for each product of the settings, and for each of their variables, that read_products leaves out.

    Raises PrimNotFound for settings that the stage lacks.
    """
    found = find_settings(stage, settings)
    if not found:
        return
    for path in found.GetProductsRel().GetForwardedTargets():
        product = UsdRender.Product.Get(stage, path)
        if not product:
            yield f"{found.GetPath()} names a product {path} that the stage lacks"
        elif product.GetProductTypeAttr().Get() == UsdRender.Tokens.deepRaster:
            yield f"{path} is left out: deep images are not rendered"
        else:
            targets = product.GetOrderedVarsRel().GetForwardedTargets()
            lost = (str(target) for target in targets if not UsdRender.Var.Get(stage, target))
            yield from (f"{path} names a variable {target} that the stage lacks" for target in lost)


def _all_settings(stage: Usd.Stage) -> list[Usd.Prim]:
    return [prim for prim in stage.Traverse() if prim.IsA(UsdRender.Settings)]


def _first_settings(stage: Usd.Stage) -> UsdRender.Settings | None:
    folder = stage.GetPrimAtPath("/Render")
    found = [prim for prim in Usd.PrimRange(folder) if prim.IsA(UsdRender.Settings)] if folder else []
    if len(found) > 1:
        log.info("of %d render settings %s is taken; --settings takes another", len(found), found[0].GetPath())
    return UsdRender.Settings(found[0]) if found else None


def _raster_products(settings: UsdRender.Settings) -> Iterator[UsdRender.Product]:
    stage = settings.GetPrim().GetStage()
    products = (UsdRender.Product.Get(stage, path) for path in settings.GetProductsRel().GetForwardedTargets())
    deep = UsdRender.Tokens.deepRaster
    yield from (product for product in products if product and product.GetProductTypeAttr().Get() != deep)


def _product(product: UsdRender.Product, time: Usd.TimeCode) -> Product:
    stage = product.GetPrim().GetStage()
    targets = product.GetOrderedVarsRel().GetForwardedTargets()
    variables = (UsdRender.Var.Get(stage, target) for target in targets)
    name = product.GetProductNameAttr().Get(time) or ""
    return Product(str(product.GetPath()), str(name), tuple(_variable(var) for var in variables if var))


def _variable(var: UsdRender.Var) -> Variable:
    name = var.GetPrim().GetName()
    return Variable(
        name=name,
        source=str(var.GetSourceNameAttr().Get() or name),
        source_type=str(var.GetSourceTypeAttr().Get()),
        data_type=str(var.GetDataTypeAttr().Get()),
    )
