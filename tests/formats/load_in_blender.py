"""Within Blender: loads meshes with point caches, and an animation, and compares every vertex of every
frame with FOLDER/NAME.json. Prints RESULT, what, version, largest difference in m."""
import json
import pathlib
import sys

import bpy
import numpy

folder, *sheets = sys.argv[sys.argv.index("--") + 1:]
folder = pathlib.Path(folder)


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 60


def compare(what, thing, truth, place):
    off = 0
    for frame, wanted in enumerate(truth):
        bpy.context.scene.frame_set(frame)
        mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        assert len(mesh.vertices) == len(wanted), f"{what}: {len(mesh.vertices)} vertices"
        for vertex, point in zip(mesh.vertices, wanted):
            off = max(off, *(abs(a - b) for a, b in zip(place(vertex.co), point)))
    print("RESULT", what, bpy.app.version_string, off, sep="\t")


for sheet in sheets:
    truth = json.loads((folder / f"{sheet}.json").read_text())
    for kind in ("PC2", "MDD"):
        empty()
        bpy.ops.wm.obj_import(filepath=str(folder / sheet / "cloth_000000.obj"))
        (thing,) = bpy.context.scene.objects
        assert thing.name == sheet, thing.name
        cache = thing.modifiers.new("cache", "MESH_CACHE")
        cache.cache_format = kind
        cache.filepath = str(folder / f"{sheet}.{kind.lower()}")
        cache.frame_start = 0
        compare(f"obj + {kind.lower()}, {sheet}", thing, truth, lambda point: point)

numpy.bool = bool  # Debian 12's importer wants it, Debian 12's numpy has it no more
# Blender turns glTF's y, which is up, into its own z
empty()
bpy.ops.import_scene.gltf(filepath=str(folder / "a.glb"))
(thing,) = [each for each in bpy.context.scene.objects if each.type == "MESH"]
compare("gltf", thing, json.loads((folder / "a.json").read_text()), lambda p: (p.x, p.z, -p.y))
