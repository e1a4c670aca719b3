"""Frames as arrays."""
from __future__ import annotations

import dataclasses
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from .errors import Damaged, Error, error
from .scene import MeshData
from .v1 import frame_pb2
from .values import enum_number

Array = npt.NDArray[Any]
Encoding = Literal["FLOAT32", "FLOAT64", "QUANTIZED_ZSTD"]
_ARRAYS = ("positions_m", "velocities_m_per_s", "normals", "strain", "pressure_pa", "clearance_m")
_FLOATS = {frame_pb2.FRAME_ENCODING_FLOAT64: "<f8"}  # FLOAT32 else


@dataclasses.dataclass(eq=False)
class Frame:
    """The state at one time: of n particles, those of all sheets in scene order, each row by row.

    positions   (n, 3), m
    velocities  (n, 3), m/s, where asked for
    normals     (n, 3), of length 1, where asked for
    strain      (m, 3) of all triangles, along warp and weft and the sine of the shear angle,
                where asked for
    pressure    (n,), Pa, what colliders press with as of cloth at rest, where asked for
    clearance   (n,), m from the nearest collider, negative inside, where asked for
    stats       weft.v1.FrameStats: energies, largest strain, substeps, whether it is at rest
    skipped     of a view: frames between the one before and this one

    Arrays are read-only views of the bytes that came, float32; float64 where that or
    QUANTIZED_ZSTD was asked for. As frames are planes on the wire, a view's rows are strided:
    `numpy.ascontiguousarray` makes rows of three numbers where a library wants them.
    """

    number: int
    time_s: float
    positions: Array
    velocities: Array | None
    normals: Array | None
    strain: Array | None
    pressure: Array | None
    clearance: Array | None
    stats: frame_pb2.FrameStats
    header: frame_pb2.StreamHeader
    skipped: int = 0

    def sheet(self, name: str = "") -> Array:
        """Positions of a sheet, m: (rows, columns, 3) of a grid, else (n, 3). May be left empty
        where there is one sheet. A view of `positions`, of all particles."""
        layout = layout_of(self.header, name)
        first, count = layout.first_particle, layout.particle_count
        rows = self.positions.T[:, first : first + count]
        if layout.rows:
            return rows.reshape(3, layout.rows, layout.columns).transpose(1, 2, 0)
        return rows.T


def layout_of(header: frame_pb2.StreamHeader, name: str) -> frame_pb2.SheetLayout:
    sheets = [each for each in header.sheets if each.name == name or not name]
    if len(sheets) != 1:
        names = ", ".join(each.name for each in header.sheets)
        raise error("NOT_FOUND", "SHEET_NOT_FOUND", f'"{name}" is none of the sheets {names}')
    return sheets[0]


