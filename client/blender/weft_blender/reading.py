"""Blender's objects as cloth, bodies and what acts on them."""
from __future__ import annotations

import contextlib
import pathlib

import bpy
import numpy as np

from .scene import Body, Cloth, World
from .surface import Refused, Surface

MODIFIER = "Weft"
HELD = 0.5  # least weight of a vertex that is held
_SHELLS = ("SOLIDIFY", "SUBSURF", "MULTIRES", "DISPLACE", "BEVEL", "WIREFRAME")  # dress the cloth


def objects(context, kind):
    """Those of a kind in the view layer: shown, and hidden."""
    found = [each for each in context.view_layer.objects
             if each.type == "MESH" and each.weft.kind == kind]
    return ([each for each in found if each.visible_get()],
            [each for each in found if not each.visible_get()])


def modifier_of(thing):
    """The modifier that shows its frames, or None."""
    found = thing.modifiers.get(MODIFIER)
    return found if found and found.type == "MESH_CACHE" else None


def add_modifier(thing):
    """The modifier that shows its frames: what comes before it makes the cloth, what comes behind
    it dresses it."""
    found = modifier_of(thing)
    if not found:
        found = thing.modifiers.new(MODIFIER, "MESH_CACHE")
        at = _place_of_cloth(thing)
        with bpy.context.temp_override(object=thing):
            bpy.ops.object.modifier_move_to_index(modifier=found.name, index=at)
        found = modifier_of(thing)
    return found


def _place_of_cloth(thing):
    others = [each for each in thing.modifiers if each.name != MODIFIER]
    return next((i for i, each in enumerate(others) if each.type in _SHELLS), len(others))


@contextlib.contextmanager
def undressed(things):
    """While it lasts, what is behind cloth in the stack is off, and so are old frames."""
    off = []
    for thing in things:
        own = modifier_of(thing)
        stack = list(thing.modifiers)
        at = stack.index(own) if own else _place_of_cloth(thing)
        off += [each for each in stack[at:] if each.show_viewport]
    for each in off:
        each.show_viewport = False
    try:
        yield
    finally:
        for each in off:
            each.show_viewport = True


@contextlib.contextmanager
def mesh_of(thing):
    """The mesh that its modifiers make of it now."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    try:
        yield mesh
    finally:
        evaluated.to_mesh_clear()


def array(things, attribute, columns, kind):
    """An attribute of all, (n, columns)."""
    values = np.empty(len(things) * columns, kind)
    things.foreach_get(attribute, values)
    return values.reshape(-1, columns)


def points_of(thing, mesh, scale):
    """Vertices in the world, m."""
    matrix = np.array(thing.matrix_world)
    return (array(mesh.vertices, "co", 3, np.float32) @ matrix[:3, :3].T + matrix[:3, 3]) * scale


def surface_of(thing, scale):
    """Its mesh in the world, m."""
    with mesh_of(thing) as mesh:
        mesh.calc_loop_triangles()
        triangles = array(mesh.loop_triangles, "vertices", 3, np.int32)
        corners = array(mesh.loop_triangles, "loops", 3, np.int32)
        layer = mesh.uv_layers.get(thing.weft.uv_map) or mesh.uv_layers.active
        uv = array(layer.data, "uv", 2, np.float32)[corners] if layer and len(layer.data) else None
        upright = np.array(thing.matrix_world)[:3, 1:3].T
        return Surface(points_of(thing, mesh, scale), triangles, uv, upright)


def held(thing):
    """Vertices of the group that pins it."""
    name = thing.weft.pin_group
    if not name:
        return []
    group = thing.vertex_groups.get(name)
    if not group:
        raise Refused(f'has no vertex group "{name}"', thing.name)
    with mesh_of(thing) as mesh:
        return [
            vertex.index for vertex in mesh.vertices
            if any(each.group == group.index and each.weight >= HELD for each in vertex.groups)
        ]


def may_move(thing):
    """Whether its vertices may be elsewhere in another frame. A guess that is never wrong on no."""
    while thing:
        data = thing.data if thing.type == "MESH" else None
        keys = data.shape_keys if data else None
        own = modifier_of(thing)
        if (thing.animation_data or thing.constraints or thing.rigid_body or keys
                or any(each != own and each.show_viewport for each in thing.modifiers)
                or data and data.animation_data):
            return True
        thing = thing.parent
    return False


def wind_of(context):
    """The wind of all wind fields, m/s: each blows along its z with its strength as a speed."""
    winds = [each for each in context.view_layer.objects
             if each.visible_get() and each.field and each.field.type == "WIND"]
    if not winds:
        return None
    along = [np.array(each.matrix_world)[:3, 2] for each in winds]
    return sum(z / np.linalg.norm(z) * each.field.strength for z, each in zip(along, winds))


def read(context):
    """World, cloths and bodies of a scene, how each cloth's points come back to it, and notes."""
    scene = context.scene
    scale = scene.unit_settings.scale_length
    cloth, hidden_cloth = objects(context, "CLOTH")
    bodies, hidden_bodies = objects(context, "BODY")
    notes = [f"{each.name}: is hidden, and left out" for each in hidden_cloth + hidden_bodies]
    for thing in cloth + bodies:
        if thing.mode == "EDIT":
            thing.update_from_editmode()

    before = scene.frame_current_final
    try:
        with undressed(cloth):
            scene.frame_set(scene.frame_start)
            world = _world(context, scale)
            made = [_cloth(each, scale) for each in cloth]
            solid = [Body(each.name, surface_of(each, scale), None, each.weft.friction)
                     for each in bodies]
            matrices = _follow(scene, scale, cloth, made, bodies, solid)
    finally:
        scene.frame_set(int(before), subframe=before % 1)
    return world, made, solid, [_to_object(each, matrices[each], scale) for each in cloth], notes


