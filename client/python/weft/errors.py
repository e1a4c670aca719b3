"""What goes wrong, as exceptions."""
from __future__ import annotations

import pathlib
from typing import Any, Iterable, NamedTuple

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory


class Violation(NamedTuple):
    """A bad field: its path, and what is wrong with its value."""

    field: str
    description: str


class Error(Exception):
    """What a server refused, or what cannot be done.

    `code` is gRPC's ("NOT_FOUND"); `reason` is what a program should look at
    ("SESSION_NOT_FOUND"); `violations` name every bad field with its value and bounds,
    `metadata` has what else the server says of the reason.
    """

    def __init__(
        self,
        code: str,
        reason: str,
        message: str,
        violations: Iterable[Violation] = (),
        metadata: dict[str, str] | None = None,
    ):
        self.code = code
        self.reason = reason
        self.message = message
        self.violations = tuple(violations)
        self.metadata = metadata or {}
        super().__init__(message)

    def __str__(self) -> str:
        if len(self.violations) < 2:
            return self.message
        lines = (f"  {each.field}  {each.description}" for each in self.violations)
        return "\n".join([self.message, *lines])


class InvalidArgument(Error, ValueError):
    """A value that no server takes."""


class NotFound(Error, LookupError):
    """There is no such thing, or no longer."""


class NoConnection(Error, ConnectionError):
    """The server cannot be reached."""


class Damaged(Error):
    """A recording is not as it was written."""


_KINDS: dict[str, type[Error]] = {
    "INVALID_ARGUMENT": InvalidArgument,
    "NOT_FOUND": NotFound,
    "UNAVAILABLE": NoConnection,
    "DATA_LOSS": Damaged,
}


def error(
    code: str,
    reason: str,
    message: str,
    violations: Iterable[Violation] = (),
    metadata: dict[str, str] | None = None,
) -> Error:
    return _KINDS.get(code, Error)(code, reason, message, violations, metadata)


def invalid(field: str, description: str) -> Error:
    message = f"{field}: {description}" if field else description
    return error("INVALID_ARGUMENT", "FIELD_INVALID", message, [Violation(field, description)])


# google.rpc in a pool of its own: other packages bring these files too
_pool = descriptor_pool.DescriptorPool()
for _file in descriptor_pb2.FileDescriptorSet.FromString(
    pathlib.Path(__file__).with_name("rpc.desc").read_bytes()
).file:
    _pool.AddSerializedFile(_file.SerializeToString())


def _message(name: str) -> Any:
    descriptor = _pool.FindMessageTypeByName("google.rpc." + name)
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory(_pool).GetPrototype(descriptor)


_Status, _ErrorInfo, _BadRequest = _message("Status"), _message("ErrorInfo"), _message("BadRequest")


class Refusal:
    """How a call ended: gRPC's code and text, and what weftd says of it, if it was weftd."""

    def __init__(self, cause: grpc.RpcError):
        self.code: str = cause.code().name
        self.text: str = cause.details() or ""
        self.reason = ""
        self.metadata: dict[str, str] = {}
        self.violations: list[Violation] = []
        for key, value in cause.trailing_metadata() or ():
            if key == "grpc-status-details-bin":
                self._read(value)

    def _read(self, details: bytes) -> None:
        for detail in _Status.FromString(details).details:
            kind = detail.type_url.rsplit("/", 1)[-1]
            if kind == "google.rpc.ErrorInfo":
                info = _ErrorInfo.FromString(detail.value)
                self.reason, self.metadata = info.reason, dict(info.metadata)
            elif kind == "google.rpc.BadRequest":
                self.violations = [
                    Violation(place_in_scene(each.field), each.description)
                    for each in _BadRequest.FromString(detail.value).field_violations
                ]

    @property
    def is_weftd(self) -> bool:
        return self.reason != ""

    def as_error(self, address: str) -> Error:
        if not self.is_weftd and self.code == "UNAVAILABLE":
            cause = self.text.rsplit(": ", 1)[-1]
            return NoConnection(self.code, "NO_CONNECTION", f"no connection to {address} ({cause})")
        if not self.is_weftd and self.code == "UNIMPLEMENTED":
            text = "the server has no such method; is it a replay, or of another version?"
            return Error(self.code, "", text)
        text = self.text.replace(_IN_REQUEST, "")
        return error(self.code, self.reason, text, self.violations, self.metadata)


_IN_REQUEST = "session.scene."


def place_in_scene(field: str) -> str:
    """"sheets[0].grid" of "session.scene.sheets[0].grid"."""
    return field[len(_IN_REQUEST):] if field.startswith(_IN_REQUEST) else field
