"""`defshade compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from defshade_cli.cli.options import HeadedCommand, epilog
from defshade_cli.cli.stats import plain
from defshade_cli.cli.types import Threshold
from defshade_cli.errors import UsageError

DIFFERENT = 1

Metrics = dict[str, dict[str, float]]

_EPILOG = epilog(
    "defshade compare before.exr after.exr",
    "defshade compare before.exr after.exr --threshold 0.001 --diff difference.exr",
    "defshade compare a.png b.png --threshold max=0.02 --threshold flip=0.05",
    "defshade compare before.exr after.exr --json",
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--threshold",
    "thresholds",
    type=Threshold(),
    metavar="[METRIC=]VALUE",
    multiple=True,
    help="Most that a metric may be in any layer, repeatable; a bare number is for rmse.",
)
@click.option(
    "--diff", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Write the absolute difference."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON in place of a table.")
@click.pass_context
def compare(
    context: click.Context,
    first: Path,
    second: Path,
    thresholds: tuple[tuple[str, float], ...],
    diff: Path | None,
    as_json: bool,
) -> None:
    """Compare the layers of images A and B.

    Ends with 1 where a metric of some layer is over its threshold.
    """
    from defshade_cli.image.compare import compare as measure
    from defshade_cli.image.compare import difference

    layers = measure(first, second)
    over = _over(layers, thresholds)
    if diff is not None:
        difference(first, second, diff)
    if as_json:
        click.echo(json.dumps(plain({"layers": layers, "over": over}), indent=2, allow_nan=False))
    else:
        _show(layers, over)
    context.exit(DIFFERENT if over else 0)


def _over(layers: Metrics, thresholds: tuple[tuple[str, float], ...]) -> list[dict[str, Any]]:
    """Every metric that is over its threshold. NaN is over any; UsageError for a metric that does not exist."""
    known = {name for metrics in layers.values() for name in metrics}
    for name, _ in thresholds:
        if name not in known:
            raise UsageError(f"no metric named {name!r}; there are {', '.join(sorted(known))}")
    return [
        {"layer": layer, "metric": name, "value": metrics[name], "threshold": threshold}
        for layer, metrics in layers.items()
        for name, threshold in thresholds
        if name in metrics and not metrics[name] <= threshold
    ]


def _show(layers: Metrics, over: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    names = list(dict.fromkeys(name for metrics in layers.values() for name in metrics))
    table = Table("layer", box=None)
    for name in names:
        table.add_column(name, justify="right")
    for layer, metrics in layers.items():
        table.add_row(layer, *(f"{metrics[name]:.6g}" if name in metrics else "" for name in names))
    Console(markup=False, highlight=False).print(table)
    for entry in over:
        click.echo(f"{entry['layer']}: {entry['metric']} {entry['value']:.6g} is over {entry['threshold']:g}", err=True)
