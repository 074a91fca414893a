"""Which trials are worth their time."""

from __future__ import annotations

from collections.abc import Sequence

from defshade_cli.measure.bench.trial import Cost, Trial


def pareto_front(trials: Sequence[Trial], cost: Cost) -> tuple[Trial, ...]:
    """The trials that none both cheaper and more accurate beats, the cheapest first; of equals the first."""
    front: list[Trial] = []
    for trial in sorted(trials, key=lambda trial: (trial.cost(cost), trial.rel_mse)):
        if not front or trial.rel_mse < front[-1].rel_mse:
            front.append(trial)
    return tuple(front)


def cheapest_within(trials: Sequence[Trial], max_error: float, cost: Cost) -> Trial | None:
    """The cheapest trial of at most `max_error` relMSE; None where none is so accurate."""
    accurate = [trial for trial in trials if trial.rel_mse <= max_error]
    return min(accurate, key=lambda trial: trial.cost(cost), default=None)
