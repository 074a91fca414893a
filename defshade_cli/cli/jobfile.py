"""Job files: what a batch renders, as YAML.

    stages: [shots/*.usda]            paths relative to the job file, with * ? [ ] **
    frames: 1:48                      as --frames has them
    cameras: [/cams/left, /cams/right]
    settings:                         options of the command, without the dashes
      samples: 16
      size: 1280x720
    outputs: ["renders/{scene}/{camera}.####.exr"]

Only `stages` must be there. An option that is given on the command line counts in place of the file's.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click
from click.core import ParameterSource

from defshade_cli.errors import UsageError

if TYPE_CHECKING:
    from yaml.nodes import MappingNode, ScalarNode, SequenceNode

    Node = ScalarNode | SequenceNode | MappingNode

JOB_SUFFIXES = (".yaml", ".yml")

_KEYS = ("stages", "frames", "cameras", "settings", "outputs")
_OPTIONS = {"frames": "frames", "cameras": "camera", "outputs": "patterns"}
"""Keys that stand for an option, which `settings` cannot name then."""

_HEADINGS = ("Stage", "Image", "Output")


def read_job_file(path: Path, context: click.Context) -> list[dict[str, Any]]:
    """Option values by parameter name, `scene` among them, one dict for each stage and camera.

    Raises UsageError with file and line.
    """
    file = _JobFile(path, context)
    keys = file.mapping(file.root(), _KEYS)
    if "stages" not in keys:
        raise UsageError(f"{path}: a job file names its stages: stages: [shot.usda]")
    shared = file.settings(keys["settings"]) if "settings" in keys else {}
    if "frames" in keys:
        shared["frames"] = file.value("frames", ",".join(file.texts(keys["frames"])), keys["frames"])
    if "outputs" in keys:
        shared["patterns"] = tuple(file.texts(keys["outputs"]))
    cameras = file.texts(keys["cameras"]) if "cameras" in keys else [None]
    shots = [{"scene": stage, "camera": camera} for stage in file.stages(keys["stages"]) for camera in cameras]
    given = {name for name in context.params if _is_given(context, name)}
    return [
        {name: value for name, value in (shared | shot).items() if name not in given and value is not None}
        for shot in shots
    ]


class _JobFile:
    """A YAML tree whose nodes know their lines, and the options that its values are for.

    Scalars are read as they were typed: to YAML `1:48` is a number in base 60.
    """

    def __init__(self, path: Path, context: click.Context) -> None:
        self._path, self._context = path, context
        self._options = {param.name: param for param in context.command.params if isinstance(param, click.Option)}

    def root(self) -> Node:
        import yaml

        try:
            root = yaml.compose(self._path.read_text(encoding="utf-8"), yaml.SafeLoader)
        except OSError as error:
            raise UsageError(f"{self._path}: {error.strerror}") from error
        except yaml.MarkedYAMLError as error:
            line = error.problem_mark.line + 1 if error.problem_mark else 1
            raise UsageError(f"{self._path}:{line}: not YAML: {error.problem}") from error
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise UsageError(f"{self._path}: not YAML: {str(error).splitlines()[0]}") from error
        if root is None:
            raise UsageError(f"{self._path}: is empty")
        return cast("Node", root)  # of the types that compose makes

    def mapping(self, node: Node, known: Collection[str]) -> dict[str, Node]:
        if node.id != "mapping":
            raise self._wrong(node, f"expected keys of {', '.join(known)}")
        values: dict[str, Node] = {}
        for key, value in node.value:
            if key.value not in known:
                raise self._wrong(key, f"unknown key {key.value!r}; {_suggestion(str(key.value), known)}")
            if key.value in values:
                raise self._wrong(key, f"{key.value!r} stands here a second time")
            values[key.value] = value
        return values

    def texts(self, node: Node) -> list[str]:
        """A scalar, or a list of them."""
        items = node.value if node.id == "sequence" else [node]
        for item in items:
            if item.id != "scalar" or not item.value:
                raise self._wrong(item, "expected a value or a list of values")
        return [item.value for item in items]

    def settings(self, node: Node) -> dict[str, Any]:
        names = dict(self._setting_names())
        nodes = self.mapping(node, names)
        return {names[key]: self.setting(names[key], value) for key, value in nodes.items()}

    def setting(self, name: str, node: Node) -> Any:
        """A list is several values for an option that is repeatable, else one with commas. Files lie beside ours."""
        texts, option = self.texts(node), self._options[name]
        if isinstance(option.type, click.Path):
            texts = [str(self._path.parent / text) for text in texts]
        if option.multiple:
            return tuple(self.value(name, text, node) for text in texts)
        return self.value(name, ",".join(texts), node)

    def value(self, name: str, text: str, node: Node) -> Any:
        """`text` as the option reads it."""
        option = self._options[name]
        try:
            return option.type.convert(text, option, self._context)
        except click.BadParameter as error:
            raise self._wrong(node, error.message) from error

    def stages(self, node: Node) -> Iterator[Path]:
        for pattern in self.texts(node):
            path = self._path.parent / pattern
            found = sorted(glob(str(path), recursive=True)) if has_magic(pattern) else [str(path)]  # noqa: PTH207  absolute too
            if not found:
                raise self._wrong(node, f"no file matches {pattern!r}")
            yield from map(Path, found)

    def _setting_names(self) -> Iterator[tuple[str, str]]:
        """(key, parameter name) of what `settings` may hold: `gbuffer` for --gbuffer."""
        for name, option in self._options.items():
            if getattr(option, "heading", "") in _HEADINGS and name not in _OPTIONS.values():
                yield max(option.opts, key=len).removeprefix("--"), str(name)

    def _wrong(self, node: Node, problem: str) -> UsageError:
        return UsageError(f"{self._path}:{node.start_mark.line + 1}: {problem}")


def _is_given(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is ParameterSource.COMMANDLINE and name != "sources"


def _suggestion(name: str, known: Collection[str]) -> str:
    close = difflib.get_close_matches(name, known, 1)
    return f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
