"""`python -m defshade_cli.measure.stress docs/stability.md` judges every corner and writes the table anew.

Ends with 1 where a corner is not sound.
"""

from __future__ import annotations

import logging
import sys
import tempfile
from pathlib import Path

from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.sections import replace_generated
from defshade_cli.measure.stress.corners import all_corners
from defshade_cli.measure.stress.table import summary
from defshade_cli.measure.stress.verdict import judge
from defshade_cli.passes.pipeline import Pipeline

LIGHTS = 100_000


def main(page: Path) -> int:
    logging.getLogger("defshade").setLevel(logging.CRITICAL)
    with Gpu() as gpu, tempfile.TemporaryDirectory() as folder:
        pipeline = Pipeline(gpu)
        verdicts = [judge(corner, pipeline, Path(folder)) for corner in all_corners(LIGHTS)]
    page.write_text(replace_generated(page.read_text("utf-8"), "stress", summary(verdicts)), "utf-8")
    unsound = [v for v in verdicts if not v.is_sound]
    for v in unsound:
        print(f"{v.corner.family}, {v.corner.name}: error {v.worst:.1e} at {v.where}, {v.odd} not finite")
    return int(bool(unsound))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
