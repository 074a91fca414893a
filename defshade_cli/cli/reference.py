"""docs/commands.md from the commands themselves: `python -m defshade_cli.cli.reference`, which prints it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import click

from defshade_cli.cli import COMMANDS, command_of

_INTRODUCTION = """\
# Commands

<!-- Made by `make docs` from the commands' own help; edit the options in defshade_cli/cli/. -->

Results go to stdout, progress and errors to stderr. An error is one sentence; the
[exit code](getting-started.md#frames-and-farms) says whose it is.
"""


def reference() -> str:
    """The whole page, Markdown."""
    return "\n".join([_INTRODUCTION, *(_section(command) for command in map(command_of, sorted(COMMANDS)))])


def _section(command: click.Command) -> str:
    arguments = [param.human_readable_name for param in command.params if isinstance(param, click.Argument)]
    usage = " ".join(["defshade", str(command.name), "[OPTIONS]", *arguments])
    title = f"## defshade {command.name}\n\n`{usage}`\n\n{_unwrapped(command.help)}\n"
    return "\n".join([title, *_tables(command), f"```text\n{_unmarked(command.epilog)}\n```\n"])


def _tables(command: click.Command) -> Iterator[str]:
    options = [param for param in command.params if isinstance(param, click.Option)]
    for heading, group in itertools.groupby(options, lambda option: getattr(option, "heading", "Options")):
        yield f"| {heading} | |\n|---|---|"
        yield from (f"| `{_signature(option)}` | {_cell(option.help)} |" for option in group)
        yield ""


def _signature(option: click.Option) -> str:
    """`-o, --output FILE`"""
    names = ", ".join(option.opts)
    if option.is_flag:
        return names
    choices = option.type.choices if isinstance(option.type, click.Choice) else [str(option.metavar)]
    return f"{names} {_cell('|'.join(choices))}"


def _cell(text: str | None) -> str:
    return " ".join((text or "").split()).replace("|", "\\|")


def _unwrapped(text: str | None) -> str:
    """Paragraphs, each on one line."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in (text or "").split("\n\n"))


def _unmarked(epilog: str | None) -> str:
    """Without the marks that keep click from wrapping."""
    return (epilog or "").replace("\b\n", "")


if __name__ == "__main__":
    click.echo(reference(), nl=False)
