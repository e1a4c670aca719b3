"""Runs in Blender: what its cloth makes of the scene in FOLDER/order.json, with self-collision.

Writes FOLDER/times.json, processor s of each frame, and FOLDER/positions, float32 (frames, vertices, 3), m.
"""
import json
import pathlib
import struct
import sys
import time

import bpy

# Of Blender's cloth, measured on strips that fall and hang: a frame takes sqrt(0.001) s of its time whatever
# the frame rate; a stretch stiffness of 1 on edges of length h is E = 1150 / h N/m, and a shear stiffness alike.
FRAME_S = 0.001 ** 0.5
UNIT_N = 1150
BENDING = 5e-5  # about 1e-5 N m

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
order = json.loads((folder / "order.json").read_text())
last = order["frames"] + 1  # Blender begins with frame 1
scene = bpy.context.scene
scene.frame_start, scene.frame_end = 1, last
scene.gravity = order["gravity"]
for each in list(bpy.data.objects):
    bpy.data.objects.remove(each)


def add_object(name, vertices, triangles):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], triangles)
    added = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(added)
    return added


def lead(cloth):
    """Pinned vertices follow the mesh that a point cache moves."""
    places = [list(order["vertices"]) for _ in range(last)]
    for pin in order["pins"]:
        for frame in range(last):
            places[frame][pin["vertex"]] = pin["places"][frame]
    path = folder / "pins.pc2"
    with path.open("wb") as file:
        file.write(struct.pack("<12siiffi", b"POINTCACHE2", 1, len(order["vertices"]), 1, 1, last))
        for frame in places:
            for place in frame:
                file.write(struct.pack("<3f", *place))
    cache = cloth.modifiers.new("pins", "MESH_CACHE")
    cache.cache_format = "PC2"
    cache.filepath = str(path)
    cache.frame_start = 1
    group = cloth.vertex_groups.new(name="pins")
    group.add([pin["vertex"] for pin in order["pins"]], 1, "REPLACE")


for number, body in enumerate(order["bodies"]):
    solid = add_object(f"body {number}", body["vertices"], body["triangles"])
    for frame, place in enumerate(body["places"], 1):
        solid.location = place
        solid.keyframe_insert("location", frame=frame)
    for curve in solid.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    solid.modifiers.new("collision", "COLLISION")
    solid.collision.thickness_outer = 0.001

cloth = add_object("cloth", order["vertices"], order["triangles"])
cloth.shape_key_add(name="start", from_mix=False)
rest = cloth.shape_key_add(name="rest", from_mix=False)
for vertex, place in zip(rest.data, order["rest"]):
    vertex.co = place
if order["pins"]:
    lead(cloth)
modifier = cloth.modifiers.new("cloth", "CLOTH")
settings, contact = modifier.settings, modifier.collision_settings
settings.rest_shape_key = rest
settings.time_scale = order["frame_step"] / FRAME_S
settings.mass = order["density"] * order["spacing"] ** 2
settings.tension_stiffness = settings.compression_stiffness = order["stretch"] * order["spacing"] / UNIT_N
settings.shear_stiffness = order["shear"] * order["spacing"] / UNIT_N
settings.bending_stiffness = BENDING
if order["pins"]:
    settings.vertex_group_mass = "pins"
contact.use_self_collision = True
contact.self_distance_min = max(0.001, order["thickness"])
contact.distance_min = 0.001
modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, last

times = []
with (folder / "positions").open("wb") as file:
    scene.frame_set(1)
    for frame in range(2, last + 1):
        begin = time.process_time()
        scene.frame_set(frame)
        times.append(time.process_time() - begin)
        vertices = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
        values = [0.0] * (3 * len(vertices))
        vertices.foreach_get("co", values)
        file.write(struct.pack(f"<{len(values)}f", *values))
(folder / "times.json").write_text(json.dumps(times))
