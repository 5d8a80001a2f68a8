"""The head in motion, as a mesh a frame: what of it is rigid, and what is left to the skin.

Every frame is split into the rigid motion that fits it best, which moves the head, and the mesh as it is seen from
there, in the head's rest frame: a mesh that only moves leaves a skin at rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.body.roots import rigid_part
from pipeline.config.schema import Config
from pipeline.config.sequence import numbered_files
from pipeline.errors import InputError
from pipeline.groom.head_mesh import load_poses
from pipeline.groom.heads import Head

_SKULL = 0.25  # [m] from the crown down: what moves the head; the rest of a body is left to the skin
_APART = 1.0  # of the head's size: a skin this far from the rest pose is no skin of this head


@dataclass(frozen=True)
class BodyFrame:
    """One frame of the head."""

    points: NDArray[np.float32]
    """(V, 3) [m]: the skin's points in the head's rest frame."""
    pose: NDArray[np.float64]
    """(4, 4): rest frame -> world."""


def body_frames(config: Config, head: Head) -> Iterator[BodyFrame]:
    """The frames of scene.body. Raises InputError for files that do not hold up or are not meshes of this head."""
    scene = config.scene
    if scene.body is None:
        return
    skull = head.skin.points[:, 1] > head.skin.points[:, 1].max() - _SKULL * head.scale
    files = numbered_files(Path(scene.body))
    poses = load_poses(Path(scene.head), files, scene.unit_scale, scene.up_axis, scene.face_axis)
    for path, points in zip(files, poses, strict=True):
        pose = rigid_part(head.skin.points[skull], points[skull])
        skin = (points - pose[:3, 3]) @ pose[:3, :3]
        farthest = float(np.linalg.norm(skin - head.skin.points, axis=1).max())
        if farthest > _APART * float(np.ptp(head.skin.points, axis=0).max()):
            raise InputError(
                f"{path}: its skin is up to {farthest:.2g} m from that of {Path(scene.head).name}; check that points "
                "have the same order, and scene.unit_scale and scene.up_axis"
            )
        yield BodyFrame(skin.astype(np.float32), pose)
