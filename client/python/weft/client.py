"""Servers and sessions, call by call."""
from __future__ import annotations

import queue
import time
from typing import Any, Callable, Generator, Iterable, NamedTuple, Sequence

import grpc

from . import calls
from .calls import Attempts, Feed, Link, Upload, View
from .errors import InvalidArgument, Refusal
from .frame import Encoding, Frame, format_of, topology_of
from .process import Process
from .scene import (
    Accuracy,
    Action,
    BendingLaw,
    Collider,
    Drag,
    Grab,
    LabDirection,
    LabMesh,
    LabTest,
    MeshData,
    MoveCollider,
    Pattern,
    PinParticle,
    PoseCollider,
    Relax,
    Release,
    Scene,
    Sheet,
    Textile,
    UnpinParticle,
    Vector3,
    action_proto,
)
from .v1 import asset_pb2, frame_pb2, garment_pb2, lab_pb2, server_pb2, session_pb2
from .v1 import textile_pb2


def connect(
    address: str | None = None,
    token: str | None = None,
    *,
    tls_ca: str | None = None,
    tls_cert: str | None = None,
    tls_key: str | None = None,
) -> "Server":
    """A server that listens somewhere, "127.0.0.1:7311" if it is not said.

    `token` says who calls. tls_ca is a file of certificates (PEM), one of which signed the
    server's; tls_cert and tls_key are files of one's own. What is not given comes from
    WEFT_SERVER, WEFT_TOKEN, WEFT_TOKEN_FILE, WEFT_TLS_CA, WEFT_TLS_CERT and WEFT_TLS_KEY.
    """
    address, token, tls = calls.credentials(address, token, tls_ca, tls_cert, tls_key)
    channel = (
        grpc.secure_channel(address, tls, calls.CHANNEL_OPTIONS)
        if tls
        else grpc.insecure_channel(address, calls.CHANNEL_OPTIONS)
    )
    return Server(Link(channel, address, token))


def serve(
    *,
    data_dir: str | None = None,
    workers: int | None = None,
    weftd: str | None = None,
    arguments: Sequence[str] = (),
) -> "Server":
    """A server of one's own, which ends with this program, however that ends.

    It listens on a free port of this machine. Sessions are forgotten with it, unless data_dir
    names a directory that keeps them. `weftd` is the program, if it is not on PATH; `arguments`
    are more of its flags.

    >>> with serve() as server:
    ...     len(server.sessions())
    0
    """
    process = Process(data_dir, workers, weftd, arguments)
    server = connect(process.address, "", tls_ca="", tls_cert="", tls_key="")
    server._process = process
    return server


