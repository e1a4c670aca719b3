"""What Blender's objects are to Weft: a scene, and the way back from it to them."""
from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Sequence

import numpy as np
import weft

from .surface import Flat, FlatShape, Refused, Surface, flat_shape, plane_of

STILL = 1e-5  # of a body's size: a body that turns or bends by no more is rigid


@dataclass
class Cloth:
    """An object of cloth.

    surface   its mesh in the first frame
    textile   a preset of the server
    pinned    vertices that are held
    paths     (frames, pinned, 3) where these are, m, in the world; None: they stay
    """

    name: str
    surface: Surface
    textile: str
    pinned: Sequence[int] = ()
    paths: np.ndarray | None = None
    flat: Flat = "AUTO"
    m_per_unit: float | None = None
    friction: float | None = None
    thickness_m: float | None = None
    keep_length: bool = False


@dataclass
class Body:
    """An object that cloth does not enter.

    surface   its mesh in the first frame
    moves     (frames, n, 3) its points, m, in the world; None: it stays
    """

    name: str
    surface: Surface
    moves: np.ndarray | None = None
    friction: float | None = None


@dataclass
class World:
    """What acts on all cloth. gravity_m_per_s2 and wind_m_per_s are (3,), in the world."""

    frame_step_s: float
    first_frame: int
    gravity_m_per_s2: Sequence[float]
    wind_m_per_s: Sequence[float] | None = None
    accuracy: str = "STANDARD"
    cloth_contact: bool = False


@dataclass
class Prepared:
    """A scene, the objects that its sheets and colliders are, and what there is to say of them."""

    scene: weft.Scene
    cloths: dict[str, Cloth]  # by the name of their sheet
    bodies: list[Body]
    flats: list[FlatShape]  # of sheets
    notes: list[str] = field(default_factory=list)

    def surface(self, name: str) -> Surface:
        """The mesh of an object."""
        return next(e.surface for e in [*self.cloths.values(), *self.bodies] if e.name == name)

    def sheet_of(self, name: str) -> str | None:
        """The sheet of an object."""
        return next((sheet for sheet, each in self.cloths.items() if each.name == name), None)


def prepare(world: World, cloths: Sequence[Cloth], bodies: Sequence[Body]) -> Prepared:
    """The scene of all. Both have their z up: gravity is a vector, so nothing is turned."""
    if not cloths:
        raise Refused("There is no cloth: give an object the type Cloth in its Physics tab")
    names = sheet_names([each.name for each in cloths])
    flats = [flat_shape(each.surface, each.flat, each.m_per_unit, each.name) for each in cloths]
    notes = [note for each in flats for note in each.notes]
    sheets = [_sheet(world, *each) for each in zip(names, cloths, flats)]
    body_names = sheet_names([each.name for each in bodies])
    colliders = [_collider(world, *each, notes) for each in zip(body_names, bodies)]
    wind = None if world.wind_m_per_s is None else weft.Wind(world.wind_m_per_s)
    scene = weft.Scene(
        sheets,
        colliders,
        weft.Environment(world.gravity_m_per_s2, wind),
        weft.SolverSettings(accuracy=world.accuracy, frame_step_s=world.frame_step_s),
        world.cloth_contact,
    )
    return Prepared(scene, dict(zip(names, cloths)), list(bodies), flats, notes)


def sheet_names(names: Sequence[str]) -> list[str]:
    """Names as scenes have them, "silk_scarf-2" of "Silk_Scarf.2"."""
    found: list[str] = []
    for name in names:
        plain = re.sub("[^a-z0-9_-]+", "-", name.lower()).strip("-")[:50] or "object"
        other, n = plain, 2
        while other in found:
            other, n = f"{plain}-{n}", n + 1
        found.append(other)
    return found


def keyframes(offsets: np.ndarray, frame_step_s: float) -> list[weft.Keyframe]:
    """The path through offsets (frames, 3), m; none where there is no motion."""
    if not offsets.any():
        return []
    same = (offsets[1:] == offsets[:-1]).all(axis=1)
    within = np.zeros(len(offsets), bool)  # a pause
    within[1:-1] = same[:-1] & same[1:]
    return [
        weft.Keyframe(int(i) * frame_step_s, offsets[i].tolist()) for i in np.flatnonzero(~within)
    ]


def _sheet(world: World, name: str, cloth: Cloth, flat: FlatShape) -> weft.Sheet:
    return weft.Sheet.mesh(
        cloth.surface.points,
        cloth.surface.triangles,
        flat.corners,
        uv_faces=flat.triangles,
        textile=weft.Textile.preset(cloth.textile, friction_coefficient=cloth.friction),
        name=name,
        pins=_pins(world, cloth),
        thickness_m=cloth.thickness_m,
        tether_stretch=0.0 if cloth.keep_length and len(cloth.pinned) else None,
    )


def _pins(world: World, cloth: Cloth) -> list[weft.Pin]:
    """A pin for each way that held vertices go."""
    pinned = np.asarray(cloth.pinned, int)
    if not len(pinned):
        return []
    if cloth.paths is None:
        return [weft.Pin(pinned.tolist())]
    # rounded to what float32 tells apart, so that vertices that go together have one path
    ways = np.round(cloth.paths - cloth.paths[0], 6).transpose(1, 0, 2)
    found, way = np.unique(ways.reshape(len(pinned), -1), axis=0, return_inverse=True)
    return [
        weft.Pin(
            pinned[way.ravel() == i].tolist(),
            keyframes(offsets.reshape(-1, 3), world.frame_step_s),
        )
        for i, offsets in enumerate(found)
    ]


def _collider(world: World, name: str, body: Body, notes: list[str]) -> weft.Collider:
    surface = body.surface
    if not len(surface.triangles):
        raise Refused("has no faces; a body is a closed mesh, or a flat one: a floor", body.name)
    path, poses = _motion(world, body)
    fields = dict(name=name, friction_coefficient=body.friction, path=path)
    normal, off = plane_of(surface)
    if not off.any():
        if poses:
            raise Refused("is flat, so it is a floor without end, which cannot turn", body.name)
        notes.append(f"{body.name}: is flat, so it is a floor without end")
        return weft.Collider(weft.Plane(surface.points[surface.triangles[0, 0]], normal), **fields)
    return weft.Collider.mesh(surface.points, surface.triangles, poses=poses, **fields)


def _motion(world: World, body: Body) -> tuple[list[weft.Keyframe], weft.Poses | None]:
    """A path where it goes from place to place, else its poses."""
    if body.moves is None:
        return [], None
    away = body.moves - body.moves[0]
    offsets = away.mean(axis=1)
    bent = np.linalg.norm(away - offsets[:, None], axis=2).max()
    if bent <= STILL * np.linalg.norm(np.ptp(body.moves[0], axis=0)):
        return keyframes(np.round(offsets, 6), world.frame_step_s), None
    return [], weft.Poses(np.arange(len(body.moves)) * world.frame_step_s, body.moves)
