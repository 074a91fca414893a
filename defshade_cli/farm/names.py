"""Output paths from patterns.

    ####  ###.##       the frame, zero-padded to the placeholder's whole width; hashes after the dot are decimals
    %04d  %d           the same with C's habits             $F4  $F    with Houdini's
    {frame}            the frame as short as it goes: 12, 12.5
    {scene}  {camera}  {product}
                       names made safe: a prim path /World/Cam becomes World_Cam

Hashes follow usdrecord (UsdAppUtils' frame placeholders): `###.##` writes frame 1.5 as 001.50.
"""

from __future__ import annotations

import re
from pathlib import Path

from defshade_cli.errors import UsageError

_TOKEN = re.compile(r"(?P<hashes>#+(?:\.#+)?)|%(?P<printf>0?\d*)d|\$F(?P<houdini>\d*)|\{(?P<name>[^{}]*)\}")
_UNSAFE = re.compile(r"[^\w.+-]+")


def has_frame_token(pattern: str) -> bool:
    """Whether each frame gets a file of its own; without a token several frames would overwrite one another."""
    return any(_is_frame(token) for token in _TOKEN.finditer(pattern))


def has_product_token(pattern: str) -> bool:
    """Whether each of a stage's products gets a file of its own."""
    return any(token["name"] == "product" for token in _TOKEN.finditer(pattern))


def expand(pattern: str, *, frame: float | None, scene: str, camera: str, product: str = "") -> Path:
    """The path that `pattern` names for this frame.

    product: empty for a stage that names none; its file is then called beauty.
    frame: None at the default time, which has no number.
    Raises UsageError for an unknown {name}, a frame token without a frame, and a frame with more decimals
    than its token has places.
    """
    names = {"scene": scene, "camera": camera, "product": product or "beauty"}

    def text(token: re.Match[str]) -> str:
        if _is_frame(token):
            return _frame_text(token, frame)
        name = token["name"]
        if name not in names:
            raise UsageError(f"'{pattern}': {{{name}}} is none of {{scene}}, {{camera}}, {{product}}, {{frame}}")
        return safe_name(names[name])

    return Path(_TOKEN.sub(text, pattern))


def safe_name(text: str) -> str:
    """`text` as one path component: letters, digits and _ . + - stay, all else becomes _."""
    return _UNSAFE.sub("_", text).strip("._") or "unnamed"


def _is_frame(token: re.Match[str]) -> bool:
    return token["name"] is None or token["name"] == "frame"


def _frame_text(token: re.Match[str], frame: float | None) -> str:
    if frame is None:
        raise UsageError(f"'{token[0]}' wants a frame number, and the default time has none")
    if token["name"]:
        return f"{frame:z.10g}"
    hashes = token["hashes"] or ""
    width = len(hashes) or int(token["printf"] or token["houdini"] or 0)
    decimals = len(hashes.partition(".")[2])
    if abs(round(frame, decimals) - frame) > 1e-9 * max(1.0, abs(frame)):
        raise UsageError(
            f"'{token[0]}' cannot tell frame {frame:.10g} from its neighbours; write ####.### or {{frame}}"
        )
    return f"{frame:z0{width}.{decimals}f}"