class Server:
    """Calls to a weftd. `with` closes it."""

    def __init__(self, link: Link):
        self._link = link
        self._process: Process | None = None

    @property
    def address(self) -> str:
        """Host and port."""
        return self._link.address

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection, and the server if it is one's own."""
        self._link.channel.close()
        if self._process:
            self._process.end()

    def call(self, request: Any) -> Any:
        """The answer to a request of weft.v1 that has one; those of streams have methods here."""
        calls.named(request)
        attempts = Attempts(self._link, request)
        while True:
            try:
                answer = self._link.method(request)(request, metadata=attempts.metadata)
                attempts.heard()
                return answer
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            time.sleep(pause)

    def _all(self, request: Any, field: str) -> list[Any]:
        found: list[Any] = []
        while True:
            page = self.call(request)
            found.extend(getattr(page, field))
            request.page_token = page.next_page_token
            if not request.page_token:
                return found

    # sessions

    def check(
        self, scene: Scene, *, refused_warnings: Sequence[str] = ()
    ) -> session_pb2.Session:
        """The session that a scene would be, with its plan: step, cost and warnings.
        InvalidArgument has every reason why it cannot be one.

        >>> with serve() as server:
        ...     server.check(Scene([Sheet.grid(1, 31, 0.03, Textile.preset("denim_11oz"))]))
        Traceback (most recent call last):
        weft.errors.InvalidArgument: sheets[0].grid.rows: 1 is not within 2 to 4096
        """
        return self._create(scene, "", True, refused_warnings)

    def create_session(
        self, scene: Scene, session_id: str = "", *, refused_warnings: Sequence[str] = ()
    ) -> "Session":
        """A session, paused at frame 0. Larger meshes go up as assets first. InvalidArgument where
        its plan has one of the warnings refused, by their codes, such as STARTS_INSIDE."""
        return Session(self, self._create(scene, session_id, False, refused_warnings))

    def _create(
        self, scene: Scene, session_id: str, validate_only: bool, refused_warnings: Sequence[str]
    ) -> session_pb2.Session:
        message = scene.to_proto()
        for path, source in calls.large_meshes(message):
            try:
                source.asset = self._upload(source.data.SerializeToString(deterministic=True)).name
            except InvalidArgument as wrong:
                raise calls.at(path, wrong) from None
        session: session_pb2.Session = self.call(
            calls.create_request(message, session_id, validate_only, refused_warnings)
        )
        return session

    def session(self, name: str) -> "Session":
        """The session of a name, "drape" or "sessions/drape"."""
        request = session_pb2.GetSessionRequest(name=calls.session_name(name))
        return Session(self, self.call(request))

    def sessions(self) -> list[session_pb2.Session]:
        """All sessions in order of name."""
        return self._all(session_pb2.ListSessionsRequest(), "sessions")

    def restore(self, snapshot: str, session_id: str = "") -> "Session":
        """A session that goes on from "sessions/{session}/snapshots/{snapshot}"."""
        request = session_pb2.RestoreSessionRequest(name=snapshot, session_id=session_id)
        return Session(self, self.call(request))

    # textiles and tests

    def textiles(self) -> list[textile_pb2.TextilePreset]:
        """All presets, with the source of every number."""
        return list(self.call(textile_pb2.ListTextilesRequest()).textiles)

    def textile(self, name: str) -> textile_pb2.TextilePreset:
        """One preset, "denim_11oz"."""
        request = textile_pb2.GetTextileRequest(name=calls.textile_name(name))
        preset: textile_pb2.TextilePreset = self.call(request)
        return preset

    def build_garment(
        self, pattern: Pattern, edge_m: float | None = None
    ) -> garment_pb2.BuildGarmentResponse:
        """A pattern cut into triangles and sewn: `Sheet.from_proto(answer.sheet)` lacks its textile
        alone. edge_m is the wanted length of triangles' edges, m; None: 0.01."""
        built: garment_pb2.BuildGarmentResponse = self.call(
            calls.garment_request(pattern, edge_m)
        )
        return built

    def drape(
        self,
        pattern: Pattern,
        bodies: Iterable[Collider],
        textile: Textile,
        *,
        edge_m: float | None = None,
        deflate_m: float | None = None,
        accuracy: Accuracy | None = None,
        seconds: float = 20,
    ) -> "Drape":
        """Puts a garment of measured textiles on bodies, and waits until it hangs at rest, for so
        many simulated seconds at most.

        deflate_m  by how much bodies are smaller while seams close: 0.02 parts thighs for trousers

        Seams close around the bodies, then weight comes in, as `weft drape` has it. The session has
        all frames from the flat panels on, and stays until it is deleted.
        """
        built = self.build_garment(pattern, edge_m)
        scene = calls.garment_scene(built, bodies, textile, deflate_m, accuracy)
        session = self.create_session(scene)
        last = calls.frames_within((session.get()).scene, seconds)
        session.run(until_rest=True, until_frame=last)
        session.wait()
        mesh = MeshData.from_proto(built.sheet.triangles.data)
        return Drape(session, session.frame(), mesh, session.verdict())

    def run_test(
        self,
        test: LabTest,
        textile: Textile,
        *,
        bending: BendingLaw | None = None,
        direction: LabDirection = "WARP",
        spacings_m: Iterable[float] = (),
        mesh: LabMesh = "LATTICE",
        progress: Callable[[lab_pb2.LabProgress], object] | None = None,
    ) -> lab_pb2.LabReport:
        """Puts a textile to a test of weft.v1.LabTest, such as "DRAPE" or "CANTILEVER"."""
        request = calls.test_request(test, textile, bending, direction, spacings_m, mesh)
        attempts = Attempts(self._link, request)
        while True:
            try:
                for message in self._link.method(request)(request, metadata=attempts.metadata):
                    attempts.heard()
                    if progress and message.HasField("progress"):
                        progress(message.progress)
                report: lab_pb2.LabReport = message.report
                return report
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            time.sleep(pause)

    # meshes

    def upload(self, mesh: MeshData) -> asset_pb2.Asset:
        """Sends a mesh, or as much as the server has not got; its name can stand in a scene."""
        return self._upload(calls.mesh_data(mesh))

    def _upload(self, data: bytes) -> asset_pb2.Asset:
        upload = Upload(self._link, data)
        send = self._link.method(upload.first)
        messages = [upload.first]
        while True:
            try:
                asset: asset_pb2.Asset = send(iter(messages), metadata=upload.attempts.metadata)
                messages = upload.missing(asset)
                if not messages:
                    return asset
                pause = 0.0
            except grpc.RpcError as cause:
                messages = [upload.first]
                pause = upload.pause(cause)
            time.sleep(pause)

    def download(self, name: str) -> MeshData:
        """The mesh of an asset, "assets/{hash}"."""
        request = asset_pb2.DownloadAssetRequest(name=name)
        attempts = Attempts(self._link, request)
        data = b""
        while True:
            try:
                for message in self._link.method(request)(request, metadata=attempts.metadata):
                    attempts.heard()
                    data += message.data
                    request.offset = len(data)
                return calls.mesh_of(name, data)
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            time.sleep(pause)

    def asset(self, name: str) -> asset_pb2.Asset:
        """One asset, whole or not."""
        asset: asset_pb2.Asset = self.call(asset_pb2.GetAssetRequest(name=name))
        return asset

    def assets(self) -> list[asset_pb2.Asset]:
        """One's assets in order of name."""
        return self._all(asset_pb2.ListAssetsRequest(), "assets")

    def delete_asset(self, name: str, allow_missing: bool = False) -> None:
        """Forgets an asset that no session names."""
        self.call(asset_pb2.DeleteAssetRequest(name=name, allow_missing=allow_missing))

    # the server

    def info(self) -> server_pb2.ServerInfo:
        """Version and limits."""
        info: server_pb2.ServerInfo = self.call(server_pb2.GetServerInfoRequest())
        return info

    def stats(self) -> server_pb2.ServerStats:
        """What it does and has done."""
        stats: server_pb2.ServerStats = self.call(server_pb2.GetServerStatsRequest())
        return stats


