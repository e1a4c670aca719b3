"""What calls have in common, plain or awaited: how they are named, addressed and sent again."""
from __future__ import annotations

import dataclasses
import hashlib
import math
import os
import pathlib
import re
import time
import uuid
from typing import Any, Iterable, Iterator, Sequence, cast

import grpc

from .errors import Error, InvalidArgument, Refusal, Violation, error
from .frame import Frame, Parts, Reader
from .scene import Accuracy, Action, BendingLaw, Collider, Dressing, LabDirection, LabMesh, LabTest
from .scene import MeshData, Pattern, Scene, Sheet, SolverSettings, Textile, action_proto
from .v1 import asset_pb2, asset_pb2_grpc, frame_pb2, frame_pb2_grpc, garment_pb2
from .v1 import garment_pb2_grpc, lab_pb2, lab_pb2_grpc
from .v1 import mesh_pb2, server_pb2, server_pb2_grpc, session_pb2, session_pb2_grpc
from .v1 import textile_pb2, textile_pb2_grpc
from .values import enum_number

DEFAULT_SERVER = "127.0.0.1:7311"
PATIENCE = 10.0  # s, with attempts after the first that failed
STREAM_PATIENCE = 60.0  # s, with a stream that is gone
MOST_INLINE = 1 << 20  # bytes; larger meshes do not travel within a scene
UPLOAD_MESSAGE = 256 << 10  # bytes of the asset in one

SERVICES: list[tuple[Any, Any]] = [
    (session_pb2, session_pb2_grpc),
    (frame_pb2, frame_pb2_grpc),
    (textile_pb2, textile_pb2_grpc),
    (lab_pb2, lab_pb2_grpc),
    (asset_pb2, asset_pb2_grpc),
    (garment_pb2, garment_pb2_grpc),
    (server_pb2, server_pb2_grpc),
]

CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", -1),  # the server bounds what it sends
    ("grpc.use_local_subchannel_pool", 1),  # a socket for each connection
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 2000),
    ("grpc.keepalive_time_ms", 15_000),  # a peer that died without a word
    ("grpc.keepalive_timeout_ms", 10_000),
]


class Link:
    """A channel to a server, with a call for each kind of request."""

    def __init__(self, channel: Any, address: str, token: str | None):
        self.channel = channel
        self.address = address
        self.reached = False  # weftd has answered
        self.authorization = [("authorization", "Bearer " + token)] if token else []
        self.methods: dict[str, Any] = {}
        for messages, stubs in SERVICES:
            for service in messages.DESCRIPTOR.services_by_name.values():
                stub = getattr(stubs, service.name + "Stub")(channel)
                for method in service.methods:
                    self.methods[method.input_type.full_name] = getattr(stub, method.name)

    def method(self, request: Any) -> Any:
        return self.methods[request.DESCRIPTOR.full_name]


class Attempts:
    """The attempts to have a call answered.

    One that met a server that is draining, or that ended on the road, is followed by another, as
    far as sending it again does no harm: it only reads, has a request_id, or brings an asset. So
    is one that another server of several is to answer.
    """

    _harmless = re.compile("Get|List|StreamFrames|ViewFrames|UploadAsset|DownloadAsset|BuildGarment")

    def __init__(self, link: Link, request: Any, patience: float = PATIENCE):
        self._link = link
        self._patience = patience
        self._repeatable = bool(
            getattr(request, "request_id", "") or self._harmless.match(request.DESCRIPTOR.name)
        )
        self._session = _session_in(request)
        self._replica = ""
        self._heard = False
        self._begin()

    def _begin(self) -> None:
        self._failed_at: float | None = None
        self._refused: Refusal | None = None
        self._pause = 0.05

    @property
    def metadata(self) -> list[tuple[str, str]]:
        """Who calls, and what a load balancer goes by."""
        about = [("weft-session", self._session), ("weft-replica", self._replica)]
        return self._link.authorization + [each for each in about if each[1]]

    def heard(self) -> None:
        """A message came: patience begins anew."""
        self._link.reached = self._heard = True
        self._begin()

    def pause(self, cause: grpc.RpcError) -> float:
        """How long to wait before the next attempt, s; raises why there is none."""
        refusal = Refusal(cause)
        if self._is_hopeless(refusal):
            raise refusal.as_error(self._link.address) from None
        now = time.monotonic()
        is_first = self._failed_at is None
        self._failed_at = self._failed_at or now
        self._replica = refusal.metadata.get("replica", "")
        pause = self._pause
        if refusal.is_weftd:
            self._link.reached = True
            self._refused = refusal
            pause = 0.075
            if refusal.reason == "SERVER_DRAINING":
                self._patience = min(self._patience, PATIENCE)
            if refusal.reason == "WRONG_REPLICA" and is_first:
                return 0
        else:
            self._pause = min(2 * self._pause, 0.25)
        if now - self._failed_at >= self._patience:
            raise (self._refused or refusal).as_error(self._link.address) from None
        return pause

    def _is_hopeless(self, refusal: Refusal) -> bool:
        if refusal.reason == "WRONG_REPLICA":
            return self._heard and not self._repeatable
        if not self._repeatable:
            return True
        if refusal.is_weftd:
            return refusal.reason not in ("SERVER_DRAINING", "STORE_UNREACHABLE")
        if refusal.code == "UNAVAILABLE" and not self._link.reached:
            return True
        # a proxy's, or gRPC's own where a connection broke
        return refusal.code not in ("UNAVAILABLE", "UNKNOWN", "INTERNAL", "CANCELLED")


