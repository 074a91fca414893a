"""What the shells offer at the Tab key; that they ask is click's own."""

from __future__ import annotations

import pytest
from click.shell_completion import ShellComplete

from defshade_cli import cli


def offered(*words: str) -> list[str]:
    """For the last of the words behind `defshade`."""
    shell = ShellComplete(cli.defshade, {}, "defshade", "_DEFSHADE_COMPLETE")
    return [item.value for item in shell.get_completions(list(words[:-1]), words[-1])]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["ren"], ["render"]),
        (["render", "--sha"], ["--shading", "--shadows"]),
        (["render", "--gbuffer", "p"], ["packed"]),
        (["render", "--layers", "dep"], ["depth"]),
        (["render", "--layers", "beauty,dep"], ["beauty,depth"]),
        (["render", "--layers", "depth,de"], []),
        (["render", "--layers", "lig"], ["lightComplexity", "light:"]),
        (["render", "--purposes", "render,pr"], ["render,proxy"]),
        (["render", "--direction", "l"], ["left"]),
    ],
)
def test_names_are_completed(words: list[str], expected: list[str]) -> None:
    assert offered(*words) == expected


def test_outputs_are_completed_as_files() -> None:
    shell = ShellComplete(cli.defshade, {}, "defshade", "_DEFSHADE_COMPLETE")
    assert [item.type for item in shell.get_completions(["render", "-o"], "out/")] == ["file"]
