"""Which camera renders, and what a UsdGeomCamera is in scene terms.

The rule: the camera that the user names; else the one of the stage's render settings; else the stage's only camera;
else one of ours, which frames the geometry as usdrecord's does.
"""

from __future__ import annotations

import logging
import math

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom

from defshade_cli.errors import PrimNotFound, StageError
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.scene import Unsupported
from defshade_cli.spaces import Window, rigid, translation
from defshade_cli.usd.values import STANDS_NOWHERE, is_finite, within_reach
from defshade_cli.usd.xform import matrix

log = logging.getLogger("defshade")

FRAMED = "<framed>"
"""Path of the camera that frames the geometry."""

MOST_CLIPPING_PLANES = 8
"""What OpenGL asks of every driver."""

_USABLE_CLIPPING = (1.0, 1.0e6)  # UsdGeomCamera's fallback
_NEAREST = 1e-6  # near plane over far plane, where the authored one is not in front of the camera

_WIDEST_LENS = 1e6  # diameters to the plane of focus, from where on float32 holds no view through it


def find_cameras(stage: Usd.Stage) -> tuple[str, ...]:
    """Paths of every camera, those inside native instances included."""
    holders = [stage.GetPseudoRoot(), *stage.GetPrototypes()]
    instanced = any(_is_camera(prim) for holder in holders[1:] for prim in Usd.PrimRange(holder))
    prims = Usd.PrimRange(holders[0], Usd.TraverseInstanceProxies() if instanced else Usd.PrimDefaultPredicate)
    return tuple(str(prim.GetPath()) for prim in prims if _is_camera(prim))


def choose_camera(
    stage: Usd.Stage, cameras: tuple[str, ...], wanted: str | None, of_settings: str | None
) -> Usd.Prim | None:
    """The camera that renders; None for one that frames the geometry.

    Raises PrimNotFound where `wanted`, a path or a name, is no camera or more than one.
    """
    if wanted is not None:
        return stage.GetPrimAtPath(_match(cameras, wanted))
    if of_settings in cameras:
        return stage.GetPrimAtPath(of_settings)
    if of_settings is not None:
        log.warning("the render settings name %s, which is no camera", of_settings)
    if len(cameras) == 1:
        return stage.GetPrimAtPath(cameras[0])
    log.info("%s; the geometry is framed", f"the stage has {len(cameras)} cameras" if cameras else "no camera")
    return None


def read_camera(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[Camera, tuple[Unsupported, ...]]:
    """The camera at `time`, and what of it is not honoured.

    Raises StageError where its aperture has no area or its transform is not finite.
    """
    schema, path = UsdGeom.Camera(prim), str(prim.GetPath())
    gf = schema.GetCamera(time)
    is_perspective = gf.projection == Gf.Camera.Perspective
    if not within_reach(matrix(gf.transform)).all():
        raise StageError(f"camera {path} stands nowhere: {STANDS_NOWHERE}")
    planes, issues = _clipping_planes(gf, path)
    lens = {
        "exposure": schema.ComputeLinearExposureScale(time),
        "f_stop": gf.fStop,
        "focus_distance": gf.focusDistance,
        "shutter": (schema.GetShutterOpenAttr().Get(time), schema.GetShutterCloseAttr().Get(time)),
    }
    odd = {name: "is not finite" for name, value in lens.items() if not is_finite(value)}
    if not odd and 0.0 < _WIDEST_LENS * gf.fStop * gf.focusDistance < gf.focalLength:
        odd["f_stop"] = f"of {gf.fStop:g} is a lens as wide as no view: nothing is out of focus"
    camera = Camera(
        path=path,
        world_from_camera=rigid(matrix(gf.transform)),
        window=_window(gf, path),
        projection="perspective" if is_perspective else "orthographic",
        clipping_range=_clipping_range(gf, path, is_perspective),
        focal_length=gf.focalLength * Gf.Camera.FOCAL_LENGTH_UNIT,
        clipping_planes=planes,
        **{name: value for name, value in lens.items() if name not in odd},
    )
    return camera, (*issues, *(Unsupported(path, f"its {name} {reason}") for name, reason in odd.items()))


def framed_camera(bounds: NDArray[np.float64], up_axis: str) -> Camera:
    """A 50 mm camera of UsdGeomCamera's default aperture that sees the whole box (2, 3) from the front.

    The front is +Z where Y is up, −Y where Z is up. The distance is usdrecord's (UsdAppUtilsFrameRecorder: half the
    diagonal of the front face fits the horizontal field of view), or what a tall box needs, which usdrecord crops.
    """
    from defshade_cli.scene.framing import world_from_front

    box = bounds if np.isfinite(bounds).all() else np.array([[-0.5] * 3, [0.5] * 3])
    upright = world_from_front(up_axis)
    width, height, depth = np.abs((box[1] - box[0]) @ upright[:3, :3])
    window = default_window()
    front = max(math.hypot(width, height) / 2 / window[1], height / 2 / window[3]) or max(depth, 1.0)
    back = translation(np.array([0.0, 0.0, front + depth / 2]))
    world_from_camera = translation(box.mean(axis=0)) @ upright @ back
    return Camera(FRAMED, world_from_camera, window, clipping_range=(front / 2, 2 * (front + depth)))


def default_window() -> Window:
    """Of a camera with nothing authored: 50 mm on 20.955 x 15.2908 mm."""
    return _window(Gf.Camera(), FRAMED)


def _is_camera(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.Camera)


def _match(cameras: tuple[str, ...], wanted: str) -> str:
    found = [path for path in cameras if wanted in (path, Sdf.Path(path).name)]
    if len(found) == 1:
        return found[0]
    if found:
        raise PrimNotFound(f"{len(found)} cameras are named {wanted}: {', '.join(found)}")
    known = f"there are {', '.join(cameras)}" if cameras else "the stage has none"
    raise PrimNotFound(f"no camera {wanted}; {known}")


def _window(gf: Gf.Camera, path: str) -> tuple[float, float, float, float]:
    low, high = gf.frustum.window.min, gf.frustum.window.max
    if not (low[0] < high[0] and low[1] < high[1]):
        raise StageError(f"camera {path} sees nothing: its aperture is {gf.horizontalAperture}x{gf.verticalAperture}")
    return low[0], high[0], low[1], high[1]


def _clipping_planes(gf: Gf.Camera, path: str) -> tuple[NDArray[np.float64], tuple[Unsupported, ...]]:
    """(N, 4): no more than a driver is bound to have, and all of them planes."""
    authored = np.array(gf.clippingPlanes, np.float64).reshape(-1, 4)
    sound = authored[np.isfinite(authored).all(axis=1) & authored[:, :3].any(axis=1)]
    kept = sound[:MOST_CLIPPING_PLANES]
    if len(kept) == len(authored):
        return kept, ()
    return kept, (Unsupported(path, f"{len(authored) - len(kept)} of its {len(authored)} clippingPlanes are left out"),)


def _clipping_range(gf: Gf.Camera, path: str, is_perspective: bool) -> tuple[float, float]:
    near, far = gf.clippingRange.min, gf.clippingRange.max
    if near < far and (near > 0 or not is_perspective):
        return near, far
    usable = (far * _NEAREST, far) if far > 0 and near < far else _USABLE_CLIPPING
    log.warning("camera %s: clipping range (%g, %g) counts as (%g, %g)", path, near, far, *usable)
    return usable
