"""What docstrings and the README show, the example, and the package as pip installs it."""
import contextlib
import doctest
import importlib.util
import inspect
import os
import pathlib
import pkgutil
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest
import unittest.mock

import weft

SOURCES = pathlib.Path(__file__).parents[2] / "client/python"
OPTIONS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL


class Documents(unittest.TestCase):
    def test_docstrings_are_right(self):
        shown = 0
        parts = ["weft." + each.name for each in pkgutil.iter_modules(weft.__path__)]
        for name in ["weft", *parts]:
            result = doctest.testmod(importlib.import_module(name))
            self.assertEqual(result.failed, 0, name)
            shown += result.attempted
        self.assertGreater(shown, 8)

    def test_public_names_have_docstrings(self):
        for name in dir(weft):
            thing = getattr(weft, name)
            if not name.startswith("_"):
                self.assertTrue(thing.__doc__, name)
        for kind in weft.Server, weft.Session, weft.Hand, weft.Recording, weft.Frame, weft.Scene:
            for name, thing in vars(kind).items():
                is_method = inspect.isfunction(thing) or isinstance(thing, classmethod)
                if is_method and not name.startswith("_"):
                    self.assertTrue(thing.__doc__, f"{kind.__name__}.{name}")

    def test_the_readme_is_right(self):
        readme = (SOURCES / "README.md").read_text()
        result = doctest.testfile(str(SOURCES / "README.md"), module_relative=False,
                                  optionflags=OPTIONS)
        self.assertEqual(result.failed, 0)
        self.assertGreater(result.attempted, 20)
        for file in "examples/drape.py", "../../proto/weft/v1":
            self.assertIn(f"]({file})", readme)
            self.assertTrue((SOURCES / file).exists())

    def test_what_others_show_runs(self):
        readme = (SOURCES.parent / "README.md").read_text()
        topic = subprocess.check_output(["weft", "help", "python"], text=True)
        self.assertLessEqual(max(map(len, topic.splitlines())), 80)
        with tempfile.TemporaryDirectory() as directory:
            subprocess.check_output(["weft", "scene", "new", "--template=sphere", "-o",
                                     directory + "/scene.json"])
            for text in readme, topic:
                program = re.search(r"^( +)import weft\n(\1.*\n)*", text, re.M)[0]
                names = {}
                with contextlib.chdir(directory):
                    exec(textwrap.dedent(program), names)
                self.assertTrue(names["frame"].stats.at_rest)
        for name in re.findall(r"weft\.(\w+)", topic):
            self.assertTrue(hasattr(weft, name), name)

    def test_the_example_draws(self):
        example = SOURCES / "examples/drape.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 40)
        with tempfile.TemporaryDirectory() as directory:
            picture = directory + "/drape.png"
            with unittest.mock.patch.object(sys, "argv", [str(example), picture, "25"]):
                try:
                    os.environ["MPLBACKEND"] = "agg"
                    import matplotlib  # noqa: F401
                    drawn = {}
                except ImportError:
                    print("no python3-matplotlib: nothing is drawn")
                    axes = unittest.mock.MagicMock()
                    axes.T = [(unittest.mock.MagicMock(), unittest.mock.MagicMock())] * 5
                    plt = unittest.mock.MagicMock()
                    plt.subplots.return_value = unittest.mock.MagicMock(), axes
                    drawn = {"matplotlib": unittest.mock.MagicMock(pyplot=plt),
                             "matplotlib.pyplot": plt}
                with unittest.mock.patch.dict(sys.modules, drawn):
                    names = runpy.run_path(str(example))
            if not drawn:
                self.assertTrue(pathlib.Path(picture).read_bytes().startswith(b"\x89PNG"))
        for report in names["found"].values():
            self.assertTrue(5 < report.values[0].found < 100)

    def test_pip_installs_the_package(self):
        if not all(map(importlib.util.find_spec, ("pip", "setuptools"))):
            self.skipTest("no python3-pip or python3-setuptools")
        package = pathlib.Path(weft.__file__).parents[1]
        if not (package / "pyproject.toml").exists():
            self.skipTest("the package is installed, not built")
        with tempfile.TemporaryDirectory() as directory:
            source = directory + "/source"
            shutil.copytree(package, source)  # pip builds within
            subprocess.check_output(
                [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps",
                 "--no-build-isolation", "--root-user-action=ignore", "--no-compile",
                 f"--target={directory}", source], stderr=subprocess.STDOUT)
            said = subprocess.check_output(
                [sys.executable, "-c", "import weft, importlib.metadata as m;"
                 "print(weft.__file__, m.version('weft'), weft.serve().info().version)"],
                env={**os.environ, "PYTHONPATH": directory}, text=True)
            file, *versions = said.split()
            self.assertTrue(file.startswith(directory))
            self.assertEqual(versions[0], versions[1])


if __name__ == "__main__":
    unittest.main()
