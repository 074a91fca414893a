"""One job from its stage to its files.

story      the frames of a job, one after another    results    what became of them
pictures   what a device shows of them               renderer   the devices
saving     a command line as part of a stage
"""

from defshade_cli.rendering.renderer import Renderer
from defshade_cli.rendering.results import FrameResult, ImageResult
from defshade_cli.rendering.story import examine, render, run, time_steps

__all__ = ["FrameResult", "ImageResult", "Renderer", "examine", "render", "run", "time_steps"]
