"""Weft in Blender: cloth of scenes, computed by a Weft server, as point caches of Blender's own."""
bl_info = {
    "name": "Weft",
    "author": "The Weft authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Physics > Weft",
    "description": "Cloth of measured fabrics, computed by a Weft server into a point cache",
    "category": "Physics",
}


def register():
    from . import ui  # the modules without Blender are of use without it

    ui.register()


def unregister():
    from . import ui

    ui.unregister()
