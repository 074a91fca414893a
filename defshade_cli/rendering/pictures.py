"""Pictures put through the display transform by the graphics device, which is several times faster than by the CPU."""

from __future__ import annotations

from dataclasses import replace

from defshade_cli.farm.shots import Shot
from defshade_cli.farm.targets import shot_paths
from defshade_cli.image.colour import display_transform
from defshade_cli.image.encoders import is_in_bytes
from defshade_cli.image.encoders.sink import bounded
from defshade_cli.image.files import pictures
from defshade_cli.image.film import Film
from defshade_cli.rendering.renderer import Renderer

_WORTHWHILE = 2**18
"""Pixels of all pictures; for fewer the CPU is done before a shader is compiled."""


def shown(film: Film, shot: Shot, renderer: Renderer) -> Film:
    """The film with what its pictures show, where they are large enough; the CPU shows the others when it writes.

    Raises UsageError for a suffix, display or view that does not exist.
    """
    job, layers = shot.job, shot.job.settings.layers or ()
    wanted = {each for path in shot_paths(shot) for each in pictures(layers, job.output, path)}
    width, height = film.size
    if width * height * len(wanted) < _WORTHWHILE:
        return film
    transform = display_transform(job.output.display, job.output.view, job.output.look, film.render_space)
    display = renderer.display(job.device, transform)
    if display is None:
        return film
    in_bytes = all(is_in_bytes(path, job.output) for path in shot_paths(shot))
    images = {}
    for name, alpha in wanted:
        pixels = bounded(name, film.layers[name], half=True)
        colors = pixels if alpha else pixels[..., :3]
        images[name, alpha] = display.show(colors, straight=alpha, in_bytes=in_bytes, of=name)
    return replace(film, shown=images)
