"""The documents tell the truth: every option has help, every command shown parses, every link leads somewhere."""

from __future__ import annotations

import importlib
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from defshade_cli import cli
from defshade_cli.cli.reference import reference
from defshade_cli.image.layers import LAYERS
from defshade_cli.measure.accuracy_plot import accuracy_plot, errors_in

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "shaders").rglob("*.md")])
COMMANDS = sorted(cli.COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_command_and_options_have_help(name: str) -> None:
    command = cli.command_of(name)
    assert command.help, f"defshade {name} needs a docstring"
    assert "Examples:" in (command.epilog or ""), f"defshade {name} needs examples in its epilog"
    options = [param for param in command.params if isinstance(param, click.Option)]
    assert not [option.opts for option in options if not option.help]


def test_reference_is_up_to_date() -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert page == reference(), "docs/commands.md is stale: run `make docs`"


def test_plot_of_accuracy_is_up_to_date() -> None:
    errors = errors_in((ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8"))
    assert len(errors) > 20
    plot = (ROOT / "docs" / "images" / "accuracy.svg").read_text(encoding="utf-8")
    stale = "docs/images/accuracy.svg is stale: run `python -m defshade_cli.measure.accuracy_plot docs/accuracy.md`"
    assert plot == accuracy_plot(errors), stale


def test_plot_of_lights_is_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    lights = importlib.import_module("lights_plot")
    seconds = lights.seconds_in((ROOT / "docs" / "performance.md").read_text(encoding="utf-8"))
    assert [len(row) for row in seconds.values()] == [6, 6, 3]
    plot = (ROOT / "docs" / "images" / "lights.svg").read_text(encoding="utf-8")
    stale = "docs/images/lights.svg is stale: run `python benchmarks/lights_plot.py docs/performance.md`"
    assert plot == lights.lights_plot(seconds), stale


@pytest.mark.parametrize("name", COMMANDS)
def test_readme_names_every_command(name: str) -> None:
    assert f"defshade {name}" in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", LAYERS)
def test_conventions_define_every_layer(name: str) -> None:
    """With the channels and the unit of the table."""
    layer = LAYERS[name]
    row = rf"^\| `{name}` \| {' '.join(layer.channels)} \| {re.escape(layer.unit)} \|"
    assert re.search(row, (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8"), re.MULTILINE)


def _shown_commands() -> Iterator[tuple[str, str]]:
    """Every `defshade …` line in code blocks and code spans, comments, pipes and redirections cut off."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        lines = [line.strip() for block in blocks for line in block.splitlines()]
        spans = re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text)
        for line in [*lines, *spans]:
            if found := re.match(r"(?:\$ )?(?:\.venv/bin/)?(defshade [a-z].*)", line):
                yield page.name, re.split(r"\s+(?:#|\||>|&&|;)", found[1])[0]


def _is_usage(line: str) -> bool:
    return "[OPTIONS]" in line or "COMMAND" in line


@pytest.mark.parametrize(
    ("page", "line"), sorted({(page, line) for page, line in _shown_commands() if not _is_usage(line)})
)
def test_shown_command_parses(page: str, line: str) -> None:
    arguments = shlex.split(line)[1:]
    command = cli.command_of(arguments[0]) if arguments[0] in COMMANDS else None
    assert command is not None, f"{page} shows {line!r}, and there is no such command"
    if len(arguments) > 1:
        with command.make_context(arguments[0], arguments[1:]) as context:
            assert context.params


def _anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    for link in links:
        target, _, anchor = link.partition("#")
        if "://" in link or target.endswith(".png"):
            continue
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f"{page.name} links to {link}, which is not there"
        assert not anchor or anchor in _anchors(path), f"{page.name} links to {link}: no such heading"


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md", "docs/conventions.md"])
def test_named_files_exist(page: str) -> None:
    """Every path in a code span; those with a placeholder stand for many."""
    spans = re.findall(r"`([\w./-]+/[\w.-]*|[\w-]+\.(?:py|md|toml|glsl))`", (ROOT / page).read_text(encoding="utf-8"))
    homes = (ROOT, ROOT / "defshade_cli", ROOT / "docs")
    missing = [span for span in spans if not any((home / span).exists() for home in homes)]
    assert not missing, f"{page} names files that are not there: {', '.join(missing)}"
