"""`defshade bench`: the front and what is recommended in closed form, a sweep end to end at a tiny size."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli import render
from defshade_cli.cli.bench import bench
from defshade_cli.errors import OutputError, UsageError
from defshade_cli.image.files import write
from defshade_cli.measure.bench import Trial, cheapest_within, pareto_front
from defshade_cli.measure.bench.trial import Choice
from defshade_cli.settings import OutputSettings

TINY = ("--size", "32x18", "--layouts", "float,rgba8", "--samples", "1,4", "--rounds", "1", "--no-flip", "-q")


def trial(wall: float, rel_mse: float, samples: int = 1) -> Trial:
    return Trial(Choice("float", samples, True, "box"), wall, 2 * wall, rel_mse, None)


figures = st.lists(st.tuples(st.floats(1e-3, 10), st.floats(0, 1)), min_size=1, max_size=12)


@given(figures)
def test_the_front_holds_what_none_beats(values: list[tuple[float, float]]) -> None:
    trials = [trial(*value) for value in values]
    front = pareto_front(trials, "wall")
    for each in trials:
        beaten = any(o.wall <= each.wall and o.rel_mse <= each.rel_mse and o != each for o in trials)
        assert (each in front) or beaten
    assert [t.wall for t in front] == sorted(t.wall for t in front)
    assert [t.rel_mse for t in front] == sorted({t.rel_mse for t in front}, reverse=True)


def test_the_cheapest_that_is_accurate_enough() -> None:
    trials = [trial(1.0, 0.1), trial(2.0, 0.01), trial(3.0, 0.001)]
    assert cheapest_within(trials, 0.05, "cpu") is trials[1]
    assert cheapest_within(trials, 1e-6, "wall") is None


def test_a_choice_reads_as_its_options() -> None:
    assert str(Choice("packed", 4, False, "gaussian")) == (
        "--gbuffer packed --samples 4 --no-shadows --filter gaussian"
    )


def run(folder: Path, *arguments: str) -> Result:
    return CliRunner().invoke(bench, arguments, env={"XDG_CACHE_HOME": str(folder)})


def test_a_sweep_end_to_end(tmp_path: Path, scenes: Path) -> None:
    """Many samples lie nearer to the converged picture than one; it is drawn once and kept."""
    stage, figures, picture = str(scenes / "light_sphere.usda"), tmp_path / "bench.json", tmp_path / "bench.svg"
    options = ("--reference-samples", "32", "--max-error", "10", "--json", str(figures), "--plot", str(picture))
    result = run(tmp_path, stage, *TINY, *options)
    assert result.exit_code == 0, result.output
    (found,) = json.loads(figures.read_text())["stages"]
    assert found["size"] == [32, 18] and len(found["trials"]) == 8
    error = {tuple(t["choice"].values()): t["rel_mse"] for t in found["trials"]}
    assert error["float", 4, True, "box"] < error["float", 1, True, "box"]
    assert error["float", 4, True, "box"] < error["float", 4, False, "box"]
    assert all(t["wall"] > 0 and t["cpu"] > 0 for t in found["trials"])
    assert any(t["on_front"] for t in found["trials"])
    assert f"at most 10: --gbuffer {found['recommended']['layout']}" in result.stdout
    dots = ElementTree.parse(picture).findall(".//{*}circle/{*}title")
    assert len(dots) == 8

    kept = Path(found["references"][0])
    write_time = kept.stat().st_mtime_ns
    assert run(tmp_path, stage, *TINY, "--layouts", "float", "--samples", "1", *options[:2]).exit_code == 0
    assert kept.stat().st_mtime_ns == write_time


def test_errors_against_a_file(tmp_path: Path, scenes: Path) -> None:
    """The very picture that is tried has no error: EXR holds it in full float."""
    stage, truth = scenes / "light_distant.usda", tmp_path / "truth.exr"
    write(render(stage, size=(32, 18), samples=4), OutputSettings(full_float=True), truth)
    result = run(tmp_path, str(stage), *TINY, "--reference", str(truth), "--max-error", "1e-9", "--shadows", "on")
    assert result.exit_code == 0, result.output
    assert "at most 1e-09: --gbuffer float --samples 4" in result.stdout


def test_a_reference_of_another_size_is_refused(tmp_path: Path, scenes: Path) -> None:
    stage, truth = scenes / "light_distant.usda", tmp_path / "truth.exr"
    write(render(stage, size=(8, 8)), OutputSettings(), truth)
    error = run(tmp_path, str(stage), *TINY, "--reference", str(truth)).exception
    assert isinstance(error, UsageError) and "32x18" in str(error)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--samples", "4,x"), "'4,x' is not a list of whole numbers above 0"),
        (("--layouts", "flaot"), "did you mean 'float'?"),
        (("--max-error", "0"), "'0' is not above 0"),
    ],
)
def test_bad_arguments(tmp_path: Path, arguments: tuple[str, ...], sentence: str) -> None:
    result = run(tmp_path, "shot.usda", *arguments)
    assert result.exit_code == 2
    assert sentence in " ".join(result.output.split())


def test_a_plot_is_svg(tmp_path: Path) -> None:
    error = run(tmp_path, "shot.usda", "--plot", "plot.png").exception
    assert isinstance(error, UsageError) and ".svg" in str(error)


def test_a_missing_reference_is_an_output_error(tmp_path: Path, scenes: Path) -> None:
    result = run(tmp_path, str(scenes / "light_distant.usda"), *TINY, "--reference", str(tmp_path / "none.exr"))
    assert isinstance(result.exception, OutputError)
    assert not np.any([path.suffix == ".exr" for path in tmp_path.iterdir()])
