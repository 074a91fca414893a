"""A job whose stage is open."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from defshade_cli.farm.fingerprint import Fingerprint
from defshade_cli.farm.own_settings import with_own_settings
from defshade_cli.farm.shots import Shot, layers_of, make_shot, wanted_products
from defshade_cli.image.layers.extras import extras_of
from defshade_cli.image.layers.variables import layer_of
from defshade_cli.scene.product import Product
from defshade_cli.settings import RenderJob, RenderSettings
from defshade_cli.usd.blame import blaming
from defshade_cli.usd.opening.stage import first_frame, open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.render_settings.products import lost_products, read_products
from defshade_cli.usd.render_settings.saved_settings import read_own_settings

if TYPE_CHECKING:
    from defshade_cli.scene.framing import Framing
    from defshade_cli.scene.texture import ImageFile
    from defshade_cli.spaces import Matrix

log = logging.getLogger("defshade")


class OpenJob:
    """The frames of a job, the images of each, and a reader of the stage for each of the stage's products.

    frames: time codes, None standing for the default time.  Raises StageError.
    """

    def __init__(self, job: RenderJob) -> None:
        self._stage = open_stage(job.stage, job.composition, job.camera)
        self._readers: dict[str, StageReader] = {}
        self._fingerprints: dict[str, Fingerprint] = {}
        with blaming(self._stage):
            self._job = with_own_settings(job, read_own_settings(self._stage, job.render_settings))
            self.frames: tuple[float | None, ...] = job.frames or (first_frame(self._stage),)
            self._tell_what_is_lost()

    def shots(self, frame: float | None) -> list[Shot]:
        """The images of a frame. Raises StageError, UsageError."""
        with blaming(self._stage):
            products = self._products(frame)
            names = [self.reader(product).camera_name for product in products]
        several = len(products) > 1
        named = zip(products, names, strict=True)
        return [make_shot(self._job, frame, product, name, several=several) for product, name in named]

    def reader(self, product: Product) -> StageReader:
        """Reads the stage as the product is seen. Raises StageError."""
        if product.path not in self._readers:
            self._readers[product.path] = self._new_reader(product)
        return self._readers[product.path]

    def fingerprint(self, shot: Shot) -> str:
        """What the shot is made of, by farm.fingerprint."""
        path = shot.product.path
        if path not in self._fingerprints:
            self._fingerprints[path] = Fingerprint(shot.job)
        return self._fingerprints[path].of(shot.frame)

    def _products(self, frame: float | None) -> tuple[Product, ...]:
        return wanted_products(self._job, read_products(self._stage, self._job.render_settings, frame))

    def _tell_what_is_lost(self) -> None:
        for sentence in lost_products(self._stage, self._job.render_settings):
            log.warning("%s", sentence)
        for product in self._products(self.frames[0]) if not self._job.settings.layers else ():
            for lost in (variable for variable in product.variables if layer_of(variable) is None):
                log.warning("%s: no layer answers %s (%s %s)", product.path, lost.name, lost.source_type, lost.source)

    def _new_reader(self, product: Product) -> StageReader:
        job, settings = self._job, self._job.settings
        layers = {layer for other in self._products(self.frames[0]) for layer in layers_of(job, other)}
        options = ReadOptions(
            camera=job.camera,
            render_settings=job.render_settings,
            product=product.path,
            purposes=settings.purposes,
            complexity=settings.complexity,
            size=settings.size,
            width=settings.width,
            framing=_framing(settings),
            studio=settings.studio,
            extras=extras_of(layers),
            seen_from=_world_to_screen,
        )
        return StageReader(self._stage, options, beside=next(iter(self._readers.values()), None))


def _world_to_screen(file: ImageFile) -> Matrix | None:
    from defshade_cli.image.texture import world_to_screen

    return world_to_screen(file)


def _framing(settings: RenderSettings) -> Framing | None:
    """The camera of ours that is asked for."""
    if not (settings.fit or settings.turntable):
        return None
    from defshade_cli.scene.framing import THREE_QUARTER, Framing

    return Framing(settings.direction or THREE_QUARTER, settings.turntable)
