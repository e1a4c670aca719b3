"""Scenes, textiles and actions, as they stand in a scene file.

Each class has the fields of the message of its name in proto/weft/v1, whose comments say what
they mean, their bounds, and what they are when they are None. Units are SI and stand in the names.
"""
from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Sequence, Union

import numpy as np
import numpy.typing as npt
from google.protobuf import json_format

from .errors import error
from .v1 import action_pb2, garment_pb2, mesh_pb2, scene_pb2, textile_pb2
from .values import Value, planes, row_bytes

Vector3 = Sequence[float]  # x, y, z
Rotation = Sequence[float]  # w, x, y, z
Evaluator = Literal["SERIES", "EXACT", "LINEARIZED", "POLYNOMIAL"]
Accuracy = Literal["DRAFT", "STANDARD", "FINE"]
Integrator = Literal["VERLET", "EULER", "MIDPOINT", "RK4", "VERLET_LAGGED"]
Precision = Literal["SINGLE", "DOUBLE"]
StepBound = Literal["EVERY_SHAPE", "UNSHEARED"]
LabTest = Literal["TENSILE", "SHEAR", "BENDING", "CANTILEVER", "CHAIN", "DRAPE"]
LabDirection = Literal["WARP", "WEFT"]
LabMesh = Literal["LATTICE", "RIGHT", "ALTERNATING", "EQUILATERAL", "IRREGULAR"]


@dataclass(eq=False)
class MeasuredTextile(Value):
    """A textile in measured units, from which the constants of every mesh follow."""

    message = textile_pb2.MeasuredTextile
    areal_density_kg_per_m2: float
    tensile_warp_n_per_m: float
    tensile_weft_n_per_m: float
    shear_n_per_m: float
    bend_rigidity_warp_n_m: float = 0
    bend_rigidity_weft_n_m: float = 0
    air_drag_kg_per_m2_s: float = 0


@dataclass(eq=False)
class RawTextile(Value):
    """The paper's own constants: of one mesh."""

    message = textile_pb2.RawTextile
    particle_mass_kg: float
    stretch_n_per_m: float
    shear_n_per_m: float
    bend_n_m2: float = 0
    clamp_n_per_m: float | None = None
    air_drag_kg_per_s: float = 0


@dataclass(eq=False)
class Textile(Value):
    """What a sheet is made of. `model` is a preset's name, measured or raw values.

    >>> Textile.preset("denim_11oz").model
    'denim_11oz'
    """

    message = textile_pb2.Textile
    model: Union[str, MeasuredTextile, RawTextile, None] = None
    damping_kg_per_s: float | None = None
    damping_ratio: float | None = None
    friction_coefficient: float | None = None

    @classmethod
    def preset(cls, name: str, **fields: Any) -> "Textile":
        """A textile that the server knows by name; `fields` are those of Textile."""
        return cls(name, **fields)


@dataclass(eq=False)
class Grid(Value):
    """A lattice of rows x columns particles: (r, c) has index r x columns + c, and starts at
    x = c spacing (along the warp), z = r spacing. Of rows and columns each so many-th is simulated,
    and what lies between interpolated."""

    message = scene_pb2.Grid
    rows: int
    columns: int
    spacing_m: float
    simulated_every: int = 1


@dataclass(eq=False)
class Panel(Value):
    """Triangles cut out of one piece."""

    message = mesh_pb2.Panel
    name: str
    triangle_count: int
    grain_rad: float = 0
    textile: Textile | None = None


@dataclass(eq=False)
class Fold(Value):
    """A line of edges that keeps an angle."""

    message = mesh_pb2.Fold
    particles: Sequence[int]
    angle_rad: float


@dataclass(eq=False)
class Poses(Value):
    """A body in motion: its vertices at given times, on straight ways between.

    times_s         of each pose, s, rising
    positions_m     (poses, n, 3) of all vertices in each, m
    """

    message = mesh_pb2.Poses
    times_s: Sequence[float]
    positions_m: npt.ArrayLike

    def to_proto(self, path: str = "") -> Any:
        at = (path + "." if path else "") + "positions_m"
        given = np.asarray(self.positions_m)
        data = b"".join(planes(pose, 3, "<f4", f"{at}[{i}]") for i, pose in enumerate(given))
        return mesh_pb2.Poses(times_s=np.asarray(self.times_s).tolist(), positions_m=data)

    @classmethod
    def from_proto(cls, message: Any) -> "Poses":
        positions = np.frombuffer(message.positions_m, "<f4")
        count = len(message.times_s)
        return cls(list(message.times_s), positions.reshape(count, 3, -1).swapaxes(1, 2)
                   if count else positions)


