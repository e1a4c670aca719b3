"""Runs in a Blender that has never heard of Weft: a baked file plays, also elsewhere."""
import os
import pathlib

import bpy
import numpy as np

folder = pathlib.Path(os.environ["FOLDER"])
elsewhere = (folder / "kept").rename(folder / "moved")
bpy.ops.wm.open_mainfile(filepath=str(elsewhere / "drape.blend"))
thing = bpy.data.objects["Scarf"]
assert not hasattr(thing, "weft")
for frame, wanted in enumerate(np.load(folder / "truth.npy"), 1):
    bpy.context.scene.frame_set(frame)
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    points = np.array([vertex.co for vertex in shown.vertices]) + thing.location
    np.testing.assert_allclose(points, wanted, atol=1e-6)
print("a baked file plays without Weft")
