"""What a server refuses, as the objects and vertices that are meant."""
from __future__ import annotations

import re
from typing import Any

import weft

from .scene import Prepared
from .surface import Refused

_EDGE = re.compile(r"between (?:particles|vertices) (\d+) and (\d+)")
_NUMBERS = re.compile(r"(triangle|particle|vertex|point)s? (\d+)(?: and (\d+))?")


def explain(wrong: weft.Error, prepared: Prepared) -> Refused:
    """The error in the words of who looks at objects, all vertices of the first one's errors."""
    first = ""
    vertices: set[int] = set()
    texts: list[str] = []
    for each in wrong.violations:
        name, text, found = _one(each, prepared)
        if not texts:
            first = name
        if name == first:
            vertices |= found
        texts.append(text if name == first or not name else f"{name}: {text}")
    if not texts:
        return Refused(wrong.message)
    more = f" (1 of {len(texts)} problems)" if len(texts) > 1 else ""
    return Refused(texts[0] + more, first, sorted(vertices))


def note_of(warning: Any, prepared: Prepared) -> str:
    """A weft.v1.Warning as a sentence about an object."""
    name, _, _ = _place(warning.field, prepared)
    return f"{name + ': ' if name else ''}{warning.message} ({warning.code})"


def _place(field: str, prepared: Prepared) -> tuple[str, int | None, str]:
    """The object that a path of a scene speaks of, its sheet if it is cloth, and the rest."""
    found = re.fullmatch(r"(sheets|colliders)\[(\d+)\]\.?(.*)", field)
    if not found:
        return "", None, field
    index = int(found[2])
    if found[1] == "sheets":
        return list(prepared.cloths.values())[index].name, index, found[3]
    return prepared.bodies[index].name, None, found[3]


def _one(each: weft.Violation, prepared: Prepared) -> tuple[str, str, set[int]]:
    """Object, text and vertices of a violation."""
    name, sheet, rest = _place(each.field, prepared)
    pin = re.fullmatch(r"pins\[(\d+)\]\.particles\[(\d+)\]", rest)
    if pin and sheet is not None:
        particles = prepared.scene.sheets[sheet].pins[int(pin[1])].particles
        return name, each.description, {particles[int(pin[2])]}
    part = rest.rsplit(".", 1)[-1]
    if not name or part not in ("positions_m", "triangles", "flat_m", "flat_triangles"):
        return name, f"{rest}: {each.description}" if rest else each.description, set()

    edge = _EDGE.search(each.description)
    if edge:
        return name, each.description, {int(edge[1]), int(edge[2])}
    surface = prepared.surface(name)
    vertices: set[int] = set()
    for word, *numbers in _NUMBERS.findall(each.description):
        for number in (int(n) for n in numbers if n):
            if word == "triangle":
                vertices |= set(surface.triangles[number].tolist())
            elif part == "flat_m" and sheet is not None:  # a corner of the flat shape
                at = prepared.flats[sheet].triangles == number
                vertices |= set(surface.triangles[at].tolist())
            else:
                vertices.add(number)
    return name, each.description, vertices