@dataclass(eq=False)
class MeshData(Value):
    """Triangles, of sheets with their flat shape.

    positions_m     (n, 3) where particles start, m
    triangles       (m, 3) particles, anticlockwise seen from where normals point to
    flat_m          (k, 2) the flat shape, m: along the weft (u) and the warp (v)
    flat_triangles  (m, 3) corners of the flat shape; None: as triangles
    panels          runs of triangles; none: one panel
    folds           lines that a sheet is pressed along
    poses           how a body moves; None: it keeps its shape
    """

    message = mesh_pb2.MeshData
    positions_m: npt.ArrayLike | None
    triangles: npt.ArrayLike
    flat_m: npt.ArrayLike | None = None
    flat_triangles: npt.ArrayLike | None = None
    panels: Sequence[Panel] = ()
    folds: Sequence[Fold] = ()
    poses: Poses | None = None

    def to_proto(self, path: str = "") -> Any:
        at = path + "." if path else ""
        to = mesh_pb2.MeshData(triangles=row_bytes(self.triangles, 3, "<u4", at + "triangles"))
        if self.positions_m is not None:
            to.positions_m = planes(self.positions_m, 3, "<f4", at + "positions_m")
        if self.flat_m is not None:
            to.flat_m = planes(self.flat_m, 2, "<f4", at + "flat_m")
        if self.flat_triangles is not None:
            to.flat_triangles = row_bytes(self.flat_triangles, 3, "<u4", at + "flat_triangles")
        to.panels.extend(each.to_proto(f"{at}panels[{i}]") for i, each in enumerate(self.panels))
        to.folds.extend(each.to_proto(f"{at}folds[{i}]") for i, each in enumerate(self.folds))
        if self.poses is not None:
            to.poses.CopyFrom(self.poses.to_proto(at + "poses"))
        return to

    @classmethod
    def from_proto(cls, message: Any) -> "MeshData":
        def array(data: bytes, kind: str) -> Any:
            return np.frombuffer(data, kind) if data else None

        def columns(data: bytes, count: int) -> Any:
            return array(data, "<f4").reshape(count, -1).T if data else None

        flat_triangles = array(message.flat_triangles, "<u4")
        return cls(
            positions_m=columns(message.positions_m, 3),
            triangles=np.frombuffer(message.triangles, "<u4").reshape(-1, 3),
            flat_m=columns(message.flat_m, 2),
            flat_triangles=None if flat_triangles is None else flat_triangles.reshape(-1, 3),
            panels=[Panel.from_proto(each) for each in message.panels],
            folds=[Fold.from_proto(each) for each in message.folds],
            poses=Poses.from_proto(message.poses) if message.HasField("poses") else None,
        )


@dataclass(eq=False)
class TriangleSheet(Value):
    """A sheet of triangles: a mesh, or the name of one that was uploaded."""

    message = scene_pb2.TriangleSheet
    source: Union[MeshData, str, None]


@dataclass(eq=False)
class ChoiKo(Value):
    """The paper's bending model."""

    message = scene_pb2.ChoiKo
    evaluator: Evaluator | None = None
    segments: int | None = None
    degree: int | None = None
    fold_clamp: bool = False
    diagonal_bend: bool | None = None
    optimal_breakpoints: bool = False


@dataclass(eq=False)
class Isometric(Value):
    """The isometric bending law."""

    message = scene_pb2.Isometric
    resist_compression: bool | None = None


@dataclass(eq=False)
class BendingLaw(Value):
    """How the resistance against bending is computed."""

    message = scene_pb2.BendingLaw
    law: Union[ChoiKo, Isometric, None] = None


@dataclass(eq=False)
class Placement(Value):
    """Where a mesh is put: rotated about its own origin, then moved."""

    message = scene_pb2.Placement
    origin_m: Vector3 | None = None
    rotation: Rotation | None = None


@dataclass(eq=False)
class Keyframe(Value):
    """A point of a path: an offset from the start at a time."""

    message = scene_pb2.Keyframe
    time_s: float
    offset_m: Vector3 | None = None


@dataclass(eq=False)
class Pin(Value):
    """Particles that do not move by forces, and the path that leads them."""

    message = scene_pb2.Pin
    particles: Sequence[int]
    path: Sequence[Keyframe] = ()


