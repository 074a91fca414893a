"""Options and commands that group their `--help` under headings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from defshade_cli.image.layers import ALIASES, FAMILIES, LAYERS, Layer

Function = Callable[..., Any]


class Option(click.Option):
    """An option that knows the heading it stands under in `--help`, and says its default in our own words."""

    def __init__(self, *args: Any, heading: str, default_text: str = "", **kwargs: Any) -> None:
        if default_text:
            kwargs["help"] += f"  [default: {default_text}]"
        super().__init__(*args, **kwargs)
        self.heading = heading


class HeadedCommand(click.Command):
    """A command whose `--help` groups the options under their headings."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = None if isinstance(param, click.Argument) else param.get_help_record(ctx)
            if record is not None:
                sections.setdefault(getattr(param, "heading", "Options"), []).append(record)
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records)


def epilog(*examples: str, layers: bool = False) -> str:
    r"""What stands below a command's options: examples, the table of layers. \b keeps click from wrapping."""
    paragraphs = ["\b\nExamples:\n" + "\n".join(f"  {example}" for example in examples)]
    if layers:
        rows = [*LAYERS.items(), *((layer.name, layer) for layer in FAMILIES.values())]
        lines = (f"  {name:<20}{_channels(layer):<7}{layer.summary}" for name, layer in rows)
        paragraphs.append("\b\nLayers:\n" + "\n".join(lines))
        known_as = (f"{theirs} {ours}" for theirs, ours in ALIASES.items())
        paragraphs.append("Other names of layers: " + ", ".join(known_as) + ".")
    return "\n\n".join(paragraphs)


def _channels(layer: Layer) -> str:
    """RGB; of a Cryptomatte with its many channels the first."""
    return "".join(layer.channels) if len(layer.channels) <= 4 else f"{layer.channels[0]}…"
