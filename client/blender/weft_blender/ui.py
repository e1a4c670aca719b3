"""What Weft adds to Blender: properties, the panel in the Physics tab, operators, preferences."""
import textwrap

import bpy
from bpy.app.handlers import persistent
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    PointerProperty,
    StringProperty,
)

_INTERVAL = 0.1  # s, between looks at a simulation


def _work():
    """The module that simulates; ImportError where the Python package weft is not there."""
    from . import simulate

    return simulate


def _missing():
    """What is not installed, or ""."""
    try:
        _work()
    except ImportError as wrong:
        return str(wrong)
    return ""


# properties

def _find_textiles(_, context, text):
    try:
        work = _work()
    except ImportError:
        return []
    return [each for each in work.SERVERS.textiles(work.server_of(context))
            if text.lower() in " ".join(each).lower()]


def _changed_kind(own, context):
    if own.kind == "CLOTH":
        _find_textiles(own, context, "")  # so that they are known when they are looked for


def _changed_textile(own, _):
    if not _missing() and _work().running():
        _work().simulation.run.set_textile(own.id_data.name, own.textile)


class WeftObject(bpy.types.PropertyGroup):
    kind: EnumProperty(
        name="Type",
        items=[
            ("NONE", "None", "Weft does not know it"),
            ("CLOTH", "Cloth", "It is cloth"),
            ("BODY", "Collision", "Cloth does not enter it: a closed mesh, or a flat one, which is "
             "a floor without end"),
        ],
        update=_changed_kind,
    )
    textile: StringProperty(
        name="Fabric",
        description="A preset of the server. Changed while it simulates, it holds from the next "
        "frame on",
        default="cotton_poplin",
        search=_find_textiles,
        update=_changed_textile,
    )
    pin_group: StringProperty(
        name="Pin Group",
        description="Vertices that are held, those with a weight of 0.5 or more; they go where the "
        "object, its parents and the modifiers before Weft lead them",
    )
    flat: EnumProperty(
        name="Flat Shape",
        description="How the cloth was cut",
        items=[
            ("AUTO", "Automatic", "As it lies where it lies in a plane, else its UV map"),
            ("UV", "UV Map", "The UV map; the warp runs along V"),
            ("LYING", "As It Lies", "As it lies in the first frame, in a plane; the warp runs "
             "along its own Y, or Z where it stands"),
        ],
    )
    uv_map: StringProperty(name="UV Map", description="The active one if empty")
    m_per_unit: FloatProperty(
        name="UV Unit",
        description="Length of 1 in the UV map; 0: that at which most edges have their length",
        subtype="DISTANCE", unit="LENGTH", min=0, precision=4,
    )
    friction: FloatProperty(
        name="Friction",
        description="Coulomb's coefficient; cloth on a body has the root of both multiplied",
        default=0.3, min=0, max=10, soft_max=1,
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Distance to other cloth and its own folds; 0: 2 mm, or as much as its mesh "
        "allows",
        subtype="DISTANCE", unit="LENGTH", min=0, precision=4,
    )
    keep_length: BoolProperty(
        name="Keep Length",
        description="Tethers to what is pinned, straight ones, keep the cloth from hanging longer "
        "than it is",
    )


class WeftScene(bpy.types.PropertyGroup):
    accuracy: EnumProperty(
        name="Accuracy",
        items=[
            ("DRAFT", "Draft", "Stretches a little more, in about half the time"),
            ("STANDARD", "Standard", "As the fabric is"),
            ("FINE", "Fine", "To compare with: 5 to 10 times the time"),
        ],
        default="STANDARD",
    )
    cloth_contact: BoolProperty(
        name="Cloth on Cloth",
        description="Keeps cloth from passing through itself and other cloth; takes several times "
        "as long where it touches",
    )
    folder: StringProperty(
        name="Cache",
        description='Folder of the point caches; "weft_" and the name of the file beside it if '
        "empty",
        subtype="DIR_PATH",
    )


class WeftPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    address: StringProperty(
        name="Server",
        description="Host and port of a Weft server; if empty, Blender runs one of its own",
    )
    token_file: StringProperty(
        name="Token", description="File of the token that says who calls", subtype="FILE_PATH",
    )
    tls_ca: StringProperty(
        name="Certificates",
        description="File (PEM) of a certificate that signed the server's",
        subtype="FILE_PATH",
    )

    def draw(self, _):
        layout = self.layout
        layout.use_property_split = True
        _say_missing(layout, 90)
        layout.prop(self, "address")
        layout.prop(self, "token_file")
        layout.prop(self, "tls_ca")


# operators