def _world(context, scale):
    scene = context.scene
    return World(
        frame_step_s=scene.render.fps_base / scene.render.fps,
        first_frame=scene.frame_start,
        gravity_m_per_s2=tuple(scene.gravity) if scene.use_gravity else (0, 0, 0),
        wind_m_per_s=wind_of(context),
        accuracy=scene.weft.accuracy,
        cloth_contact=scene.weft.cloth_contact,
    )


def _cloth(thing, scale):
    own = thing.weft
    return Cloth(
        thing.name,
        surface_of(thing, scale),
        own.textile,
        held(thing),
        flat=own.flat,
        m_per_unit=own.m_per_unit * scale or None,
        friction=own.friction,
        thickness_m=own.thickness * scale or None,
        keep_length=own.keep_length,
    )


def _follow(scene, scale, cloth, made, bodies, solid):
    """Goes through the frames where anything may move, and notes where; matrices of each cloth."""
    matrices = {each: [np.array(each.matrix_world)] for each in cloth}
    led = [(thing, each) for thing, each in zip(cloth, made) if may_move(thing)]
    moving = [(thing, each) for thing, each in zip(bodies, solid) if may_move(thing)]
    if not led and not moving:
        return matrices
    paths = [[each.surface.points] for _, each in led + moving]
    for frame in range(scene.frame_start + 1, scene.frame_end + 1):
        scene.frame_set(frame)
        for (thing, each), path in zip(led + moving, paths):
            with mesh_of(thing) as mesh:
                if len(mesh.vertices) != len(each.surface.points):
                    text = (f"has {len(mesh.vertices)} vertices in frame {frame}, "
                            f"{len(each.surface.points)} in frame {scene.frame_start}")
                    raise Refused(text, thing.name)
                points = points_of(thing, mesh, scale)
                path.append(points[each.pinned] if isinstance(each, Cloth) else points)
            if isinstance(each, Cloth):
                matrices[thing].append(np.array(thing.matrix_world))
    for (_, each), path in zip(led + moving, paths):
        if isinstance(each, Cloth):
            path[0] = path[0][each.pinned]
            each.paths = np.array(path)
        elif any((points != path[0]).any() for points in path):
            each.moves = np.array(path)
    return matrices


def _to_object(thing, matrices, scale):
    """(1 or frames, 4, 4), from the world, m, to an object's own coordinates."""
    try:
        to = np.linalg.inv(np.array(matrices, float))
    except np.linalg.LinAlgError:
        raise Refused("has a scale of 0", thing.name) from None
    to[:, :3, :3] /= scale
    return to


def cache_folder(scene):
    """Where frames are kept: beside the file, or with Blender's own passing ones while it has not
    been saved."""
    if not bpy.data.filepath:
        return pathlib.Path(bpy.app.tempdir)
    if scene.weft.folder:
        return pathlib.Path(bpy.path.abspath(scene.weft.folder))
    file = pathlib.Path(bpy.data.filepath)
    return file.with_name(f"weft_{file.stem}")


def cache_file(scene, sheet):
    """The point cache of a sheet."""
    return cache_folder(scene) / f"{bpy.path.clean_name(scene.name)}-{sheet}.pc2"
