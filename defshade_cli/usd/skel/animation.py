"""What an animation says of a prim at a time: the matrices of its joints, and the weights of its blend shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdSkel

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.xform import matrices


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """What a deformation follows from, besides the rest shape.

    joints: (J, 4, 4) skeleton_from_bind in the prim's order of joints; none where no joint moves it.
    weights: (B,) in the prim's order of blend shapes.
    """

    joints: NDArray[np.float64]
    weights: NDArray[np.float32]

    @property
    def key(self) -> tuple[bytes, bytes]:
        """Equal for equal poses."""
        return self.joints.tobytes(), self.weights.tobytes()

    def without_joints(self) -> Pose:
        """The pose with its blend shapes alone."""
        return replace(self, joints=self.joints[:0])


class Animation:
    """A skeleton's animation as one skinned prim sees it."""

    def __init__(self, skinning: UsdSkel.SkinningQuery, skeleton: UsdSkel.SkeletonQuery) -> None:
        self._skinning, self._skeleton = skinning, skeleton
        self._source = skeleton.GetAnimQuery() if skeleton else None
        order = skeleton.GetJointOrder() if skeleton else ()
        self._joints = _places(skinning.GetJointOrder() or order, order)
        shapes = skinning.GetBlendShapeOrder() or () if skinning.HasBlendShapes() else ()
        self._shapes = _places(shapes, self._source.GetBlendShapeOrder() if self._source else ())

    @cached_property
    def issue(self) -> str | None:
        """What is wrong with it, so that the skeleton stays in its rest pose."""
        source = self._source
        if not (source and self._skinning.HasJointInfluences() and source.GetJointOrder()):
            return None
        posed = source.ComputeJointLocalTransforms(Usd.TimeCode.EarliestTime())
        return None if posed else "its animation lacks translations, rotations or scales of all its joints"

    @property
    def joint_count(self) -> int:
        """How many joints it moves."""
        return len(self._joints)

    def at(self, time: Usd.TimeCode) -> Pose:
        """Raises ValueError where the skeleton has no pose."""
        return Pose(self._joint_matrices(time), self._weights(time))

    def _joint_matrices(self, time: Usd.TimeCode) -> NDArray[np.float64]:
        """Joints that the skeleton lacks stay where they are, as in UsdSkelAnimMapper."""
        if not self._skinning.HasJointInfluences():
            return np.empty((0, 4, 4))
        posed = self._skeleton and self._skeleton.HasBindPose()
        computed = self._skeleton.ComputeSkinningTransforms(time) if posed else None
        if not computed:
            raise ValueError("its skeleton has no bind or rest pose")
        mapped = np.append(matrices(computed), np.eye(4)[None], axis=0)[self._joints]
        if not np.isfinite(mapped).all():
            raise ValueError("its joints have matrices that are not finite")
        return mapped

    def _weights(self, time: Usd.TimeCode) -> NDArray[np.float32]:
        """Blend shapes that the animation does not name have no weight."""
        weights = self._source.ComputeBlendShapeWeights(time) if self._source and len(self._shapes) else None
        known = np.append(np.asarray(weights if weights is not None else [], np.float32), np.float32(0.0))
        places = np.where(np.abs(self._shapes) < len(known), self._shapes, -1)
        return np.nan_to_num(known[places])


def _places(wanted: Sequence[str], order: Sequence[str]) -> NDArray[np.intp]:
    """Where each name stands in `order`; −1 for those that do not."""
    place = {name: number for number, name in enumerate(order)}
    return np.array([place.get(name, -1) for name in wanted], np.intp)