@dataclass(eq=False)
class Sheet(Value):
    """One piece of textile: of a grid, or of triangles.

    start_positions_m and start_velocities_m_per_s are (n, 3), m and m/s.

    >>> Sheet.grid(31, 31, spacing_m=1 / 30, textile=Textile.preset("wool_tropical")).shape
    Grid(rows=31, columns=31, spacing_m=0.03333333333333333, simulated_every=1)
    """

    message = scene_pb2.Sheet
    oneofs: ClassVar[dict[str, str]] = {"shape": "mesh"}
    shape: Union[Grid, TriangleSheet, None]
    textile: Textile | None
    name: str = ""
    bending: BendingLaw | None = None
    placement: Placement | None = None
    start_positions_m: npt.ArrayLike = ()
    start_velocities_m_per_s: npt.ArrayLike = ()
    pins: Sequence[Pin] = ()
    skin_m: float | None = None
    thickness_m: float | None = None
    tether_stretch: float | None = None

    @classmethod
    def grid(
        cls, rows: int, columns: int, spacing_m: float, textile: Textile, **fields: Any
    ) -> "Sheet":
        """A rectangular sheet; `fields` are those of Sheet."""
        return cls(Grid(rows, columns, spacing_m), textile, **fields)

    @classmethod
    def mesh(
        cls,
        vertices: npt.ArrayLike | None,
        faces: npt.ArrayLike,
        uv: npt.ArrayLike | None = None,
        *,
        textile: Textile,
        uv_faces: npt.ArrayLike | None = None,
        panels: Sequence[Panel] = (),
        **fields: Any,
    ) -> "Sheet":
        """A sheet of any outline.

        vertices (n, 3), m; faces (m, 3), anticlockwise; uv (k, 2) the flat shape, m: weft and
        warp; uv_faces (m, 3) its corners, where these are others than `faces`. `fields` are
        those of Sheet.
        """
        mesh = MeshData(vertices, faces, uv, uv_faces, panels)
        return cls(TriangleSheet(mesh), textile, **fields)

    @classmethod
    def from_proto(cls, message: Any) -> "Sheet":
        sheet = super().from_proto(message)
        for field in ("start_positions_m", "start_velocities_m_per_s"):
            setattr(sheet, field, np.array(getattr(sheet, field), float).reshape(-1, 3))
        return sheet


@dataclass(eq=False)
class Plane(Value):
    """Half space below a plane."""

    message = scene_pb2.Plane
    point_m: Vector3 | None = None
    normal: Vector3 | None = None


@dataclass(eq=False)
class Sphere(Value):
    """A ball."""

    message = scene_pb2.Sphere
    radius_m: float
    center_m: Vector3 | None = None


@dataclass(eq=False)
class Box(Value):
    """A cuboid."""

    message = scene_pb2.Box
    half_size_m: Vector3
    center_m: Vector3 | None = None
    rotation: Rotation | None = None


@dataclass(eq=False)
class Capsule(Value):
    """All points within a radius of a line segment."""

    message = scene_pb2.Capsule
    radius_m: float
    start_m: Vector3 | None = None
    end_m: Vector3 | None = None


@dataclass(eq=False)
class BodyMesh(Value):
    """A closed surface of triangles: a mesh, or the name of one that was uploaded."""

    message = scene_pb2.BodyMesh
    source: Union[MeshData, str, None]
    cell_m: float | None = None


@dataclass(eq=False)
class Collider(Value):
    """A solid body.

    >>> Collider(Sphere(0.3), friction_coefficient=0.5).shape
    Sphere(radius_m=0.3, center_m=None)
    """

    message = scene_pb2.Collider
    shape: Union[Plane, Sphere, Box, Capsule, BodyMesh, None]
    name: str = ""
    friction_coefficient: float | None = None
    path: Sequence[Keyframe] = ()

    @classmethod
    def mesh(
        cls,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        poses: Poses | None = None,
        cell_m: float | None = None,
        **fields: Any,
    ) -> "Collider":
        """A closed surface: vertices (n, 3), m; faces (m, 3). `fields` are those of Collider."""
        return cls(BodyMesh(MeshData(vertices, faces, poses=poses), cell_m), **fields)

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], *, cell_m: float | None = None, **fields: Any
    ) -> "Collider":
        """The closed surface of an OBJ file in m, such as `weft body new -o body.obj` writes."""
        lines = [line.split() for line in pathlib.Path(path).read_text().splitlines()]
        vertices = [each[1:4] for each in lines if each[:1] == ["v"]]
        faces = []
        try:
            for face in (each[1:] for each in lines if each[:1] == ["f"]):
                corners = [int(corner.split("/")[0]) for corner in face]
                corners = [each - 1 if each > 0 else len(vertices) + each for each in corners]
                faces += [(corners[0], *pair) for pair in zip(corners[1:], corners[2:])]
            corners_m = np.array(vertices, float).reshape(len(vertices), 3)
            return cls.mesh(corners_m, faces, cell_m=cell_m, **fields)
        except ValueError as wrong:
            raise error("INVALID_ARGUMENT", "FILE_MALFORMED", f"{path}: {wrong}") from None


