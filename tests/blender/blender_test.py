"""The add-on within Blender, installed from its zip as a person does: blender_test.py BLENDER
[PICTURES]

ADDON is the zip. With PICTURES, a folder, also what needs a window, under Xvfb, and pictures of it.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent


def run(command, environment):
    print("==", *command[-2:], flush=True)
    subprocess.run(command, env=environment, check=True, timeout=300)


def main():
    blender, *pictures = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        scripts = pathlib.Path(folder) / "scripts"
        (scripts / "addons").mkdir(parents=True)
        environment = {**os.environ, "BLENDER_USER_SCRIPTS": str(scripts), "TMPDIR": folder,
                       "BLENDER_USER_CONFIG": f"{folder}/config", "FOLDER": folder}
        common = ["--factory-startup", "--python-exit-code", "1"]
        plain = [blender, "--background", *common, "--python"]
        run([*plain, HERE / "within.py"], environment)
        # what is left behind, in a Blender that has never heard of Weft
        without = {**environment, "BLENDER_USER_SCRIPTS": f"{folder}/none", "PYTHONPATH": ""}
        run([*plain, HERE / "without_weft.py"], without)
        if pictures:
            screen = ["xvfb-run", "--auto-servernum", "--server-args=-screen 0 1600x1000x24"]
            window = [*screen, blender, *common, "-p", "0", "0", "1600", "1000", "--python"]
            run([*window, HERE / "window.py"],
                {**environment, "PICTURES": pictures[0], "LIBGL_ALWAYS_SOFTWARE": "1"})


if __name__ == "__main__":
    main()
