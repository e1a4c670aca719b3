"""The calls of `weft`, to be awaited: each is as its namesake there.

>>> async def sessions():
...     async with serve() as server:
...         return await server.sessions()
>>> asyncio.run(sessions())
[]
"""
from __future__ import annotations

import asyncio
import contextlib
from typing import Any, AsyncGenerator, Callable, Iterable, NamedTuple, Sequence

import grpc

from . import calls, client
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
    """As weft.connect; within a running event loop."""
    address, token, tls = calls.credentials(address, token, tls_ca, tls_cert, tls_key)
    channel = (
        grpc.aio.secure_channel(address, tls, calls.CHANNEL_OPTIONS)
        if tls
        else grpc.aio.insecure_channel(address, calls.CHANNEL_OPTIONS)
    )
    return Server(Link(channel, address, token))


def serve(
    *,
    data_dir: str | None = None,
    workers: int | None = None,
    weftd: str | None = None,
    arguments: Sequence[str] = (),
) -> "Server":
    """As weft.serve; within a running event loop, which waits until it serves."""
    process = Process(data_dir, workers, weftd, arguments)
    server = connect(process.address, "", tls_ca="", tls_cert="", tls_key="")
    server._process = process
    return server


class Server:
    """As weft.Server."""

    def __init__(self, link: Link):
        self._link = link
        self._process: Process | None = None

    @property
    def address(self) -> str:
        return self._link.address

    async def __aenter__(self) -> "Server":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        await self._link.channel.close()
        if self._process:
            await asyncio.get_running_loop().run_in_executor(None, self._process.end)

    async def call(self, request: Any) -> Any:
        calls.named(request)
        attempts = Attempts(self._link, request)
        while True:
            try:
                answer = await self._link.method(request)(request, metadata=attempts.metadata)
                attempts.heard()
                return answer
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            await asyncio.sleep(pause)

    async def _all(self, request: Any, field: str) -> list[Any]:
        found: list[Any] = []
        while True:
            page = await self.call(request)
            found.extend(getattr(page, field))
            request.page_token = page.next_page_token
            if not request.page_token:
                return found

    async def check(
        self, scene: Scene, *, refused_warnings: Sequence[str] = ()
    ) -> session_pb2.Session:
        return await self._create(scene, "", True, refused_warnings)

    async def create_session(
        self, scene: Scene, session_id: str = "", *, refused_warnings: Sequence[str] = ()
    ) -> "Session":
        return Session(self, await self._create(scene, session_id, False, refused_warnings))

    async def _create(
        self, scene: Scene, session_id: str, validate_only: bool, refused_warnings: Sequence[str]
    ) -> session_pb2.Session:
        message = scene.to_proto()
        for path, source in calls.large_meshes(message):
            try:
                data = source.data.SerializeToString(deterministic=True)
                source.asset = (await self._upload(data)).name
            except InvalidArgument as wrong:
                raise calls.at(path, wrong) from None
        session: session_pb2.Session = await self.call(
            calls.create_request(message, session_id, validate_only, refused_warnings)
        )
        return session

    async def session(self, name: str) -> "Session":
        request = session_pb2.GetSessionRequest(name=calls.session_name(name))
        return Session(self, await self.call(request))

    async def sessions(self) -> list[session_pb2.Session]:
        return await self._all(session_pb2.ListSessionsRequest(), "sessions")

    async def restore(self, snapshot: str, session_id: str = "") -> "Session":
        request = session_pb2.RestoreSessionRequest(name=snapshot, session_id=session_id)
        return Session(self, await self.call(request))

    async def textiles(self) -> list[textile_pb2.TextilePreset]:
        return list((await self.call(textile_pb2.ListTextilesRequest())).textiles)

    async def textile(self, name: str) -> textile_pb2.TextilePreset:
        request = textile_pb2.GetTextileRequest(name=calls.textile_name(name))
        preset: textile_pb2.TextilePreset = await self.call(request)
        return preset

    async def build_garment(
        self, pattern: Pattern, edge_m: float | None = None
    ) -> garment_pb2.BuildGarmentResponse:
        built: garment_pb2.BuildGarmentResponse = await self.call(
            calls.garment_request(pattern, edge_m)
        )
        return built

    async def drape(
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
        built = await self.build_garment(pattern, edge_m)
        scene = calls.garment_scene(built, bodies, textile, deflate_m, accuracy)
        session = await self.create_session(scene)
        last = calls.frames_within((await session.get()).scene, seconds)
        await session.run(until_rest=True, until_frame=last)
        await session.wait()
        mesh = MeshData.from_proto(built.sheet.triangles.data)
        return Drape(session, await session.frame(), mesh, await session.verdict())

    async def run_test(
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
        request = calls.test_request(test, textile, bending, direction, spacings_m, mesh)
        attempts = Attempts(self._link, request)
        method = self._link.method(request)
        while True:
            try:
                async for message in method(request, metadata=attempts.metadata):
                    attempts.heard()
                    if progress and message.HasField("progress"):
                        progress(message.progress)
                report: lab_pb2.LabReport = message.report
                return report
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            await asyncio.sleep(pause)

    async def upload(self, mesh: MeshData) -> asset_pb2.Asset:
        return await self._upload(calls.mesh_data(mesh))

    async def _upload(self, data: bytes) -> asset_pb2.Asset:
        upload = Upload(self._link, data)
        send = self._link.method(upload.first)
        messages = [upload.first]
        while True:
            try:
                asset: asset_pb2.Asset = await send(messages, metadata=upload.attempts.metadata)
                messages = upload.missing(asset)
                if not messages:
                    return asset
                pause = 0.0
            except grpc.RpcError as cause:
                messages = [upload.first]
                pause = upload.pause(cause)
            await asyncio.sleep(pause)

    async def download(self, name: str) -> MeshData:
        request = asset_pb2.DownloadAssetRequest(name=name)
        attempts = Attempts(self._link, request)
        method = self._link.method(request)
        data = b""
        while True:
            try:
                async for message in method(request, metadata=attempts.metadata):
                    attempts.heard()
                    data += message.data
                    request.offset = len(data)
                return calls.mesh_of(name, data)
            except grpc.RpcError as cause:
                pause = attempts.pause(cause)
            await asyncio.sleep(pause)

    async def asset(self, name: str) -> asset_pb2.Asset:
        asset: asset_pb2.Asset = await self.call(asset_pb2.GetAssetRequest(name=name))
        return asset

    async def assets(self) -> list[asset_pb2.Asset]:
        return await self._all(asset_pb2.ListAssetsRequest(), "assets")

    async def delete_asset(self, name: str, allow_missing: bool = False) -> None:
        await self.call(asset_pb2.DeleteAssetRequest(name=name, allow_missing=allow_missing))

    async def info(self) -> server_pb2.ServerInfo:
        info: server_pb2.ServerInfo = await self.call(server_pb2.GetServerInfoRequest())
        return info

    async def stats(self) -> server_pb2.ServerStats:
        stats: server_pb2.ServerStats = await self.call(server_pb2.GetServerStatsRequest())
        return stats


class Session:
    """As weft.Session."""

    def __init__(self, server: Server, session: session_pb2.Session):
        self.server = server
        self.name = session.name
        self.uid = session.uid
        self._next = session.frame  # to be read

    async def get(self) -> session_pb2.Session:
        session: session_pb2.Session = await self.server.call(
            session_pb2.GetSessionRequest(name=self.name)
        )
        return session

    async def scene(self) -> Scene:
        return Scene.from_proto((await self.get()).scene)

    async def delete(self) -> None:
        await self.server.call(session_pb2.DeleteSessionRequest(name=self.name))

    async def step(
        self, frames: int = 1, expected_frame: int | None = None
    ) -> session_pb2.StepSessionResponse:
        answer: session_pb2.StepSessionResponse = await self.server.call(
            session_pb2.StepSessionRequest(
                name=self.name, frames=frames, expected_frame=expected_frame
            )
        )
        return answer

    async def run(
        self,
        *,
        until_rest: bool = False,
        until_frame: int | None = None,
        time_scale: float | None = None,
    ) -> int:
        request = session_pb2.RunSessionRequest(
            name=self.name, until_rest=until_rest, until_frame=until_frame, time_scale=time_scale
        )
        frame: int = (await self.server.call(request)).applied_frame
        return frame

    async def pause(self) -> int:
        answer = await self.server.call(session_pb2.PauseSessionRequest(name=self.name))
        frame: int = answer.applied_frame
        return frame

    async def verdict(self) -> session_pb2.Verdict:
        verdict: session_pb2.Verdict = await self.server.call(
            session_pb2.GetVerdictRequest(name=self.name)
        )
        return verdict

    async def wait(self) -> session_pb2.Session:
        start = (await self.get()).frame
        request = calls.stream_request(self.name, start, None, True, format_of(particles=range(1)))
        async for _ in self._read(self._feed(request), False):
            pass
        return await self.get()

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
    ) -> AsyncGenerator[Frame, None]:
        format = format_of(
            encoding, velocities, normals, strain, pressure, clearance, particles, grid_step_m
        )
        begin = self._next if start is None else start
        request = calls.stream_request(self.name, begin, end, hold, format)
        return self._read(self._feed(request, through_pauses), start is None)

    def _feed(self, request: frame_pb2.StreamFramesRequest, through_pauses: bool = False) -> Feed:
        request.uid = self.uid
        return Feed(self.server._link, request, through_pauses)

    async def _read(self, feed: Feed, goes_on: bool) -> AsyncGenerator[Frame, None]:
        method = self.server._link.method(feed.request)
        while True:
            stream = method(feed.request, metadata=feed.attempts.metadata)
            try:
                async for message in stream:
                    frame = feed.take(message)
                    if feed.ends_with_run and message.HasField("header"):
                        feed.note(await self.get())
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
            await asyncio.sleep(pause)

    async def frame(self, number: int | None = None, **format: Any) -> Frame:
        frames = self.view(**format) if number is None else self.frames(number, number, **format)
        try:
            return await frames.__anext__()
        finally:
            await frames.aclose()

    async def view(
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
    ) -> AsyncGenerator[Frame, None]:
        format = format_of(
            encoding, velocities, normals, strain, pressure, clearance, particles, grid_step_m
        )
        view = View(self.server._link, calls.view_request(self.name, self.uid, format, credits))
        method = self.server._link.method(view.request)
        while True:
            stream = method(metadata=view.attempts.metadata)
            try:
                await _write(stream, view.request)
                async for message in stream:
                    frame = view.take(message)
                    if frame:
                        yield frame
                        await _write(stream, frame_pb2.ViewFramesRequest(credits=1))
                return
            except grpc.RpcError as cause:
                pause = view.attempts.pause(cause)
            finally:
                stream.cancel()
            await asyncio.sleep(pause)

    async def topology(self) -> dict[str, MeshData]:
        now = await self.get()
        format = format_of(topology=True, particles=range(1))
        feed = self._feed(calls.stream_request(self.name, now.frame, now.frame, False, format))
        async for _ in self._read(feed, False):
            pass
        assert feed.reader
        return topology_of(feed.reader.header, feed.parts.meshes)

    async def set_textile(
        self,
        textile: Textile,
        sheet: str = "",
        over: float | None = None,
        fields: list[str] | None = None,
    ) -> session_pb2.UpdateTextileResponse:
        answer: session_pb2.UpdateTextileResponse = await self.server.call(
            calls.textile_request(self.name, textile, sheet, over, fields)
        )
        return answer

    async def act(self, *actions: Action) -> int:
        answer = await self.server.call(calls.actions_request(self.name, actions))
        frame: int = answer.applied_frame
        return frame

    async def grab(self, particle: int, sheet: str = "") -> int:
        return await self.act(Grab(particle, sheet))

    async def drag(
        self, particle: int, target_m: Vector3, over: float | None = None, sheet: str = ""
    ) -> int:
        return await self.act(Drag(particle, target_m, over, sheet))

    async def release(self, particle: int, sheet: str = "") -> int:
        return await self.act(Release(particle, sheet))

    async def pin(self, particle: int, sheet: str = "") -> int:
        return await self.act(PinParticle(particle, sheet))

    async def unpin(self, particle: int, sheet: str = "") -> int:
        return await self.act(UnpinParticle(particle, sheet))

    async def move_collider(
        self, offset_m: Vector3, over: float | None = None, collider: str = ""
    ) -> int:
        return await self.act(MoveCollider(offset_m, over, collider))

    async def pose_collider(
        self, pose_time_s: float, speed: float | None = None, collider: str = ""
    ) -> int:
        return await self.act(PoseCollider(pose_time_s, speed, collider))

    async def relax(self) -> int:
        return await self.act(Relax())

    def hand(self) -> "Hand":
        return Hand(self)

    async def snapshot(self, snapshot_id: str = "") -> session_pb2.Snapshot:
        snapshot: session_pb2.Snapshot = await self.server.call(
            session_pb2.CreateSnapshotRequest(parent=self.name, snapshot_id=snapshot_id)
        )
        return snapshot

    async def snapshots(self) -> list[session_pb2.Snapshot]:
        answer = await self.server.call(session_pb2.ListSnapshotsRequest(parent=self.name))
        return list(answer.snapshots)


async def _write(stream: Any, request: Any) -> None:
    with contextlib.suppress(asyncio.InvalidStateError, grpc.RpcError):
        await stream.write(request)  # whoever reads is told why it has ended


class Drape(NamedTuple):
    """As weft.Drape."""

    session: Session
    frame: Frame
    mesh: MeshData
    verdict: session_pb2.Verdict


class Hand:
    """As weft.Hand."""

    def __init__(self, session: Session):
        self._address = session.server.address
        self._name = session.name
        self._sent = self._answered = 0
        request = session_pb2.InteractRequest(session=session.name)
        link = session.server._link
        self._stream = link.method(request)(metadata=Attempts(link, request).metadata)

    async def __aenter__(self) -> "Hand":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        try:
            await self._stream.done_writing()
            while await self._stream.read() is not grpc.aio.EOF:
                pass
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass  # it has let go

    async def act(self, action: Action) -> None:
        self._sent += 1
        request = session_pb2.InteractRequest(
            session=self._name, sequence=self._sent, action=action_proto(action, "action")
        )
        await _write(self._stream, request)

    async def grab(self, particle: int, sheet: str = "") -> None:
        await self.act(Grab(particle, sheet))

    async def drag(
        self, particle: int, target_m: Vector3, over: float | None = None, sheet: str = ""
    ) -> None:
        await self.act(Drag(particle, target_m, over, sheet))

    async def release(self, particle: int, sheet: str = "") -> None:
        await self.act(Release(particle, sheet))

    async def wait(self) -> int:
        frame = 0
        try:
            while self._answered < self._sent:
                answer = await self._stream.read()
                if answer is grpc.aio.EOF:
                    break
                self._answered, frame = answer.sequence, answer.applied_frame
        except grpc.RpcError as cause:
            raise Refusal(cause).as_error(self._address) from None
        return frame


for _kind, _plain in (Server, client.Server), (Session, client.Session), (Hand, client.Hand):
    for _name, _method in vars(_kind).items():
        if not _name.startswith("_") and not _method.__doc__:
            _method.__doc__ = (getattr(_plain, _name).__doc__ or "").split(">>>")[0]