@dataclass(eq=False)
class Wind(Value):
    """Moving air."""

    message = scene_pb2.Wind
    velocity_m_per_s: Vector3 | None = None
    gust: float = 0
    gust_period_s: float | None = None
    air_density_kg_per_m3: float | None = None
    tangential_drag_kg_per_m2_s: float = 0


@dataclass(eq=False)
class Environment(Value):
    """What acts on every sheet."""

    message = scene_pb2.Environment
    gravity_m_per_s2: Vector3 | None = None
    wind: Wind | None = None


@dataclass(eq=False)
class Hold(Value):
    """Particles that keep their height until a garment hangs."""

    message = scene_pb2.Hold
    sheet: str = ""
    particles: Sequence[int] = ()
    until_s: float | None = None


@dataclass(eq=False)
class Dressing(Value):
    """How garments are put on before they hang by themselves."""

    message = scene_pb2.Dressing
    close_s: float | None = None
    settle_s: float | None = None
    drag_per_s: float | None = None
    deflate_m: float | None = None
    holds: Sequence[Hold] = ()


@dataclass(eq=False)
class SolverSettings(Value):
    """How time is stepped."""

    message = scene_pb2.SolverSettings
    accuracy: Accuracy | None = None
    integrator: Integrator | None = None
    frame_step_s: float | None = None
    substep_s: float | None = None
    allow_unstable: bool = False
    safety: float | None = None
    precision: Precision | None = None
    max_repairs: int | None = None
    max_self_weight_strain: float | None = None
    step_bound: StepBound | None = None
    slow_forces_every: int | None = None


