"""Run time against error: which settings of a stage are worth their time.

trial      one combination of settings, what it cost and how wrong it was
converged  the picture that errors are counted against
sweep      every combination of a Sweep drawn, in alternating rounds
front      which trials no other beats, and the cheapest that is accurate enough
plot       both as a picture in SVG
"""

from defshade_cli.measure.bench.front import cheapest_within, pareto_front
from defshade_cli.measure.bench.sweep import Bench, Sweep, run_sweep
from defshade_cli.measure.bench.trial import Cost, Trial

__all__ = ["Bench", "Cost", "Sweep", "Trial", "cheapest_within", "pareto_front", "run_sweep"]
