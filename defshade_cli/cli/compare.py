"""`defshade compare`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from defshade_cli.cli.names import Threshold
from defshade_cli.cli.options import HeadedCommand, epilog
from defshade_cli.cli.stats import plain
from defshade_cli.errors import UsageError
from defshade_cli.settings import OutputSettings

if TYPE_CHECKING:
    from defshade_cli.image.compare import Comparison
    from defshade_cli.scene.camera import Camera

DIFFERENT = 1
METRICS = ("rmse", "rel_mse", "max_error", "flip", "delta_e")

_EPILOG = epilog(
    "defshade compare after.exr before.exr",
    "defshade compare after.exr before.exr --threshold 0.001 --diff difference.exr",
    "defshade compare after.png before.png --threshold max_error=0.02 --threshold flip=0.05",
    "defshade compare noisy.exr reference.exr --flip --json",
)


class Excess(NamedTuple):
    """A layer's metric that is over its threshold."""

    layer: str
    metric: str
    value: float
    threshold: float


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@click.argument("image", metavar="A", type=click.Path(path_type=Path))
@click.argument("reference", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--threshold",
    "thresholds",
    type=Threshold(METRICS),
    metavar="[METRIC=]VALUE",
    multiple=True,
    help=f"The most that a metric may be in any layer, repeatable: {', '.join(METRICS)}; a bare number is for rmse.",
)
@click.option("--flip", is_flag=True, help="Measure FLIP too, the difference as seen: seconds a megapixel.")
@click.option("--delta-e", is_flag=True, help="Measure CIE ΔE2000 too, the difference of colours.")
@click.option(
    "--flip-map", type=click.Path(path_type=Path), metavar="FILE", help="Write FLIP as a heat map, a picture."
)
@click.option("--diff", type=click.Path(path_type=Path), metavar="FILE", help="Write the absolute difference.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON in place of a table.")
@click.pass_context
def compare(
    context: click.Context,
    image: Path,
    reference: Path,
    thresholds: tuple[tuple[str, float], ...],
    flip: bool,
    delta_e: bool,
    flip_map: Path | None,
    diff: Path | None,
    as_json: bool,
) -> None:
    """Compare the layers of images A and B.

    B is the reference. Ends with 1 where a metric of some layer is over its threshold, or where one image has a NaN
    or an infinity that the other has not.
    """
    from defshade_cli.image.compare import compare as measure

    wanted = {metric for metric, _ in thresholds}
    wants_flip = flip or flip_map is not None or "flip" in wanted
    layers = measure(image, reference, flip=wants_flip, colour=delta_e or "delta_e" in wanted)
    if wants_flip and all(layer.flip is None for layer in layers):
        raise UsageError("FLIP is of colour layers, and needs the package flip-evaluator")
    excesses = list(_excesses(layers, thresholds))
    if diff is not None:
        _write_difference(image, reference, diff)
    if flip_map is not None:
        _write_flip_map(image, reference, flip_map)
    if as_json:
        record = {"layers": layers, "over": [excess._asdict() for excess in excesses]}
        click.echo(json.dumps(plain(record), indent=2, allow_nan=False))
    else:
        _show(layers, excesses)
    context.exit(DIFFERENT if excesses else 0)


def _excesses(layers: Sequence[Comparison], thresholds: Sequence[tuple[str, float]]) -> Iterator[Excess]:
    """What is over its threshold; once there is any threshold, values that are finite in one image alone too."""
    for layer in layers:
        if thresholds and layer.unmatched:
            yield Excess(layer.layer, "unmatched", layer.unmatched, 0)
        for metric, threshold in thresholds:
            value = getattr(layer, metric)
            if value is not None and value > threshold:
                yield Excess(layer.layer, metric, value, threshold)


def _write_difference(image: Path, reference: Path, path: Path) -> None:
    """|A − B| of the layers that both have; the alpha of a difference would hide it, so it is 1."""
    import numpy as np

    from defshade_cli.image.compare import difference
    from defshade_cli.image.files import write
    from defshade_cli.image.film import Film
    from defshade_cli.image.layers import BEAUTY, LAYERS
    from defshade_cli.image.reading import read

    first, second = read(image), read(reference)
    layers = {name: difference(first[name], second[name]) for name in LAYERS if name in first and name in second}
    if BEAUTY in layers:
        rgb = layers[BEAUTY][..., :3]
        layers[BEAUTY] = np.concatenate([rgb, np.ones_like(rgb[..., :1])], axis=-1)
    write(Film(layers, _nowhere(), path.stem), OutputSettings(full_float=True), path)


def _write_flip_map(image: Path, reference: Path, path: Path) -> None:
    """The beauty's FLIP from black over red to white: matplotlib's magma, as the authors have it."""
    from defshade_cli.image.compare import is_picture
    from defshade_cli.image.files import write
    from defshade_cli.image.film import Film
    from defshade_cli.image.layers import BEAUTY, Layer
    from defshade_cli.image.perception import heat_map
    from defshade_cli.image.reading import read

    pixels = heat_map(read(image)[BEAUTY], read(reference)[BEAUTY], is_picture(reference))
    row = Layer("flip", ("R", "G", "B"), "0..1", "none", "flip", 0.0, True, "FLIP as a heat map")
    write(Film({BEAUTY: pixels}, _nowhere(), path.stem, rows={BEAUTY: row}), OutputSettings(), path)


def _nowhere() -> Camera:
    """The camera of a film that none has seen."""
    import numpy as np

    from defshade_cli.scene.camera import Camera

    return Camera("<difference>", np.eye(4), (-1.0, 1.0, -1.0, 1.0))


def _show(layers: Sequence[Comparison], excesses: Sequence[Excess]) -> None:
    from rich.console import Console
    from rich.table import Table

    metrics = [name for name in (*METRICS, "psnr", "unmatched") if any(getattr(c, name) is not None for c in layers)]
    table = Table("layer", box=None)
    for metric in metrics:
        table.add_column(metric, justify="right")
    for layer in layers:
        values = (getattr(layer, metric) for metric in metrics)
        table.add_row(layer.layer, *("" if value is None else f"{value:.6g}" for value in values))
    Console(markup=False, highlight=False).print(table)
    for excess in excesses:
        click.echo(f"{excess.layer}: {excess.metric} {excess.value:.6g} is over {excess.threshold:g}", err=True)
