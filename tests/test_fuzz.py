"""Input that lies leads to a picture without it, or to one sentence; never to a bug, a hang or a file elsewhere."""

from __future__ import annotations

import gc
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf

from defshade_cli.errors import DefshadeError, StageError
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.measure.fuzz.campaign import FAULTS, fuzz, verdict
from defshade_cli.measure.fuzz.corpus import Corpus
from defshade_cli.measure.fuzz.mutations import ANYWHERE, IN_TEXT, Mutation, mutated
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.stress.stage import StressStage
from defshade_cli.rendering import run
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

_TEXT = b'#usda 1.0\ndef Sphere "a" {\n    double radius = 2.5\n    rel material:binding = </b>\n}\n'


def test_lies_hurt_nothing(tmp_path: Path) -> None:
    """A few of `make fuzz`."""
    found = Counter(kind for *_, kind in fuzz(range(40), 5, tmp_path))
    assert found.total() == 40
    assert not any(found[kind] for kind in FAULTS), found
    assert found["rendered"] >= 10


def test_a_case_is_the_same_whatever_came_before(tmp_path: Path) -> None:
    corpus = Corpus(tmp_path)
    contents = []
    for number in (3, 0, 1, 2, 3):
        case = corpus.case(number, 1)
        contents.append((case, case.changed.read_bytes()))
    assert contents[0] == contents[-1]


@pytest.mark.parametrize("mutation", (*ANYWHERE, *IN_TEXT), ids=lambda mutation: mutation.__name__)
def test_a_mutation_changes_what_it_can(mutation: Mutation) -> None:
    changed = [mutation(_TEXT, np.random.default_rng(seed)) for seed in range(20)]
    assert len(set(changed)) > 5


def test_nothing_cannot_lie() -> None:
    assert mutated(b"", ".usda", np.random.default_rng(0)) == b""


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        ("", "rendered"),
        ("it took more than 10 s", "hang"),
        ("it took more than 2048 MiB of memory", "memory"),
        ("its worker process was killed by SIGSEGV", "crash contained"),
        ("its worker process ended with 1", "bug"),
    ],
)
def test_verdicts(error: str, kind: str) -> None:
    outcome = Outcome(Chunk(RenderJob(Path("a.usda"))), None, error=error)
    assert verdict(outcome, strayed=False) == kind
    assert verdict(outcome, strayed=True) == "a file outside"


@pytest.mark.parametrize(
    ("stage", "path", "said"),
    [
        (StressStage(ball="double3 xformOp:scale = (1, 2, 3)",
                     ball_ops='string xformOp:translate = "x"\nuniform token[] xformOpOrder = ["xformOp:translate"]'),
         "/ball", "TypeTranslate"),
        (StressStage(surface='string inputs:ior = "x"'), "/surface", "ior"),
        (StressStage(lights='def SphereLight "bulb" {\nstring inputs:radius = "x"\n}'), "/bulb", "inputs:radius"),
        (StressStage(lights='def SphereLight "bulb" {\nnonsense inputs:color = (1, 1, 1)\n}'), "/bulb", "inputs:color"),
    ],
)  # fmt: skip
def test_values_of_another_type_cost_their_prim_and_are_named(
    stage: StressStage, path: str, said: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "lie.usda"
    file.write_text(stage.text())
    scene = first_frame(file)
    assert any(issue.path == path and said in issue.reason for issue in scene.unsupported), scene.unsupported
    assert [paths for d in scene.drawables for paths in d.paths][-1] == "/floor"
    assert said in caplog.text


def test_an_error_lets_go_of_its_stage(tmp_path: Path) -> None:
    """Else the next job of the same process would get the stage as it was, however the file has changed."""
    file = tmp_path / "stage.usda"
    blind = StressStage(camera="float horizontalAperture = 0")
    bulb = 'def SphereLight "bulb" {\nfloat inputs:intensity = 1e10\nLIGHT_OPS\n}'
    loud = StressStage(surface="color3f inputs:diffuseColor = (1e38, 1, 1)", lights=bulb)
    output = OutputSettings((str(tmp_path / "out.exr"),))
    gc.disable()
    try:
        for stage in (blind, loud):
            file.write_text(stage.text())
            with pytest.raises(DefshadeError):
                list(run(RenderJob(file, settings=RenderSettings(size=(16, 9)), output=output)))
            assert not Sdf.Layer.Find(str(file))
    finally:
        gc.enable()


def test_a_stage_that_cannot_be_composed_is_one_sentence(tmp_path: Path) -> None:
    part, stage = tmp_path / "part.usda", tmp_path / "stage.usda"
    part.write_text('#usda 1.0\ndef Mesh "m" {\nint[] faceVertexCounts = [(1, 2, 3)]\n}')
    stage.write_text('#usda 1.0\ndef "m" (references = @./part.usda@</m>) {\n}')
    with pytest.raises(StageError, match="cannot be composed"):
        first_frame(stage)