@dataclass(eq=False)
class Scene(Value):
    """Everything a simulation starts from.

    >>> ball = Collider(Sphere(radius_m=0.3))
    >>> sheet = Sheet.grid(31, 31, 1 / 30, Textile.preset("wool_tropical"))
    >>> Scene.from_json(Scene([sheet], [ball]).to_json()) == Scene([sheet], [ball])
    True
    """

    message = scene_pb2.Scene
    sheets: Sequence[Sheet]
    colliders: Sequence[Collider] = ()
    environment: Environment | None = None
    solver: SolverSettings | None = None
    cloth_contact: bool = False
    dressing: Dressing | None = None
    untangle_s: float | None = None

    def to_json(self) -> str:
        """What stands in a scene file."""
        return json_format.MessageToJson(self.to_proto(), preserving_proto_field_name=True)

    @classmethod
    def from_json(cls, text: str) -> "Scene":
        """The scene of a scene file's text."""
        try:
            return cls.from_proto(json_format.Parse(text, scene_pb2.Scene()))
        except json_format.ParseError as wrong:
            raise error("INVALID_ARGUMENT", "FILE_MALFORMED", str(wrong)) from None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a scene file."""
        pathlib.Path(path).write_text(self.to_json() + "\n")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Scene":
        """Reads a scene file."""
        return cls.from_json(pathlib.Path(path).read_text())


@dataclass(eq=False)
class PatternEdge(Value):
    """A line of an outline, from where the one before ends.

    points_m  (n, 2) control points and the end, m: one straight, two or three a Bezier curve
    arc       of two points: the arc of a circle through the first
    """

    message = garment_pb2.PatternEdge
    points_m: npt.ArrayLike
    arc: bool = False
    label: str = ""

    @classmethod
    def from_proto(cls, message: Any) -> "PatternEdge":
        edge = super().from_proto(message)
        edge.points_m = np.array(edge.points_m, float).reshape(-1, 2)
        return edge


@dataclass(eq=False)
class PatternCrease(Value):
    """A line inside a panel that it is creased along.

    points_m   (n, 2) from point to point; an end beside the outline lies on it
    fold_rad   as Fold.angle_rad; 0 is no fold
    start_rad  that the panel is folded by where it is placed
    """

    message = garment_pb2.PatternCrease
    points_m: npt.ArrayLike
    fold_rad: float = 0
    start_rad: float = 0

    @classmethod
    def from_proto(cls, message: Any) -> "PatternCrease":
        crease = super().from_proto(message)
        crease.points_m = np.array(crease.points_m, float).reshape(-1, 2)
        return crease


@dataclass(eq=False)
class PatternPanel(Value):
    """A piece as it is cut: its outline, anticlockwise, and lines that it is creased along."""

    message = garment_pb2.PatternPanel
    name: str
    edges: Sequence[PatternEdge]
    grain_rad: float = 0
    placement: Placement | None = None
    textile: Textile | None = None
    creases: Sequence[PatternCrease] = ()


@dataclass(eq=False)
class EdgeRun(Value):
    """Part of an edge, by shares of its length."""

    message = garment_pb2.EdgeRun
    panel: str
    edge: int
    begin: float | None = None
    end: float | None = None


@dataclass(eq=False)
class PatternSeam(Value):
    """Two lines that become one."""

    message = garment_pb2.PatternSeam
    first_side: Sequence[EdgeRun]
    second_side: Sequence[EdgeRun]
    same_direction: bool = False
    fold_rad: float = 0


@dataclass(eq=False)
class Pattern(Value):
    """A garment as it is cut: pieces, and what is sewn to what.

    >>> square = [PatternEdge([corner]) for corner in ((1, 0), (1, 1), (0, 1), (0, 0))]
    >>> tube = Pattern([PatternPanel("tube", square)],
    ...                [PatternSeam([EdgeRun("tube", 1)], [EdgeRun("tube", 3)])])
    >>> Pattern.from_json(tube.to_json()) == tube
    True
    """

    message = garment_pb2.Pattern
    panels: Sequence[PatternPanel]
    seams: Sequence[PatternSeam] = ()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a pattern file."""
        pathlib.Path(path).write_text(self.to_json() + "\n")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Pattern":
        """Reads a pattern file, such as `weft garment new` writes."""
        return cls.from_json(pathlib.Path(path).read_text())

    def to_json(self) -> str:
        """What stands in a pattern file."""
        return json_format.MessageToJson(self.to_proto(), preserving_proto_field_name=True)

    @classmethod
    def from_json(cls, text: str) -> "Pattern":
        """The pattern of a pattern file's text."""
        try:
            return cls.from_proto(json_format.Parse(text, garment_pb2.Pattern()))
        except json_format.ParseError as wrong:
            raise error("INVALID_ARGUMENT", "FILE_MALFORMED", str(wrong)) from None


@dataclass(eq=False)
class Grab(Value):
    """A hand takes a particle of a sheet."""

    message = action_pb2.Grab
    particle: int
    sheet: str = ""


@dataclass(eq=False)
class Drag(Value):
    """The hand leads it to a place, m, within a simulated time, s."""

    message = action_pb2.Drag
    particle: int
    target_m: Vector3
    duration_s: float | None = None
    sheet: str = ""


@dataclass(eq=False)
class Release(Value):
    """The hand lets it go."""

    message = action_pb2.Release
    particle: int
    sheet: str = ""


@dataclass(eq=False)
class PinParticle(Value):
    """A particle is held until it is unpinned."""

    message = action_pb2.PinParticle
    particle: int
    sheet: str = ""


@dataclass(eq=False)
class UnpinParticle(Value):
    """It is no longer, a pin of the scene's too."""

    message = action_pb2.UnpinParticle
    particle: int
    sheet: str = ""


@dataclass(eq=False)
class MoveCollider(Value):
    """A collider is moved to an offset from its start, m, within a simulated time, s."""

    message = action_pb2.MoveCollider
    offset_m: Vector3
    duration_s: float | None = None
    collider: str = ""


@dataclass(eq=False)
class PoseCollider(Value):
    """A body is led through its poses to a time of these, s; its fastest vertex at a speed, m/s."""

    message = action_pb2.PoseCollider
    pose_time_s: float
    speed_m_per_s: float | None = None
    collider: str = ""


@dataclass(eq=False)
class Relax(Value):
    """The scene comes to rest on its shortest way, instead of moving in time."""

    message = action_pb2.Relax


Action = Union[
    Grab, Drag, Release, PinParticle, UnpinParticle, MoveCollider, PoseCollider, Relax
]


@dataclass(eq=False)
class _AnyAction(Value):
    """What holds one of them on the wire."""

    message = action_pb2.Action
    action: Action


def action_proto(action: Action, path: str) -> Any:
    return _AnyAction(action).to_proto(path)
