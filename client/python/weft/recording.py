"""Recordings that `weft record` made."""
from __future__ import annotations

import functools
import os
import pathlib
import sqlite3
import zlib
from typing import Any, Iterator

from google.protobuf import json_format

from .errors import Damaged, Error, InvalidArgument, error
from .frame import Array, Frame, Reader, topology_of
from .scene import MeshData, Scene
from .v1 import frame_pb2, mesh_pb2

_ID = 0x57454654  # "WEFT"
_GRIDS, _TRIANGLES = 2, 3  # versions of the file


def open(path: str | os.PathLike[str]) -> "Recording":
    """Opens a recording; what a recorder adds later is not in it."""
    return Recording(path)


class Recording:
    """Frames of a session as they were streamed, each held to its checksum when it is read.

    header       weft.v1.StreamHeader: sheets, frame step, format
    first_frame  number of the first frame
    last_frame   number of the last one; first_frame - 1 where there is none
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path = os.fspath(path)
        try:
            # to write, too: a killed recorder may have left something to finish
            uri = pathlib.Path(path).absolute().as_uri() + "?mode=rw"
            self._file = sqlite3.connect(uri, uri=True, timeout=30)
            self._file.execute("PRAGMA query_only = 1")
        except sqlite3.OperationalError as wrong:
            text = f"cannot read {self.path}: {wrong}"
            raise error("NOT_FOUND", "FILE_UNREADABLE", text) from None
        try:
            self._read()
        except BaseException:
            self.close()
            raise

    def _read(self) -> None:
        version = self._row("PRAGMA user_version")[0]
        if self._row("PRAGMA application_id")[0] != _ID:
            raise self._malformed("not a recording of weft")
        if version not in (_GRIDS, _TRIANGLES):
            raise self._malformed("made by another version of weft")
        row = self._row("SELECT weft_version, recorded_at, scene, header, checksum FROM recording")
        extent = self._row("SELECT last_frame, checksum FROM extent")
        if not row or not extent:
            raise self._damaged("it does not say what it holds")
        made_by, self.recorded_at, scene, header, checksum = row
        described = "".join([made_by, self.recorded_at, scene, header]).encode()
        if zlib.crc32(described) != checksum:
            raise self._damaged("the checksum of its description is wrong")
        self._scene = scene
        self.header = json_format.Parse(header, frame_pb2.StreamHeader())
        for sheet in self.header.sheets:  # older ones do not say it of grids
            if sheet.rows:
                sheet.particle_count = sheet.rows * sheet.columns
                sheet.triangle_count = 2 * (sheet.rows - 1) * (sheet.columns - 1)
        self._reader = Reader(self.header)
        self.first_frame: int = self.header.start_frame
        self.last_frame, checksum = extent
        if checksum != self._checksum(self.last_frame):
            raise self._damaged("the checksum of its number of frames is wrong")
        self._version = version

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self.last_frame - self.first_frame + 1

    def __iter__(self) -> Iterator[Frame]:
        return (self.frame(n) for n in range(self.first_frame, self.last_frame + 1))

    @functools.cached_property
    def scene(self) -> Scene:
        """What was simulated."""
        return Scene.from_json(self._scene)

    def positions(self, frame: int) -> Array:
        """Positions of a frame, (n, 3), m, as they were recorded."""
        return self.frame(frame).positions

    def frame(self, number: int) -> Frame:
        """A frame by its number."""
        row = self._row("SELECT time_s, frame, checksum FROM frames WHERE number = ?", number)
        if not row:
            if self.first_frame <= number <= self.last_frame:
                raise self._damaged(f"frame {number} is missing")
            raise error("NOT_FOUND", "FRAME_MISSING", f"{self.path} has no frame {number}")
        if row[2] != self._checksum(number, row[1]):
            raise self._damaged(f"the checksum of frame {number} is wrong")
        return self._reader.read(frame_pb2.Frame.FromString(row[1]))

    def topology(self) -> dict[str, MeshData]:
        """Triangles, their flat shape and panels of each sheet, by its name, grids too."""
        meshes = []
        for sheet in range(len(self.header.sheets) if self._version == _TRIANGLES else 0):
            row = self._row("SELECT mesh, checksum FROM topology WHERE sheet = ?", sheet)
            if not row or row[1] != self._checksum(sheet, row[0]):
                raise self._damaged(f"the checksum of the triangles of sheet {sheet} is wrong")
            meshes.append(mesh_pb2.MeshData.FromString(row[0]))
        return topology_of(self.header, meshes)

    def _row(self, sql: str, *values: Any) -> Any:
        try:
            return self._file.execute(sql, values).fetchone()
        except sqlite3.DatabaseError as wrong:
            if "not a database" in str(wrong):
                raise self._malformed("not a recording of weft") from None
            raise self._damaged(str(wrong)) from None

    def _checksum(self, number: int, data: bytes = b"") -> int:
        key: bytes = self.header.uid.encode() + number.to_bytes(8, "little", signed=True)
        return zlib.crc32(key + data)

    def _malformed(self, why: str) -> Error:
        return InvalidArgument("INVALID_ARGUMENT", "FILE_MALFORMED", f"{self.path}: {why}")

    def _damaged(self, why: str) -> Error:
        return Damaged("DATA_LOSS", "FILE_DAMAGED", f"{self.path} is damaged: {why}")
