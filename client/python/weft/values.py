"""Dataclasses of the same fields as messages of weft.v1, and the way from one to the other.

A oneof is a single field, which holds one of its members.
"""
from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Iterator, TypeVar, cast

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from .errors import Error, invalid

V = TypeVar("V", bound="Value")
VECTORS = {"weft.v1.Vector3": "xyz", "weft.v1.Rotation": "wxyz"}  # are sequences of numbers


class Value:
    """What every dataclass of this package is."""

    message: ClassVar[type[Message]]
    oneofs: ClassVar[dict[str, str]] = {}  # by field, where that has not the oneof's own name

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self.to_proto() == cast(Value, other).to_proto()

    __hash__ = None  # type: ignore[assignment]

    def to_proto(self, path: str = "") -> Any:
        """The message. What cannot stand in one is InvalidArgument with its path; bounds are
        the server's to check."""
        to = self.message()
        for field in dataclasses.fields(cast(Any, self)):
            value = getattr(self, field.name)
            if value is None:
                continue
            try:
                target = _target(to, self.oneofs.get(field.name, field.name), value)
                _put(to, target, value, f"{path}.{target.name}" if path else target.name)
            except (TypeError, ValueError) as wrong:
                if isinstance(wrong, Error):
                    raise
                raise invalid(f"{path}.{field.name}" if path else field.name, str(wrong)) from None
        return to

    @classmethod
    def from_proto(cls: type[V], message: Any) -> V:
        """The value of a message; what is absent is None."""
        values = {}
        for field in dataclasses.fields(cast(Any, cls)):
            name = cls.oneofs.get(field.name, field.name)
            if name in message.DESCRIPTOR.oneofs_by_name:
                name = message.WhichOneof(name)
            values[field.name] = name and _get(message, message.DESCRIPTOR.fields_by_name[name])
        return cls(**values)


def kinds() -> Iterator[type[Value]]:
    """Every kind of value there is."""
    return iter(Value.__subclasses__())


def _target(message: Message, name: str, value: object) -> FieldDescriptor:
    """The field that takes the value: of a oneof the member of its type."""
    oneof = message.DESCRIPTOR.oneofs_by_name.get(name)
    if oneof is None:
        field = message.DESCRIPTOR.fields_by_name[name]
        group = field.containing_oneof
        given = group and message.WhichOneof(group.name)
        if given and len(group.fields) > 1:
            raise ValueError(f"{given} is given, too")
        return field
    for member in oneof.fields:
        takes = member.message_type
        if takes is None and isinstance(value, str):
            return member
        if takes and isinstance(value, Value) and takes == value.message.DESCRIPTOR:
            return member
    raise TypeError(f"{value!r} is none of {', '.join(member.name for member in oneof.fields)}")


def _put(message: Any, field: FieldDescriptor, value: Any, path: str) -> None:
    to = getattr(message, field.name)
    if field.label == FieldDescriptor.LABEL_REPEATED:
        if field.message_type is None:
            to.extend(np.ravel(np.asarray(value)).tolist())
        else:
            to.extend(_message(field, each, f"{path}[{i}]") for i, each in enumerate(value))
    elif field.message_type is None and field.enum_type is None:
        setattr(message, field.name, value.item() if isinstance(value, np.generic) else value)
    elif field.message_type is None:
        setattr(message, field.name, _number(field, value))
    elif field.message_type.full_name in VECTORS:
        letters = VECTORS[field.message_type.full_name]
        numbers = np.asarray(value, dtype=float)
        if numbers.shape != (len(letters),):
            raise invalid(path, f"{value!r} is not {', '.join(letters)}")
        to.SetInParent()
        for letter, number in zip(letters, numbers):
            setattr(to, letter, number)
    else:
        to.CopyFrom(_message(field, value, path))


def _message(field: FieldDescriptor, value: Any, path: str) -> Message:
    if not isinstance(value, Value) or value.message.DESCRIPTOR != field.message_type:
        raise invalid(path, f"{value!r} is no {field.message_type.name}")
    return cast(Message, value.to_proto(path))


def _get(message: Any, field: FieldDescriptor) -> Any:
    value = getattr(message, field.name)
    if field.label == FieldDescriptor.LABEL_REPEATED:
        if field.message_type is None:
            return list(value)
        return [_value(field, each) for each in value]
    if field.has_presence and not message.HasField(field.name):
        return None
    if field.message_type is not None:
        return _value(field, value)
    if field.enum_type is not None:
        return field.enum_type.values_by_number[value].name[len(_prefix(field)):] if value else None
    return value


def _value(field: FieldDescriptor, message: Any) -> Any:
    name = field.message_type.full_name
    if name in VECTORS:
        return tuple(getattr(message, letter) for letter in VECTORS[name])
    kind = next(kind for kind in kinds() if kind.message.DESCRIPTOR.full_name == name)
    return kind.from_proto(message)


def _prefix(field: FieldDescriptor) -> str:
    """"ACCURACY_" of Accuracy."""
    return cast(str, field.enum_type.values[0].name[: -len("UNSPECIFIED")])


def _number(field: FieldDescriptor, name: str) -> int:
    found = field.enum_type.values_by_name.get(_prefix(field) + str(name))
    if found is None or found.number == 0:
        names = [each.name[len(_prefix(field)):] for each in field.enum_type.values[1:]]
        raise ValueError(f"{name!r} is none of {', '.join(names)}")
    return cast(int, found.number)


def enum_number(message: type[Message], field: str, name: str) -> Any:
    """The number of a value of an enum, "DRAPE" of LabTest."""
    try:
        return _number(message.DESCRIPTOR.fields_by_name[field], name)
    except ValueError as wrong:
        raise invalid(field, str(wrong)) from None


def planes(array: Any, columns: int, kind: str, path: str) -> bytes:
    """Bytes of an (n, columns) array, column after column."""
    return cast(bytes, _rows(array, columns, kind, path).T.tobytes())


def row_bytes(array: Any, columns: int, kind: str, path: str) -> bytes:
    """Bytes of an (n, columns) array, row after row."""
    return cast(bytes, _rows(array, columns, kind, path).tobytes())


def _rows(array: Any, columns: int, kind: str, path: str) -> Any:
    given = np.asarray(array)
    if given.ndim != 2 or given.shape[1] != columns:
        raise invalid(path, f"has the shape {given.shape}, not (n, {columns})")
    if np.dtype(kind).kind == "u":
        if given.dtype.kind not in "iu" or given.size and given.min() < 0:
            raise invalid(path, "has other values than indices, 0 or more")
    return np.ascontiguousarray(given, dtype=kind)
