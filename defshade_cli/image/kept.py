"""What takes long to make, kept on disk for the next process."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.appearing import appearing_at
from defshade_cli.resources import cache_folder

log = logging.getLogger("defshade")

Arrays = dict[str, NDArray[Any]]


def kept(kind: str, of: bytes, make: Callable[[], Arrays]) -> Arrays:
    """What `make` returned for `of` the first time. Where nothing can be kept, it is made each time."""
    path = cache_folder(kind) / f"{hashlib.blake2b(of, digest_size=16).hexdigest()}.npz"
    try:
        with np.load(path) as arrays:
            return dict(arrays)
    except FileNotFoundError:
        pass
    except (OSError, ValueError, BadZipFile) as error:
        log.info("%s is made anew: %s", path, error)
    made = make()
    try:
        with appearing_at(path) as hidden:
            np.savez(hidden, allow_pickle=False, **made)
    except OSError as error:
        log.info("%s cannot be kept: %s", path, error)
    return made
