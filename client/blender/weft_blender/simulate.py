"""The simulation of a scene, from its objects to the caches that they show."""
from __future__ import annotations

import os
import pathlib
import shutil

import bpy

from .reading import add_modifier, cache_file, cache_folder, modifier_of, objects, read
from .run import Run, Target
from .scene import prepare
from .servers import Servers
from .surface import Refused

SERVERS = Servers()


class Simulation:
    """A run, and the scene that shows it."""

    def __init__(self, context):
        """Reads the scene and begins; Refused where it cannot be one."""
        scene = context.scene
        world, cloths, bodies, to_object, notes = read(context)
        prepared = prepare(world, cloths, bodies)
        prepared.notes[:0] = notes
        targets = {
            sheet: Target(cache_file(scene, sheet), to)
            for sheet, to in zip(prepared.cloths, to_object)
        }
        self._files = {prepared.cloths[sheet].name: each.path for sheet, each in targets.items()}
        self._scene = scene.name
        self._first, self._playhead = scene.frame_start, scene.frame_current
        self._shown = -1
        self.run = Run(server_of(context), prepared, targets, scene.frame_end - scene.frame_start)

    def show(self) -> bool:
        """Has objects show what there is by now; whether that is more than before. The playhead
        goes along with the newest frame until somebody moves it."""
        scene = bpy.data.scenes.get(self._scene)
        newest = self.run.newest
        if newest == self._shown or not scene:
            return False
        things = [bpy.data.objects.get(name) for name in self._files]
        if self._shown < 0:
            for thing, path in zip(things, self._files.values()):
                if thing:
                    _show_cache(thing, path, self._first)
        self._shown = newest
        for thing in filter(None, things):
            thing.update_tag()
        if scene.frame_current == self._playhead and not _plays():
            self._playhead = self._first + newest
            scene.frame_set(self._playhead)
        return True


simulation: Simulation | None = None


def server_of(context):
    """A function that gives the server of the preferences, to be called by any thread."""
    own = context.preferences.addons[__package__].preferences
    words = own.address.strip(), bpy.path.abspath(own.token_file), bpy.path.abspath(own.tls_ca)
    return lambda: SERVERS.get(*words)


def begin(context) -> Simulation:
    """Begins to simulate."""
    global simulation
    simulation = Simulation(context)
    return simulation


def end() -> None:
    """Ends what runs, for good."""
    global simulation
    if simulation:
        simulation.run.cancel()
        simulation.run.join()
    simulation = None
    SERVERS.close()


def running() -> bool:
    return simulation is not None and simulation.run.running


def _plays() -> bool:
    windows = bpy.context.window_manager.windows
    return any(each.screen.is_animation_playing for each in windows)


def _show_cache(thing, path: pathlib.Path, first_frame: int) -> None:
    modifier = add_modifier(thing)
    modifier.cache_format = "PC2"
    modifier.filepath = path_of(path)
    modifier.frame_start = first_frame
    modifier.show_viewport = modifier.show_render = True


def path_of(path: pathlib.Path) -> str:
    """Relative to the file where it has been saved."""
    try:
        return bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)
    except ValueError:  # on another drive
        return str(path)


def passing(context) -> list[bpy.types.Object]:
    """Cloth whose frames end with Blender."""
    shown = [each for kind in objects(context, "CLOTH") for each in kind if modifier_of(each)]
    return [each for each in shown if pathlib.Path(bpy.app.tempdir) in _file_of(each).parents]


def _file_of(thing) -> pathlib.Path:
    """The point cache that it shows."""
    return pathlib.Path(os.path.normpath(bpy.path.abspath(modifier_of(thing).filepath)))


def bake(context) -> pathlib.Path:
    """Copies passing caches beside the file; the folder."""
    if not bpy.data.filepath:
        raise Refused("Save the file first: its caches are kept beside it")
    folder = cache_folder(context.scene)
    folder.mkdir(parents=True, exist_ok=True)
    for thing in passing(context):
        path = _file_of(thing)
        kept = shutil.copy(path, folder / path.name)
        modifier_of(thing).filepath = path_of(pathlib.Path(kept))
    return folder


def select(refused: Refused, context) -> bool:
    """Selects the vertices meant, in edit mode; whether there are any that one can see."""
    thing = bpy.data.objects.get(refused.name)
    if not thing or not refused.vertices or not thing.visible_get():
        return False
    if max(refused.vertices) >= len(thing.data.vertices):
        return False  # made by modifiers
    if context.object and context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for each in context.selected_objects:
        each.select_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing
    mesh = thing.data
    for part in (mesh.polygons, mesh.edges, mesh.vertices):
        part.foreach_set("select", [False] * len(part))
    for i in refused.vertices:
        mesh.vertices[i].select = True
    context.tool_settings.mesh_select_mode = (True, False, False)
    bpy.ops.object.mode_set(mode="EDIT")
    return True
