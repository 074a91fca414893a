"""What one frame needs, and what it skips and why: decided once, before anything is drawn."""

from defshade_cli.plan.decisions import Decision
from defshade_cli.plan.lights import PlannedLight, Volume, volume_of
from defshade_cli.plan.plan import Plan
from defshade_cli.plan.planning import ShutterSample, make_plan, plan_after, plan_moments

__all__ = [
    "Decision",
    "Plan",
    "PlannedLight",
    "ShutterSample",
    "Volume",
    "make_plan",
    "plan_after",
    "plan_moments",
    "volume_of",
]
