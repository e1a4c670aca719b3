"""Scenes of the tests in Blender, and what they show."""
import os
import pathlib

import bpy
import numpy as np

FOLDER = pathlib.Path(os.environ["FOLDER"])


def install():
    bpy.ops.preferences.addon_install(filepath=os.environ["ADDON"])
    bpy.ops.preferences.addon_enable(module="weft_blender")


def empty():
    """A file without objects, in the units of Blender."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    install()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 30
    return scene


def cloth(name="Cloth", size=1, count=11, **fields):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=count - 1, y_subdivisions=count - 1, size=size)
    return _named(name, kind="CLOTH", **fields)


def ball(name="Ball", radius=0.3):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=32, ring_count=16)
    return _named(name, kind="BODY")


def _named(name, **fields):
    thing = bpy.context.object
    thing.name = name
    for field, value in fields.items():
        setattr(thing.weft, field, value)
    return thing


def pin(thing, *vertices):
    group = thing.vertex_groups.new(name="Pins")
    group.add(vertices, 1, "REPLACE")
    thing.weft.pin_group = "Pins"


def open_up(thing, face):
    """Takes a face away; its vertices."""
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    hole = sorted(thing.data.polygons[face].vertices)
    thing.data.polygons[face].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="ONLY_FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    return hole


def look(thing, frame=None):
    """Where Blender shows its vertices, (n, 3), in the world, units of Blender."""
    if frame is not None:
        bpy.context.scene.frame_set(frame)
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(shown.matrix_world)
    points = np.array([vertex.co for vertex in shown.data.vertices], float)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def simulate(expect={"FINISHED"}):
    assert bpy.ops.weft.simulate() == expect


def refusal():
    """What a person reads."""
    try:
        bpy.ops.weft.simulate()
    except RuntimeError as wrong:
        return str(wrong)
    raise AssertionError("it is not refused")