def _session_in(request: Any) -> str:
    """"flag" of "sessions/flag/snapshots/frame-9"."""
    session = getattr(request, "session_id", "")
    for field in ("name", "parent", "session"):
        name = getattr(request, field, "")
        if isinstance(name, str) and name.startswith("sessions/"):
            session = name.split("/")[1]
    return session if re.fullmatch("[a-z0-9-]{1,63}", session) else ""


def named(request: Any) -> Any:
    """The request, with a request_id where it has a field for one: it is carried out once."""
    if "request_id" in request.DESCRIPTOR.fields_by_name and not request.request_id:
        request.request_id = uuid.uuid4().hex
    return request


class Feed:
    """The frames of a session, in order and each once, whatever happens on the road: a stream that
    breaks is opened again behind the last frame that came."""

    def __init__(self, link: Link, request: frame_pb2.StreamFramesRequest, through_pauses: bool):
        self.request = request
        self.attempts = Attempts(link, request, STREAM_PATIENCE)
        self.reader: Reader | None = None
        self.parts = Parts()
        self._last = request.end_frame if request.HasField("end_frame") else None
        # after the newest frame of a session that stands still
        self.ends_with_run = self._last is None and not through_pauses

    def take(self, message: frame_pb2.StreamFramesResponse) -> Frame | None:
        """The frame that the message completes, if any."""
        self.attempts.heard()
        kind = message.WhichOneof("message")
        if kind == "header":
            self._begin(message.header)
        elif kind == "topology":
            self.parts.join_mesh(message.topology)
        elif kind == "progress":
            self._note(message.progress.state, message.progress.latest_frame)
        elif kind == "frame" and self.reader:
            frame = self.parts.join(message.frame)
            if frame is None:
                return None
            if frame.number != self.request.start_frame:
                text = f"frame {frame.number} came where frame {self.request.start_frame} was due"
                raise Error("INTERNAL", "FRAME_OUT_OF_ORDER", text)
            self.request.start_frame = frame.number + 1
            return self.reader.read(frame)
        return None

    def _begin(self, header: frame_pb2.StreamHeader) -> None:
        before = self.reader and self.reader.header.numerics_id
        if before and before != header.numerics_id:
            raise Error(
                "FAILED_PRECONDITION",
                "NUMERICS_CHANGED",
                f"the server went from numerics {before} to {header.numerics_id}: the frames to "
                "come do not continue those before to the bit",
            )
        self.parts = Parts()
        self.reader = Reader(header)
        self.request.uid = header.uid
        if not self.request.HasField("start_frame"):
            self.request.start_frame = header.start_frame

    def note(self, session: session_pb2.Session) -> None:
        """What the session does, as streams say it only when it changes."""
        self._note(session.state, session.frame)

    def _note(self, state: int, latest_frame: int) -> None:
        moves = (session_pb2.SESSION_STATE_RUNNING, session_pb2.SESSION_STATE_RESTORING)
        if self.ends_with_run:
            self._last = None if state in moves else latest_frame

    @property
    def complete(self) -> bool:
        last = self._last
        return last is not None and bool(self.reader) and self.request.start_frame > last