class Session:
    """A simulation on a server.

    >>> with serve() as server:
    ...     scene = Scene([Sheet.grid(5, 5, 0.05, Textile.preset("denim_11oz"))])
    ...     session = server.create_session(scene, "falls")
    ...     session.run(until_frame=30)
    ...     for frame in session.frames():
    ...         pass
    ...     frame.number, frame.positions.shape, frame.positions.dtype
    ...     round(float(frame.positions[:, 1].mean()), 2)  # m, after half a second
    1
    (30, (25, 3), dtype('float32'))
    -1.23
    """

    def __init__(self, server: Server, session: session_pb2.Session):
        self.server = server
        self.name = session.name
        self.uid = session.uid
        self._next = session.frame  # to be read

    def get(self) -> session_pb2.Session:
        """What it simulates, does now, and costs."""
        session: session_pb2.Session = self.server.call(
            session_pb2.GetSessionRequest(name=self.name)
        )
        return session

    def scene(self) -> Scene:
        """What it simulates, with every default filled in and textile changes applied."""
        return Scene.from_proto(self.get().scene)

    def delete(self) -> None:
        """Ends it, its streams and its snapshots."""
        self.server.call(session_pb2.DeleteSessionRequest(name=self.name))

    # time

    def step(
        self, frames: int = 1, expected_frame: int | None = None
    ) -> session_pb2.StepSessionResponse:
        """Computes frames and waits for them."""
        answer: session_pb2.StepSessionResponse = self.server.call(
            session_pb2.StepSessionRequest(
                name=self.name, frames=frames, expected_frame=expected_frame
            )
        )
        return answer

    def run(
        self,
        *,
        until_rest: bool = False,
        until_frame: int | None = None,
        time_scale: float | None = None,
    ) -> int:
        """Lets it advance by itself, and answers at once with the first frame of the run.

        It ends at rest, after a frame, or when it is paused. time_scale is simulated seconds for
        each second, as many as it can if None.
        """
        request = session_pb2.RunSessionRequest(
            name=self.name, until_rest=until_rest, until_frame=until_frame, time_scale=time_scale
        )
        frame: int = self.server.call(request).applied_frame
        return frame

    def pause(self) -> int:
        """Stops it after the frame it computes; the frame that would have come next."""
        frame: int = self.server.call(session_pb2.PauseSessionRequest(name=self.name)).applied_frame
        return frame

    def verdict(self) -> session_pb2.Verdict:
        """How its cloth sits now: whether a dressed garment is good, and what keeps it from that."""
        verdict: session_pb2.Verdict = self.server.call(
            session_pb2.GetVerdictRequest(name=self.name)
        )
        return verdict

    def wait(self) -> session_pb2.Session:
        """Waits until it stands still: at rest, at its last frame, or paused."""
        start = self.get().frame
        request = calls.stream_request(self.name, start, None, True, format_of(particles=range(1)))
        for _ in self._read(self._feed(request), False):
            pass
        return self.get()

    # frames

    def frames(
        self,
        start: int | None = None,
        end: int | None = None,
        *,
        encoding: Encoding = "FLOAT32",
        velocities: bool = False,
        normals: bool = False,
        strain: bool = False,
        pressure: bool = False,
        clearance: bool = False,
        particles: range | None = None,
        grid_step_m: float | None = None,
        hold: bool = True,
        through_pauses: bool = False,
    ) -> Generator[Frame, None, None]:
        """Frames in order, each once, none left out, until the session stands still.

        They begin behind the last one that this object gave, or with the one at which it was made;
        `start` and `end` name others. With an `end`, or through_pauses, they wait where the session
        stands still, until it goes on.
        A connection that breaks is made again, a server that was killed waited for, for a minute.
        Where the reader is slower, the session waits for it; with hold=False it does not, and
        FRAME_EXPIRED ends the stream once its next frame is no longer kept.

        `particles` are those of the arrays, such as range(0, 961, 31). QUANTIZED_ZSTD rounds to
        multiples of grid_step_m, 1e-4 if None, and takes a third to a tenth on the way.
        """
        format = format_of(
            encoding, velocities, normals, strain, pressure, clearance, particles, grid_step_m
        )
        begin = self._next if start is None else start
        request = calls.stream_request(self.name, begin, end, hold, format)
        return self._read(self._feed(request, through_pauses), start is None)

    def _feed(self, request: frame_pb2.StreamFramesRequest, through_pauses: bool = False) -> Feed:
        request.uid = self.uid
        return Feed(self.server._link, request, through_pauses)

    def _read(self, feed: Feed, goes_on: bool) -> Generator[Frame, None, None]:
        method = self.server._link.method(feed.request)
        while True:
            stream = method(feed.request, metadata=feed.attempts.metadata)
            try:
                for message in stream:
                    frame = feed.take(message)
                    if feed.ends_with_run and message.HasField("header"):
                        feed.note(self.get())
                    if frame:
                        if goes_on:
                            self._next = frame.number + 1
                        yield frame
                    if feed.complete:
                        return
                return
            except grpc.RpcError as cause:
                if feed.complete:
                    return
                pause = feed.attempts.pause(cause)
            finally:
                stream.cancel()
            time.sleep(pause)

    def frame(self, number: int | None = None, **format: Any) -> Frame:
        """One frame, the newest if None; `format` is as for `frames`."""
        frames = self.view(**format) if number is None else self.frames(number, number, **format)
        try:
            return next(frames)
        finally:
            frames.close()

    def view(
        self,
        credits: int = 1,
        *,
        encoding: Encoding = "FLOAT32",
        velocities: bool = False,
        normals: bool = False,
        strain: bool = False,
        pressure: bool = False,
        clearance: bool = False,
        particles: range | None = None,
        grid_step_m: float | None = None,
    ) -> Generator[Frame, None, None]:
        """The newest frame, again and again, for those who look: what comes while one is drawn is
        skipped, and holds up nobody. More credits keep a stream busier, and frames older."""
        format = format_of(
            encoding, velocities, normals, strain, pressure, clearance, particles, grid_step_m
        )
        view = View(self.server._link, calls.view_request(self.name, self.uid, format, credits))
        method = self.server._link.method(view.request)
        while True:
            requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
            requests.put(view.request)
            stream = method(iter(requests.get, None), metadata=view.attempts.metadata)
            try:
                for message in stream:
                    frame = view.take(message)
                    if frame:
                        yield frame
                        requests.put(frame_pb2.ViewFramesRequest(credits=1))
                return
            except grpc.RpcError as cause:
                pause = view.attempts.pause(cause)
            finally:
                requests.put(None)
                stream.cancel()
            time.sleep(pause)

    def topology(self) -> dict[str, MeshData]:
        """Triangles, their flat shape and panels of each sheet, by its name, grids too."""
        now = self.get()
        format = format_of(topology=True, particles=range(1))
        feed = self._feed(calls.stream_request(self.name, now.frame, now.frame, False, format))
        for _ in self._read(feed, False):
            pass
        assert feed.reader
        return topology_of(feed.reader.header, feed.parts.meshes)

    # changes

    def set_textile(
        self,
        textile: Textile,
        sheet: str = "",
        over: float | None = None,
        fields: list[str] | None = None,
    ) -> session_pb2.UpdateTextileResponse:
        """Changes a sheet's textile from the next frame on, or within `over` simulated s.

        `fields`, such as "measured.shear_n_per_m", are those that change; all if None.
        """
        answer: session_pb2.UpdateTextileResponse = self.server.call(
            calls.textile_request(self.name, textile, sheet, over, fields)
        )
        return answer

    def act(self, *actions: Action) -> int:
        """Does all of the actions, in order, or none; the first frame that shows them."""
        frame: int = self.server.call(calls.actions_request(self.name, actions)).applied_frame
        return frame

    def grab(self, particle: int, sheet: str = "") -> int:
        """A hand takes a particle, r x columns + c of a grid."""
        return self.act(Grab(particle, sheet))

    def drag(
        self, particle: int, target_m: Vector3, over: float | None = None, sheet: str = ""
    ) -> int:
        """The hand leads it to a place, m, within `over` simulated s, a frame if None."""
        return self.act(Drag(particle, target_m, over, sheet))

    def release(self, particle: int, sheet: str = "") -> int:
        """The hand lets it go."""
        return self.act(Release(particle, sheet))

    def pin(self, particle: int, sheet: str = "") -> int:
        """Holds a particle where it is."""
        return self.act(PinParticle(particle, sheet))

    def unpin(self, particle: int, sheet: str = "") -> int:
        """Ends what a pin does to a particle."""
        return self.act(UnpinParticle(particle, sheet))

    def move_collider(
        self, offset_m: Vector3, over: float | None = None, collider: str = ""
    ) -> int:
        """Moves a collider to an offset from its start, m, within `over` simulated s."""
        return self.act(MoveCollider(offset_m, over, collider))

    def pose_collider(
        self, pose_time_s: float, speed: float | None = None, collider: str = ""
    ) -> int:
        """Leads a body through its poses to a time of these, at a speed, m/s, 1 if None."""
        return self.act(PoseCollider(pose_time_s, speed, collider))

    def relax(self) -> int:
        """Comes to rest on the shortest way instead of moving in time; run(until_rest=True) it."""
        return self.act(Relax())

    def hand(self) -> "Hand":
        """A hand that follows a mouse; it lets go when its `with` ends."""
        return Hand(self)

    # snapshots

    def snapshot(self, snapshot_id: str = "") -> session_pb2.Snapshot:
        """Keeps it as it is; Server.restore goes on from there."""
        snapshot: session_pb2.Snapshot = self.server.call(
            session_pb2.CreateSnapshotRequest(parent=self.name, snapshot_id=snapshot_id)
        )
        return snapshot

    def snapshots(self) -> list[session_pb2.Snapshot]:
        """Its snapshots in order of frame."""
        return list(self.server.call(session_pb2.ListSnapshotsRequest(parent=self.name)).snapshots)


