"""A job's images: each frame of each product that the stage asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path, PurePath

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.farm.names import has_frame_token, has_product_token
from defshade_cli.image.layers import BEAUTY, in_order, resolve
from defshade_cli.image.layers.variables import layer_of
from defshade_cli.scene.product import Product
from defshade_cli.settings import NamedLayer, RenderJob


@dataclass(frozen=True, slots=True)
class Shot:
    """One image of one frame.

    job: with layers and file patterns settled.  product: empty where the stage names none.
    camera: its name, for file names.
    """

    job: RenderJob
    frame: float | None
    product: Product
    camera: str


def wanted_products(job: RenderJob, products: Sequence[Product]) -> tuple[Product, ...]:
    """Those that `job` makes: the one it names, the first where its file names hold but one, else all.

    Raises UsageError for a product that the stage lacks.
    """
    if job.product is None:
        several = not job.output.patterns or all(map(has_product_token, job.output.patterns))
        return tuple(products) if several else tuple(products[:1])
    chosen = tuple(product for product in products if job.product in (product.path, product.name))
    if not chosen:
        known = ", ".join(product.path for product in products if product.path) or "none"
        raise UsageError(f"there is no product '{job.product}'; the render settings name {known}")
    return chosen[:1]


def make_shot(job: RenderJob, frame: float | None, product: Product, camera: str, *, several: bool = False) -> Shot:
    """The image of a product at a frame. several: the stage has more products, so that file names must tell them apart.

    Raises UsageError for a file name of the stage's that leaves the current folder.
    """
    variables, layers = _variables(job, product), layers_of(job, product)
    output = replace(job.output, patterns=_patterns(job, product, several=several), variables=variables)
    settings = replace(job.settings, layers=layers)
    return Shot(replace(job, settings=settings, output=output, product=product.path), frame, product, camera)


def layers_of(job: RenderJob, product: Product) -> tuple[str, ...]:
    """The layers of an image: as asked, else what answers the product's variables, else the beauty.

    Raises UsageError for a name that nobody has.
    """
    return in_order(resolve(job.settings.layers or [v.layer for v in _variables(job, product)] or [BEAUTY]))


def _variables(job: RenderJob, product: Product) -> tuple[NamedLayer, ...]:
    return () if job.settings.layers else _named_layers(product)


@cache
def _named_layers(product: Product) -> tuple[NamedLayer, ...]:
    """What answers the product's variables."""
    answers = ((variable, layer_of(variable)) for variable in product.variables)
    return tuple(NamedLayer(layer, variable.name, variable.width) for variable, layer in answers if layer)


def _patterns(job: RenderJob, product: Product, *, several: bool) -> tuple[str, ...]:
    if job.output.patterns or not job.output.fallback:
        return job.output.patterns
    if product.file:
        return (_product_pattern(product, frames=has_frame_token(job.output.fallback)),)
    return (job.output.fallback.replace("{scene}", "{scene}.{product}") if several else job.output.fallback,)


def _product_pattern(product: Product, *, frames: bool) -> str:
    """The product's file name, with a frame where there are several `frames` and it has none."""
    path = PurePath(product.file)
    if path.is_absolute() or ".." in path.parts:
        raise UsageError(f"{product.path} names {product.file}, outside the current folder; say with -o where it goes")
    name = product.file if path.suffix else f"{product.file}.exr"
    if frames and not has_frame_token(name):
        name = str(Path(name).with_suffix(f".####{Path(name).suffix}"))
    return name