class WEFT_OT_simulate(bpy.types.Operator):
    bl_idname = "weft.simulate"
    bl_label = "Simulate"
    bl_description = "Computes all cloth of the scene, from its first frame to its last, into a " \
                     "point cache"

    @classmethod
    def poll(cls, context):
        missing = _missing()
        if missing:
            cls.poll_message_set(missing)
            return False
        return not _work().running()

    def execute(self, context):
        """Waits for the end, as scripts want it."""
        simulation = self._begin(context)
        if simulation is None:
            return {"CANCELLED"}
        simulation.run.join()
        return self._finish(context, simulation)

    def invoke(self, context, _):
        """Goes on while others work."""
        self._simulation = self._begin(context)
        if self._simulation is None:
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(_INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        simulation = self._simulation
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        for trouble in simulation.run.troubles():
            _pop_up(context, trouble)
        if simulation.run.running:
            if simulation.show():
                _redraw(context)
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(context, simulation)

    def _begin(self, context):
        work = _work()
        try:
            return work.begin(context)
        except work.Refused as refused:
            self._refuse(context, refused)
            return None

    def _finish(self, context, simulation):
        simulation.show()
        _redraw(context)
        run = simulation.run
        if run.lost:
            _work().SERVERS.close()
        if run.refused:
            self._refuse(context, run.refused)
            return {"CANCELLED"}
        for trouble in run.troubles():
            self.report({"ERROR"}, trouble)
        how = "Cancelled" if run.cancelled else "Simulated"
        self.report({"INFO"}, f"{how}: {run.newest + 1} of {run.last + 1} frames")
        return {"FINISHED"}

    def _refuse(self, context, refused):
        selected = _work().select(refused, context)
        chosen = "; its vertices are selected" if selected else ""
        self.report({"ERROR"}, f"{refused}{chosen}")


class WEFT_OT_cancel(bpy.types.Operator):
    bl_idname = "weft.cancel"
    bl_label = "Cancel"
    bl_description = "Ends the simulation; the frames that there are stay"

    @classmethod
    def poll(cls, _):
        return not _missing() and _work().running()

    def execute(self, _):
        _work().simulation.run.cancel()
        return {"FINISHED"}


class WEFT_OT_bake(bpy.types.Operator):
    bl_idname = "weft.bake"
    bl_label = "Bake"
    bl_description = "Keeps the frames beside the file: Blender then plays them, without Weft"

    @classmethod
    def poll(cls, context):
        return not _missing() and not _work().running() and bool(_work().passing(context))

    def execute(self, context):
        work = _work()
        try:
            folder = work.bake(context)
        except (work.Refused, OSError) as wrong:
            self.report({"ERROR"}, str(wrong))
            return {"CANCELLED"}
        self.report({"INFO"}, f"The caches are in {folder}")
        return {"FINISHED"}


def _pop_up(context, text):
    def draw(menu, _):
        _wrap(menu.layout, text, 60)

    context.window_manager.popup_menu(draw, title="Weft", icon="ERROR")


def _redraw(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("PROPERTIES", "VIEW_3D"):
                area.tag_redraw()


# panels

class WEFT_PT_physics(bpy.types.Panel):
    bl_idname = "WEFT_PT_physics"
    bl_label = "Weft"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH"

    def draw(self, context):
        layout, thing = self.layout, context.object
        own = thing.weft
        layout.row().prop(own, "kind", expand=True)
        layout.use_property_split, layout.use_property_decorate = True, False
        if own.kind == "CLOTH":
            self._draw_cloth(layout, thing)
        elif own.kind == "BODY":
            layout.prop(own, "friction")
        if own.kind != "NONE":
            self._draw_scene(layout, context)

    def _draw_cloth(self, layout, thing):
        own = thing.weft
        layout.prop(own, "textile", icon="MATERIAL")
        layout.prop_search(own, "pin_group", thing, "vertex_groups")
        if own.pin_group:
            layout.prop(own, "keep_length")
        layout.prop(own, "flat")
        if own.flat != "LYING":
            layout.prop_search(own, "uv_map", thing.data, "uv_layers", icon="GROUP_UVS")
            layout.prop(own, "m_per_unit")
        layout.prop(own, "friction")
        layout.prop(own, "thickness")

    def _draw_scene(self, layout, context):
        own = context.scene.weft
        layout.separator()
        layout.prop(own, "accuracy")
        layout.prop(own, "cloth_contact")
        layout.prop(own, "folder")
        width = context.region.width // 8
        if _say_missing(layout, width):
            return
        work = _work()
        row = layout.row(align=True)
        row.scale_y = 1.5
        if work.running():
            run = work.simulation.run
            now = f"{run.newest + 1} of {run.last + 1} frames" if run.newest >= 0 else "Planning"
            row.label(text=now)
            row.operator("weft.cancel", icon="CANCEL")
        else:
            row.operator("weft.simulate", icon="PHYSICS")
            row.operator("weft.bake", icon="FILE_TICK")


class WEFT_PT_notes(bpy.types.Panel):
    bl_parent_id = "WEFT_PT_physics"
    bl_label = "Notes"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, _):
        return not _missing() and bool(_work().simulation and _work().simulation.run.notes)

    def draw(self, context):
        for note in _work().simulation.run.notes:
            _wrap(self.layout, note, context.region.width // 8, icon="INFO")


def _say_missing(layout, width):
    missing = _missing()
    if missing:
        _wrap(layout, f"{missing}. Install the Python package weft: python3-weft on Debian, pip "
              "with Blender's own Python elsewhere", width, icon="ERROR")
    return missing


def _wrap(layout, text, width, icon="NONE"):
    column = layout.column(align=True)
    for line in textwrap.wrap(text, max(width, 20)):
        column.label(text=line, icon=icon)
        icon = "BLANK1" if icon != "NONE" else "NONE"


@persistent
def _end(_):
    if not _missing():
        _work().end()


_CLASSES = (
    WeftObject, WeftScene, WeftPreferences, WEFT_OT_simulate, WEFT_OT_cancel, WEFT_OT_bake,
    WEFT_PT_physics, WEFT_PT_notes,
)


def register():
    for each in _CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.weft = PointerProperty(type=WeftObject)
    bpy.types.Scene.weft = PointerProperty(type=WeftScene)
    bpy.app.handlers.load_pre.append(_end)


def unregister():
    bpy.app.handlers.load_pre.remove(_end)
    _end(None)
    del bpy.types.Scene.weft, bpy.types.Object.weft
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)
