"""Runs in Blender with a window: what a person does, step by step, with PICTURES of it."""
import os
import pathlib
import sys
import time
import traceback

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from scenes import ball, cloth, install, look, open_up  # noqa: E402

PICTURES = pathlib.Path(os.environ["PICTURES"])
bpy.context.preferences.view.show_splash = False


def area(kind):
    return next(each for each in bpy.context.window_manager.windows[0].screen.areas
                if each.type == kind)


def within(kind):
    """The context of a mouse over an area."""
    there = area(kind)
    region = next(each for each in there.regions if each.type == "WINDOW")
    window = bpy.context.window_manager.windows[0]
    return bpy.context.temp_override(window=window, area=there, region=region)


def picture(name):
    with within("VIEW_3D"):
        bpy.ops.screen.screenshot(filepath=str(PICTURES / f"{name}.png"))


def person():
    """What is done; each yield waits as many seconds."""
    from weft_blender import simulate as work

    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    with within("VIEW_3D"):
        ball()
        bpy.ops.object.shade_smooth()
        scarf = cloth("Scarf", count=61, textile="wool_tropical")
        bpy.ops.object.shade_smooth()
        scarf.location[2] = 0.35
    scene = bpy.context.scene
    scene.frame_end = 240
    area("PROPERTIES").spaces[0].context = "PHYSICS"
    view = area("VIEW_3D").spaces[0].region_3d
    view.view_distance, view.view_location = 2.2, (0, 0, 0)
    yield 1
    picture("before")

    with within("VIEW_3D"):
        assert bpy.ops.weft.simulate("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    while scene.frame_current < 20:
        yield 0.05
    assert work.running()
    picture("simulating")
    scarf.weft.textile = "denim_11oz"
    scene.frame_set(5)
    yield 1
    assert scene.frame_current == 5, "who looks at a frame is left there"
    while work.running():
        yield 0.1
    yield 0.5
    run = work.simulation.run
    assert run.refused is None and run.newest == 239, run.refused
    assert "denim" not in str(run.troubles())
    scene.frame_set(240)
    assert look(scarf)[:, 2].min() < -0.05
    yield 0.5
    picture("drape")

    with within("VIEW_3D"):
        assert bpy.ops.weft.simulate("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        while work.simulation.run.newest < 10:
            yield 0.05
        begun = time.monotonic()
        assert bpy.ops.weft.cancel() == {"FINISHED"}
    while work.running():
        yield 0.05
    assert time.monotonic() - begun < 20
    yield 0.5
    assert run is not work.simulation.run and 10 <= work.simulation.run.newest < 239

    hollow = bpy.data.objects["Ball"]
    scene.frame_set(1)
    with within("VIEW_3D"):
        scarf.select_set(False)
        open_up(hollow, 330)
        bpy.ops.weft.simulate("INVOKE_DEFAULT")
    while work.running():
        yield 0.1
    yield 1
    assert "the surface is open there" in str(work.simulation.run.refused)
    assert hollow.mode == "EDIT"
    picture("refused")
    work.end()


def drive(steps=[]):
    try:
        if not steps:
            install()
            steps.append(person())
        return next(steps[0])
    except StopIteration:
        print("a person simulates, scrubs, changes the fabric, cancels and is refused")
        sys.stdout.flush()
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        os._exit(1)


bpy.app.timers.register(drive, first_interval=1)
