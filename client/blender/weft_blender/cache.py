"""Point caches (PC2), which Blender's modifier Mesh Cache reads by itself."""
from __future__ import annotations

import os
import pathlib
import struct

import numpy as np

# magic, version, points, first frame, frames a sample, samples
_HEADER = struct.Struct("<12s2i2fi")
_MAGIC = b"POINTCACHE2\0"
_SAMPLES_AT = _HEADER.size - 4


class Cache:
    """A file that grows frame by frame, and may be read at any time meanwhile."""

    def __init__(self, path: str | os.PathLike[str], first: np.ndarray):
        """first: (n, 3), the points of its first frame."""
        self.path = pathlib.Path(path)
        self._points, self._samples = len(first), 1
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.unlink(missing_ok=True)  # who reads the one before keeps that
        self._file = open(self.path, "wb")
        header = _HEADER.pack(_MAGIC, 1, self._points, 0.0, 1.0, 1)
        self._file.write(header + _bytes_of(first, self._points))
        self._file.flush()

    def append(self, points: np.ndarray) -> None:
        """Adds a frame, (n, 3); it counts once it is whole."""
        self._file.write(_bytes_of(points, self._points))
        self._file.flush()
        self._samples += 1
        self._file.seek(_SAMPLES_AT)
        self._file.write(struct.pack("<i", self._samples))
        self._file.flush()
        self._file.seek(0, os.SEEK_END)

    def close(self) -> None:
        self._file.close()


def read(path: str | os.PathLike[str]) -> np.ndarray:
    """All frames, (frames, n, 3)."""
    data = pathlib.Path(path).read_bytes()
    magic, version, points, _, _, samples = _HEADER.unpack_from(data)
    if magic != _MAGIC or version != 1:
        raise ValueError(f"{path} is no point cache of version 1")
    numbers = np.frombuffer(data, "<f4", 3 * points * samples, _HEADER.size)
    return numbers.reshape(samples, points, 3)


def _bytes_of(points: np.ndarray, count: int) -> bytes:
    if np.shape(points) != (count, 3):
        raise ValueError(f"a frame has the shape {np.shape(points)}, not ({count}, 3)")
    return np.ascontiguousarray(points, "<f4").tobytes()