class Reader:
    """Makes arrays of the frames of a stream or a recording."""

    def __init__(self, header: frame_pb2.StreamHeader):
        format = header.format
        particles = sum(each.particle_count for each in header.sheets) - format.first_particle
        if format.HasField("particle_count"):
            particles = format.particle_count
        self.header = header
        self._particles = -(-particles // (format.stride or 1))
        self._triangles = sum(each.triangle_count for each in header.sheets)
        self._packed = format.encoding == frame_pb2.FRAME_ENCODING_QUANTIZED_ZSTD
        self._step = format.grid_step_m
        self._kind = _FLOATS.get(format.encoding, "<f4")

    def read(self, message: frame_pb2.Frame, skipped: int = 0) -> Frame:
        """A whole frame."""
        positions = self._array(message, message.positions_m, self._particles)
        if positions is None:
            raise _no_frame(f"frame {message.number} has no positions")
        return Frame(
            message.number,
            message.time_s,
            positions,
            self._array(message, message.velocities_m_per_s, self._particles),
            self._array(message, message.normals, self._particles),
            self._array(message, message.strain, self._triangles),
            self._numbers(message, message.pressure_pa, 1000 * self._step),
            self._numbers(message, message.clearance_m, self._step),
            message.stats,
            self.header,
            skipped,
        )

    def _array(self, message: frame_pb2.Frame, data: bytes, count: int) -> Array | None:
        """Planes x, y, z on the wire as an (n, 3) view."""
        planes = self._planes(message, data, 3, count, self._step)
        return None if planes is None else planes.T

    def _numbers(self, message: frame_pb2.Frame, data: bytes, step: float) -> Array | None:
        """One of each particle."""
        planes = self._planes(message, data, 1, self._particles, step)
        return None if planes is None else planes[0]

    def _planes(
        self, message: frame_pb2.Frame, data: bytes, planes: int, count: int, step: float
    ) -> Array | None:
        if not data:
            return None
        try:
            if self._packed:
                return _unpack(data, planes, count, step)
            return np.frombuffer(data, self._kind).reshape(planes, count)
        except ValueError:
            text = f"the arrays of frame {message.number} are not as its header says"
            raise _no_frame(text) from None


def _unpack(data: bytes, planes: int, count: int, step: float) -> Array:
    """The array of FRAME_ENCODING_QUANTIZED_ZSTD."""
    import zstd  # for these alone

    numbers = planes * count
    try:
        content = np.frombuffer(zstd.decompress(data), np.uint8)
    except zstd.Error as wrong:
        raise ValueError(wrong) from None
    bytes_each = content.size // numbers
    packed = np.zeros((numbers, 8), np.uint8)
    packed[:, :bytes_each] = content.reshape(bytes_each, numbers).T
    codes = packed.view("<u8").reshape(planes, count)
    differences = (codes >> np.uint64(1)) ^ -(codes & np.uint64(1))
    steps = np.add.accumulate(differences, axis=1).view("<i8")
    return cast(Array, steps * step)


def _no_frame(text: str) -> Error:
    return Damaged("DATA_LOSS", "FRAME_INCOMPLETE", text)


class Parts:
    """Puts together what is larger than a message."""

    def __init__(self) -> None:
        self.frame: frame_pb2.Frame | None = None
        self.meshes: list[Any] = []
        self.more = False  # of the last mesh

    def join(self, part: frame_pb2.Frame) -> frame_pb2.Frame | None:
        """The frame, once it is whole."""
        if self.frame is None and not part.continued:
            return part
        if self.frame is None:
            self.frame = frame_pb2.Frame()
            self.frame.CopyFrom(part)
            return None
        if part.number != self.frame.number:
            raise _no_frame(f"parts of frame {self.frame.number} make no frame")
        for array in _ARRAYS:
            setattr(self.frame, array, getattr(self.frame, array) + getattr(part, array))
        if part.continued:
            return None
        whole, self.frame = self.frame, None
        return whole

    def join_mesh(self, part: frame_pb2.Topology) -> None:
        if not self.more:
            self.meshes.append(type(part.mesh)())
        self.more = part.continued
        mesh = self.meshes[-1]
        for array in ("triangles", "flat_m", "flat_triangles"):
            setattr(mesh, array, getattr(mesh, array) + getattr(part.mesh, array))
        mesh.panels.extend(part.mesh.panels)


def topology_of(header: frame_pb2.StreamHeader, meshes: list[Any]) -> dict[str, MeshData]:
    """Triangles by the name of their sheet; those of a grid need not be given."""
    topology = {}
    for i, sheet in enumerate(header.sheets):
        mesh = MeshData.from_proto(meshes[i]) if i < len(meshes) else MeshData(None, [])
        if sheet.rows and not np.size(cast(Any, mesh.triangles)):
            mesh.triangles = grid_triangles(sheet.rows, sheet.columns)
        topology[sheet.name] = mesh
    return topology


def grid_triangles(rows: int, columns: int) -> npt.NDArray[np.uint32]:
    """Two of each cell, row by row: (2 (rows - 1) (columns - 1), 3)."""
    index = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return np.stack([a, b, d, c, d, b], axis=-1).reshape(-1, 3)


def format_of(
    encoding: Encoding = "FLOAT32",
    velocities: bool = False,
    normals: bool = False,
    strain: bool = False,
    pressure: bool = False,
    clearance: bool = False,
    particles: range | None = None,
    grid_step_m: float | None = None,
    topology: bool = False,
) -> frame_pb2.FrameFormat:
    """What a frame is to hold; `particles` are those of its arrays, all if None."""
    format = frame_pb2.FrameFormat(
        encoding=enum_number(frame_pb2.FrameFormat, "encoding", encoding),
        velocities=velocities,
        normals=normals,
        strain=strain,
        pressure=pressure,
        clearance=clearance,
        stats=True,
        topology=topology,
        grid_step_m=grid_step_m,
    )
    if particles is not None:
        format.first_particle = particles.start
        format.particle_count = particles.stop - particles.start
        format.stride = particles.step
    return format