class Drape(NamedTuple):
    """A garment that was put on.

    session  its frames, from the flat panels on
    frame    the last one: `frame.positions` (n, 3), m
    mesh     its triangles, their flat shape and its panels, as they were cut
    verdict  whether it sits well, and what keeps it from that
    """

    session: Session
    frame: Frame
    mesh: MeshData
    verdict: session_pb2.Verdict


class Hand:
    """Actions that are sent as they come. Of drags that wait for a frame the newest counts."""

    def __init__(self, session: Session):
        self._address = session.server.address
        self._name = session.name
        self._requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._sent = self._answered = 0
        request = session_pb2.InteractRequest(session=session.name)
        link = session.server._link
        self._stream = link.method(request)(
            iter(self._requests.get, None), metadata=Attempts(link, request).metadata
        )

    def __enter__(self) -> "Hand":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Lets go of everything."""
        self._requests.put(None)
        try:
            for _ in self._stream:
                pass
        except grpc.RpcError:
            pass  # it has let go

    def act(self, action: Action) -> None:
        """Sends an action."""
        self._sent += 1
        self._requests.put(
            session_pb2.InteractRequest(
                session=self._name, sequence=self._sent, action=action_proto(action, "action")
            )
        )

    def grab(self, particle: int, sheet: str = "") -> None:
        """As Session.grab, without waiting."""
        self.act(Grab(particle, sheet))

    def drag(
        self, particle: int, target_m: Vector3, over: float | None = None, sheet: str = ""
    ) -> None:
        """As Session.drag, without waiting."""
        self.act(Drag(particle, target_m, over, sheet))

    def release(self, particle: int, sheet: str = "") -> None:
        """As Session.release, without waiting."""
        self.act(Release(particle, sheet))

    def wait(self) -> int:
        """Waits for the answer to what was sent; the first frame that shows it."""
        frame = 0
        try:
            while self._answered < self._sent:
                answer = next(self._stream)
                self._answered, frame = answer.sequence, answer.applied_frame
        except grpc.RpcError as cause:
            raise Refusal(cause).as_error(self._address) from None
        return frame
