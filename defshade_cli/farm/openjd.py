"""A batch as an Open Job Description template, for farms that schedule themselves.

    https://github.com/OpenJobDescription/openjd-specifications, 2023-09 Template Schemas; extension TASK_CHUNKING

A step holds the stages that share frames and options; its tasks are one stage and a chunk of frames each.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.farm.frames import OPENJD
from defshade_cli.settings import RenderJob

TIMEOUT = 4 * 3600
"""Seconds that a chunk may take."""

_MOST_STAGES = 1024  # values in a task parameter's range
_PARAMETERS = [
    {
        "name": "Folder",
        "type": "PATH",
        "objectType": "DIRECTORY",
        "dataFlow": "INOUT",
        "default": ".",
        "description": "What relative paths of stages and images start from.",
    },
    {
        "name": "Defshade",
        "type": "STRING",
        "default": "defshade",
        "description": "The program, as the hosts find it.",
    },
    {"name": "ChunkFrames", "type": "INT", "default": 16, "minValue": 1, "description": "Frames in a chunk."},
    {
        "name": "ChunkSeconds",
        "type": "INT",
        "default": 600,
        "minValue": 0,
        "description": "How long a chunk should take, for schedulers that size chunks as they learn.",
    },
]


@dataclass(frozen=True, slots=True)
class _Group:
    """What the stages of one step have in common."""

    frames: tuple[float | None, ...]
    session_layers: tuple[Path, ...]
    options: tuple[str, ...]
    patterns: tuple[str, ...]
    absolute: bool

    @property
    def has_frames(self) -> bool:
        """Not so for a stage's first frame, and for the default time."""
        return self.frames not in ((), (None,))


def make_template(jobs: Iterable[tuple[RenderJob, Sequence[str]]]) -> dict[str, Any]:
    """The template of jobs, each with its options on the command line, those for files and frames apart.

    Raises UsageError for frames that are not whole numbers.
    """
    groups: dict[_Group, list[Path]] = {}
    for job, options in jobs:
        layers, patterns = job.composition.session_layers, job.output.patterns or (job.output.fallback,)
        group = _Group(job.frames, layers, tuple(options), patterns, job.stage.is_absolute())
        groups.setdefault(group, []).append(job.stage)
    parts = [
        (group, stages[start : start + _MOST_STAGES])
        for group, stages in groups.items()
        for start in range(0, len(stages), _MOST_STAGES)
    ]
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": "defshade",
        "parameterDefinitions": _PARAMETERS,
        "steps": [_step(f"Render{number}", *part) for number, part in enumerate(parts, start=1)],
    }


def range_expression(frames: Iterable[float | None]) -> str:
    """`1-5:2,9`: the frames in order, as an OpenJD <IntRangeExpr>. Raises UsageError for parts of frames."""
    numbers = sorted({_whole(frame) for frame in frames})
    runs: list[list[int]] = []
    for number in numbers:
        if runs and (len(runs[-1]) == 1 or number - runs[-1][-1] == runs[-1][1] - runs[-1][0]):
            runs[-1].append(number)
        else:
            runs.append([number])
    return ",".join(_run_expression(run) for run in runs)


def _step(name: str, group: _Group, stages: Sequence[Path]) -> dict[str, Any]:
    kind = "PATH" if group.absolute else "STRING"
    parameters: list[dict[str, Any]] = [{"name": "Stage", "type": kind, "range": [str(stage) for stage in stages]}]
    if group.has_frames:
        parameters.append(_frame_parameter(group))
    return {
        "name": name,
        "hostRequirements": _host_requirements(),
        "parameterSpace": {"taskParameterDefinitions": parameters},
        "script": {
            "actions": {"onRun": {"command": "{{Param.Defshade}}", "args": _arguments(group), "timeout": TIMEOUT}}
        },
    }


def _host_requirements() -> dict[str, Any]:
    """Anew for each step: YAML would write one that is shared as an alias, which not every parser allows."""
    return {
        "amounts": [{"name": "amount.worker.vcpu", "min": 1}, {"name": "amount.worker.memory", "min": 2048}],
        "attributes": [{"name": "attr.worker.os.family", "anyOf": ["linux"]}],
    }


def _frame_parameter(group: _Group) -> dict[str, Any]:
    return {
        "name": "Frame",
        "type": "CHUNK[INT]",
        "range": range_expression(group.frames),
        "chunks": {
            "defaultTaskCount": "{{Param.ChunkFrames}}",
            "targetRuntimeSeconds": "{{Param.ChunkSeconds}}",
            "rangeConstraint": "NONCONTIGUOUS",
        },
    }


def _arguments(group: _Group) -> list[str]:
    stage = "{{Task.Param.Stage}}" if group.absolute else "{{Param.Folder}}/{{Task.Param.Stage}}"
    frames = (
        ["--frames", OPENJD + "{{Task.Param.Frame}}"] if group.has_frames else ["--default-time"] * len(group.frames)
    )
    layers = [part for path in group.session_layers for part in ("--session-layer", _placed(str(path)))]
    outputs = [part for pattern in group.patterns for part in ("-o", _placed(pattern))]
    return ["render", stage, *frames, *layers, *group.options, *outputs, "--progress", "openjd"]


def _placed(file: str) -> str:
    return file if Path(file).is_absolute() else f"{{{{Param.Folder}}}}/{file}"


def _whole(frame: float | None) -> int:
    if frame is None or frame != int(frame):
        raise UsageError(f"frame {frame}: Open Job Description has whole frames only")
    return int(frame)


def _run_expression(run: Sequence[int]) -> str:
    if len(run) == 1:
        return str(run[0])
    step = next(second - first for first, second in pairwise(run))
    return f"{run[0]}-{run[-1]}" + (f":{step}" if step > 1 else "")