class View:
    """The newest frame for each credit."""

    def __init__(self, link: Link, request: frame_pb2.ViewFramesRequest):
        self.request = request
        self.attempts = Attempts(link, request, STREAM_PATIENCE)
        self.reader: Reader | None = None
        self.parts = Parts()

    def take(self, message: frame_pb2.ViewFramesResponse) -> Frame | None:
        self.attempts.heard()
        if message.HasField("header"):
            self.reader, self.parts = Reader(message.header), Parts()
            self.request.uid = message.header.uid
        elif message.HasField("frame") and self.reader:
            frame = self.parts.join(message.frame)
            return self.reader.read(frame, message.skipped_count) if frame else None
        return None


class Upload:
    """An asset on its way: asks what there is, then sends what is missing."""

    def __init__(self, link: Link, data: bytes):
        name = "assets/" + hashlib.sha256(data).hexdigest()
        self.first = asset_pb2.UploadAssetRequest(name=name, size_bytes=len(data))
        self.attempts = Attempts(link, self.first)
        self._data = data
        self._received = 0

    def missing(self, asset: asset_pb2.Asset) -> list[asset_pb2.UploadAssetRequest]:
        """What to send; nothing once the asset is whole."""
        if asset.received_bytes > self._received or asset.received_bytes == len(self._data):
            self.attempts.heard()  # it comes on
        self._received = asset.received_bytes
        pieces = [
            asset_pb2.UploadAssetRequest(offset=at, data=self._data[at : at + UPLOAD_MESSAGE])
            for at in range(self._received, len(self._data), UPLOAD_MESSAGE)
        ]
        return pieces and [self.first, *pieces]

    def pause(self, cause: grpc.RpcError) -> float:
        if Refusal(cause).reason == "OFFSET_STALE":
            return 0  # somebody sends the same
        return self.attempts.pause(cause)


def large_meshes(scene: Any) -> Iterator[tuple[str, Any]]:
    """What holds the larger meshes of a weft.v1.Scene, with its path."""
    for i, sheet in enumerate(scene.sheets):
        if sheet.triangles.data.ByteSize() > MOST_INLINE:
            yield f"sheets[{i}].triangles", sheet.triangles
    for i, collider in enumerate(scene.colliders):
        if collider.mesh.data.ByteSize() > MOST_INLINE:
            yield f"colliders[{i}].mesh", collider.mesh


def at(path: str, wrong: InvalidArgument) -> Error:
    """The error of an asset, as one of the scene that holds it."""
    violations = [Violation(f"{path}.{v.field}", v.description) for v in wrong.violations]
    return error(wrong.code, wrong.reason, f"{path}: {wrong.message}", violations, wrong.metadata)


# requests

def session_name(name: str) -> str:
    return name if name.startswith("sessions/") else "sessions/" + name


def create_request(
    scene: Any, session_id: str, validate_only: bool, refused_warnings: Sequence[str]
) -> Any:
    request = session_pb2.CreateSessionRequest(
        session_id=session_id, validate_only=validate_only, refused_warnings=refused_warnings
    )
    request.session.scene.CopyFrom(scene)
    return request


def textile_request(
    name: str, textile: Textile, sheet: str, over: float | None, fields: list[str] | None
) -> Any:
    request = session_pb2.UpdateTextileRequest(name=name, sheet=sheet, duration_s=over)
    request.textile.CopyFrom(textile.to_proto("textile"))
    if fields is not None:
        request.update_mask.paths.extend(fields)
    return request


def actions_request(name: str, actions: tuple[Action, ...]) -> Any:
    return session_pb2.ApplyActionsRequest(
        name=name, actions=[action_proto(each, f"actions[{i}]") for i, each in enumerate(actions)]
    )


def stream_request(
    name: str, start: int | None, end: int | None, hold: bool, format: frame_pb2.FrameFormat
) -> frame_pb2.StreamFramesRequest:
    slow = frame_pb2.SLOW_READER_HOLD_SESSION if hold else frame_pb2.SLOW_READER_DISCONNECT
    return frame_pb2.StreamFramesRequest(
        session=name, start_frame=start, end_frame=end, slow_reader=slow, format=format
    )


