"""A simulation on its way from a server into point caches."""
from __future__ import annotations

import pathlib
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Callable

import numpy as np
import weft

from .cache import Cache
from .faults import explain, note_of
from .scene import Prepared
from .surface import Refused


@dataclass
class Target:
    """Where the frames of a sheet go.

    path       of the point cache
    to_object  (1 or frames, 4, 4) from the world, m, to the object's own coordinates
    """

    path: pathlib.Path
    to_object: np.ndarray

    def points(self, frame: int, world: np.ndarray) -> np.ndarray:
        to = self.to_object[min(frame, len(self.to_object) - 1)]
        return world @ to[:3, :3].T + to[:3, 3]


class Run:
    """Computes a scene up to its last frame, in threads of its own; nothing here waits for them but
    `join`. Caches are begun anew when the server has taken the scene, so a refused one costs none.

    newest    the last frame that is in all caches, -1 before
    notes     what there is to say of the scene, and of the plan once there is one
    refused   why it ended before its time, or None
    lost      whether that is because the server cannot be reached
    """

    def __init__(
        self,
        server: Callable[[], weft.Server],
        prepared: Prepared,
        targets: dict[str, Target],
        last: int,
    ):
        """targets by sheet; last is the last frame, 0 the first."""
        self.prepared = prepared
        self.last = last
        self.newest = -1
        self.notes = list(prepared.notes)
        self.refused: Refused | None = None
        self.lost = self.cancelled = False
        self._targets = targets
        self._server = server
        self._session: weft.Session | None = None
        self._begun = threading.Event()  # or ended without that
        self._calls = ThreadPoolExecutor(1)
        self._troubles: list[str] = []
        self._thread = threading.Thread(target=self._compute, daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        return self._thread.is_alive()

    def join(self) -> None:
        """Waits for its end."""
        self._thread.join()

    def cancel(self) -> None:
        """Ends it, also within a frame that takes long; what there is stays."""
        self.cancelled = True
        self._later(lambda session: session.pause())

    def set_textile(self, name: str, textile: str) -> None:
        """Makes an object of another preset, from the next frame on."""
        sheet = self.prepared.sheet_of(name)
        if sheet:
            friction = self.prepared.cloths[sheet].friction
            preset = weft.Textile.preset(textile, friction_coefficient=friction)
            self._later(lambda session: session.set_textile(preset, sheet))

    def troubles(self) -> list[str]:
        """What calls since the last look were refused for."""
        said, self._troubles = self._troubles, []
        return said

    def _later(self, call: Callable[[weft.Session], object]) -> None:
        """Calls in order, once there is a session; the caller does not wait."""
        def work() -> None:
            self._begun.wait()
            try:
                if self._session and self.running:
                    call(self._session)
            except weft.Error as wrong:
                if self.running:
                    self._troubles = [*self._troubles, wrong.message]

        self._calls.submit(work)

    def _compute(self) -> None:
        caches: dict[str, Cache] = {}
        try:
            session = self._server().create_session(self.prepared.scene)
            try:
                self._begin(session)
                for frame in session.frames():
                    self._keep(frame, caches)
                    if self.cancelled:
                        break
                if not self.cancelled and self.newest < self.last:
                    why = session.get().failure or "somebody paused it"
                    self.refused = Refused(f"It ended after {self.newest + 1} frames: {why}")
            finally:
                session.delete()
        except weft.Error as wrong:
            self.refused = explain(wrong, self.prepared)
            self.lost = isinstance(wrong, weft.NoConnection)
        except OSError as wrong:  # of a cache, or of files that name who calls
            self.refused = Refused(f"{wrong.filename}: {wrong.strerror}")
        except BaseException:
            self.refused = Refused("It broke off; the console says why")
            raise
        finally:
            self._begun.set()
            for cache in caches.values():
                cache.close()

    def _begin(self, session: weft.Session) -> None:
        plan = session.get().plan
        self.notes += [note_of(each, self.prepared) for each in plan.warnings]
        if not self.cancelled and self.last > 0:
            session.run(until_frame=self.last)
        self._session = session
        self._begun.set()

    def _keep(self, frame: weft.Frame, caches: dict[str, Cache]) -> None:
        for sheet, target in self._targets.items():
            points = target.points(frame.number, frame.sheet(sheet))
            if sheet in caches:
                caches[sheet].append(points)
            else:
                caches[sheet] = Cache(target.path, points)
        self.newest = frame.number
