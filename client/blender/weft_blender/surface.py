"""Meshes as arrays, and the flat shape that cloth is cut in."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Flat = Literal["AUTO", "UV", "LYING"]
FLAT = 1e-4  # a mesh that lies in a plane is off it by no more than this share of its size
APART = 0.1  # of edges beside their flat shape, before it is worth a word


class Refused(Exception):
    """What cannot be simulated, with the object meant and its vertices."""

    def __init__(self, text: str, name: str = "", vertices=()):
        super().__init__(f"{name}: {text}" if name else text)
        self.name = name
        self.vertices = tuple(vertices)


@dataclass
class Surface:
    """The mesh of an object.

    points     (n, 3) in the world, m
    triangles  (m, 3) vertices of each
    uv         (m, 3, 2) of their corners, in units of the UV map, or None
    upright    (2, 3) what its own y and z are in the world
    """

    points: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray | None = None
    upright: np.ndarray | None = None


@dataclass
class FlatShape:
    """Corners (k, 2), m, those of each triangle (m, 3), and what there is to say of them."""

    corners: np.ndarray
    triangles: np.ndarray
    notes: list[str]


def flat_shape(surface: Surface, kind: Flat, m_per_unit: float | None, name: str) -> FlatShape:
    """The flat shape of a cloth: as it lies where it lies in a plane, else its UV map.

    m_per_unit is the length of 1 in the UV map, m; if None that at which the median edge has its
    length in the world.
    """
    if not len(surface.triangles):
        raise Refused("has no faces; cloth needs one or more", name)
    normal, off = plane_of(surface)
    if kind == "LYING" or kind == "AUTO" and not off.any():
        if off.any():
            text = (f"{off.sum()} vertices lie outside the plane of the others; choose its UV map "
                    "as the flat shape")
            raise Refused(text, name, np.flatnonzero(off))
        return _as_it_lies(surface, normal)
    if surface.uv is None:
        text = "lies in no plane and has no UV map that says how it was cut; unwrap it"
        raise Refused(text, name)
    return _as_unwrapped(surface, m_per_unit, name)


def plane_of(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """The mean normal, of length 1 or 0, and which vertices of triangles lie off the plane."""
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a).sum(axis=0)
    length = np.linalg.norm(normal)
    normal = normal / length if length else normal
    used = np.zeros(len(surface.points), bool)
    used[surface.triangles] = True
    points = surface.points[used]
    middle = points.mean(axis=0)
    off = used.copy()
    off[used] = np.abs((points - middle) @ normal) > FLAT * np.linalg.norm(np.ptp(points, axis=0))
    return (normal, off) if length else (normal, used)


def _as_it_lies(surface: Surface, normal: np.ndarray) -> FlatShape:
    upright = np.eye(3)[1:] if surface.upright is None else surface.upright
    v = max((axis - (axis @ normal) * normal for axis in upright), key=np.linalg.norm)
    v = v / np.linalg.norm(v)
    corners = (surface.points - surface.points[0]) @ np.stack([np.cross(v, normal), v], axis=1)
    return FlatShape(corners, surface.triangles, [])


def _as_unwrapped(surface: Surface, m_per_unit: float | None, name: str) -> FlatShape:
    # one corner for each vertex and place in the map
    vertices = surface.triangles.reshape(-1, 1)
    keys = np.column_stack([vertices, surface.uv.reshape(-1, 2).astype(np.float32)])
    found, corner = np.unique(keys, axis=0, return_inverse=True)
    corners, triangles = found[:, 1:], corner.reshape(-1, 3)

    flat = np.linalg.norm(corners[triangles] - corners[np.roll(triangles, -1, 1)], axis=2)
    ends = surface.triangles, np.roll(surface.triangles, -1, 1)
    length = np.linalg.norm(surface.points[ends[0]] - surface.points[ends[1]], axis=2)
    if not (flat > 0).any():
        raise Refused("its UV map is a point; unwrap it", name)
    ratio = length[flat > 0] / flat[flat > 0]
    scale = m_per_unit or float(np.median(ratio))
    if not scale > 0:
        raise Refused("all its edges have length 0", name)
    corners = corners * scale

    corners, turned = _turn_mirrored(corners, triangles)
    notes = []
    low, high = np.quantile(ratio / scale, [0.05, 0.95])
    if low < 1 - APART or high > 1 + APART:
        notes.append(
            f"{name}: its edges are {low:.3g} to {high:.3g} times as long as in the UV map at "
            f"{scale:.3g} m for 1: it starts strained by that"
        )
    if turned:
        islands = "1 island is" if turned == 1 else f"{turned} islands are"
        notes.append(f"{name}: {islands} mirrored in the UV map, and turned over")
    return FlatShape(corners, triangles, notes)


def _turn_mirrored(corners: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, int]:
    """Islands that run clockwise turned over about v, which stays the warp; how many."""
    island = _islands(triangles, len(corners))
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    area = np.zeros(len(corners))
    np.add.at(area, island[triangles[:, 0]], ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    turned = corners.copy()
    turned[area[island] < 0, 0] *= -1
    return turned, int((area < 0).sum())


def _islands(triangles: np.ndarray, corners: int) -> np.ndarray:
    """The least corner of what hangs together with each."""
    island = np.arange(corners)
    while True:
        least = island[triangles].min(axis=1)
        before = island.copy()
        np.minimum.at(island, triangles.ravel(), np.repeat(least, 3))
        island = island[island]
        if (island == before).all():
            return island