def view_request(
    name: str, uid: str, format: frame_pb2.FrameFormat, credits: int
) -> frame_pb2.ViewFramesRequest:
    return frame_pb2.ViewFramesRequest(session=name, uid=uid, format=format, credits=credits)


def test_request(
    test: LabTest,
    textile: Textile,
    bending: BendingLaw | None,
    direction: LabDirection,
    spacings_m: Iterable[float],
    mesh: LabMesh,
) -> lab_pb2.RunTestRequest:
    kind = lab_pb2.RunTestRequest
    request = kind(
        test=enum_number(kind, "test", test),
        textile=textile.to_proto("textile"),
        direction=enum_number(kind, "direction", direction),
        spacings_m=spacings_m,
        mesh=enum_number(kind, "mesh", mesh),
    )
    if bending:
        request.bending.CopyFrom(bending.to_proto("bending"))
    return request


def garment_request(pattern: Pattern, edge_m: float | None) -> garment_pb2.BuildGarmentRequest:
    return garment_pb2.BuildGarmentRequest(pattern=pattern.to_proto("pattern"), edge_m=edge_m)


def garment_scene(
    built: garment_pb2.BuildGarmentResponse,
    bodies: Iterable[Collider],
    textile: Textile,
    deflate_m: float | None,
    accuracy: Accuracy | None,
) -> Scene:
    sheet = Sheet.from_proto(built.sheet)
    if textile.damping_kg_per_s is None and textile.damping_ratio is None:
        textile = dataclasses.replace(textile, damping_kg_per_s=2e-3)  # rests within some seconds
    sheet.name, sheet.textile = "garment", textile
    dressing = Dressing.from_proto(built.dressing)
    dressing.deflate_m = deflate_m
    return Scene([sheet], list(bodies), solver=SolverSettings(accuracy=accuracy),
                 cloth_contact=True, dressing=dressing)


def frames_within(scene: Any, time_s: float) -> int:
    return math.ceil(time_s / scene.solver.frame_step_s)


def mesh_of(name: str, data: bytes) -> MeshData:
    if "assets/" + hashlib.sha256(data).hexdigest() != name:
        raise error("DATA_LOSS", "HASH_DIFFERS", f"{name} is not what its name says")
    return MeshData.from_proto(mesh_pb2.MeshData.FromString(data))


def textile_name(name: str) -> str:
    return name if name.startswith("textiles/") else "textiles/" + name


def mesh_data(mesh: MeshData) -> bytes:
    return cast(bytes, mesh.to_proto().SerializeToString(deterministic=True))


# where a server is, and who calls

def credentials(
    address: str | None,
    token: str | None,
    tls_ca: str | None,
    tls_cert: str | None,
    tls_key: str | None,
) -> tuple[str, str | None, grpc.ChannelCredentials | None]:
    """Address, token and what TLS needs; what is None comes from the environment, as weft's does."""
    def given(value: str | None, name: str) -> str | None:
        return value if value is not None else os.environ.get(name) or None

    address = given(address, "WEFT_SERVER") or DEFAULT_SERVER
    ca, cert = given(tls_ca, "WEFT_TLS_CA"), given(tls_cert, "WEFT_TLS_CERT")
    key = given(tls_key, "WEFT_TLS_KEY")
    if token is None and os.environ.get("WEFT_TOKEN_FILE"):
        token = pathlib.Path(os.environ["WEFT_TOKEN_FILE"]).read_text().strip()
    token = given(token, "WEFT_TOKEN")
    host = address.rsplit(":", 1)[0]
    local = address.startswith("unix:") or re.fullmatch(r"localhost|\[::1\]|127\.[0-9.]*", host)
    if token and not ca and not local:
        text = f"a token would leave this machine unencrypted for {address}; give tls_ca"
        raise error("INVALID_ARGUMENT", "USAGE", text)
    if not ca:
        if cert or key:
            raise error("INVALID_ARGUMENT", "USAGE", "tls_cert and tls_key need tls_ca")
        return address, token, None

    def read(path: str | None) -> bytes | None:
        return pathlib.Path(path).read_bytes() if path else None

    return address, token, grpc.ssl_channel_credentials(read(ca), read(key), read(cert))
