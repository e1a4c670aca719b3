"""Whether the tools that exports are for read what the recording holds: formats_test.py [CHECK...]

BIN has the programs. A CHECK is caches, vtk, gltf, usd or blender; none: all. A line for each; exits
with 1 where one is wrong.
"""
import csv
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

HERE = pathlib.Path(__file__).parent
WEFT = pathlib.Path(os.environ["BIN"]) / "weft"
LAST = 30
SHEETS = {"cloth": (9, 12), "ribbon": (4, 16)}  # rows, columns
FLOAT32 = 1e-6  # m: rounding at 2 m, and the sum of a morph target


def weft(*arguments):
    return subprocess.check_output([WEFT, *arguments], text=True)


def record(folder):
    """The recording, and where every particle is: truth[frame][particle] in the order of sheets."""
    scene = json.loads(weft("scene", "new", "--template=sphere", "--textile=wool_tropical"))
    sheet = scene["sheets"][0]
    scene["sheets"] = []
    for place, (name, (rows, columns)) in enumerate(SHEETS.items()):
        grid = {"rows": rows, "columns": columns, "spacing_m": 0.05}
        placement = {"origin_m": {"x": 2 * place - 0.3, "y": 0.8, "z": -0.2}}
        scene["sheets"].append({**sheet, "name": name, "grid": grid, "placement": placement})
    (folder / "scene.json").write_text(json.dumps(scene))
    recording = folder / "a.weft"
    weft("record", folder / "scene.json", "--embedded", f"--to={LAST}", "--encoding=float64",
         "-o", recording)
    weft("export", recording, "--format=csv", "-o", folder / "a.csv")
    with open(folder / "a.csv") as file:
        rows = [[float(cell) for cell in row] for row in list(csv.reader(file))[1:]]
    return recording, [list(zip(row[1::3], row[2::3], row[3::3])) for row in rows]


def largest(found, truth):
    """The largest distance along an axis, m."""
    assert len(found) == len(truth), f"{len(found)} particles, not {len(truth)}"
    return max(abs(a - b) for p, q in zip(found, truth) for a, b in zip(p, q))


def check_caches(folder, recording, truth):
    """OBJ, PC2 and MDD by what their formats say, of one sheet."""
    (name, (rows, columns)), *_ = SHEETS.items()
    count = rows * columns
    part = [frame[:count] for frame in truth]
    for kind in ("pc2", "mdd"):
        weft("export", recording, f"--format={kind}", f"--sheet={name}",
             "-o", folder / f"cache.{kind}")
    weft("export", recording, "--format=obj", f"--sheet={name}", "-o", folder / "mesh")

    def frames(numbers):
        points = list(zip(numbers[0::3], numbers[1::3], numbers[2::3]))
        return [points[first:first + count] for first in range(0, len(points), count)]

    pc2 = (folder / "cache.pc2").read_bytes()
    magic, version, points, _, _, samples = struct.unpack_from("<12s2i2fi", pc2)
    assert (magic, version, points, samples) == (b"POINTCACHE2\0", 1, count, len(truth))
    read = {"pc2": frames(struct.unpack_from(f"<{3 * points * samples}f", pc2, 32))}

    mdd = (folder / "cache.mdd").read_bytes()
    samples, points = struct.unpack_from(">2i", mdd)
    assert (points, samples) == (count, len(truth))
    times = struct.unpack_from(f">{samples}f", mdd, 8)
    assert all(abs(time - frame / 60) < 1e-6 for frame, time in enumerate(times))
    read["mdd"] = frames(struct.unpack_from(f">{3 * points * samples}f", mdd, 8 + 4 * samples))

    read["obj"] = []
    for file in sorted((folder / "mesh").glob("*.obj")):
        lines = [line.split() for line in file.read_text().splitlines()]
        read["obj"].append([tuple(map(float, line[1:4])) for line in lines if line[:1] == ["v"]])
        faces = [[int(corner.split("/")[0]) for corner in line[1:]]
                 for line in lines if line[:1] == ["f"]]
        assert len(faces) == (rows - 1) * (columns - 1), f"{len(faces)} faces"
        assert {corner for face in faces for corner in face} == set(range(1, count + 1))
    off = {kind: max(map(largest, found, part)) for kind, found in read.items()}
    assert all(len(found) == len(part) for found in read.values()), "not as many frames"
    return [(kind, "its format", off[kind], FLOAT32) for kind in read]


def check_vtk(folder, recording, truth):
    import vtk
    weft("export", recording, "--format=vtk", "-o", folder / "a.pvd")
    entries = list(xml.etree.ElementTree.parse(folder / "a.pvd").iter("DataSet"))
    assert len(entries) == len(truth), f"{len(entries)} meshes"
    off = 0
    for frame, entry in enumerate(entries):
        assert abs(float(entry.get("timestep")) - frame / 60) < 1e-9, entry.get("timestep")
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(folder / entry.get("file")))
        reader.Update()
        mesh = reader.GetOutput()
        off = max(off, largest(
            [mesh.GetPoint(i) for i in range(mesh.GetNumberOfPoints())], truth[frame]))
        assert mesh.GetNumberOfPolys() == sum((r - 1) * (c - 1) for r, c in SHEETS.values())
    edges = vtk.vtkFeatureEdges()  # cells that share edges have one rim around each sheet
    edges.SetInputData(mesh)
    edges.FeatureEdgesOff()
    edges.NonManifoldEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    rim = edges.GetOutput().GetNumberOfCells()
    assert rim == sum(2 * (r + c - 2) for r, c in SHEETS.values()), f"a rim of {rim} edges"
    return [("vtk", f"VTK {vtk.vtkVersion.GetVTKVersion()}", off, 1e-12)]


def check_gltf(folder, recording, _):
    weft("export", recording, "--format=gltf", "-o", folder / "a.glb")
    report = json.loads(subprocess.check_output(
        ["node", HERE / "validate_gltf.cjs", folder / "a.glb"], text=True))
    issues = report["issues"]
    found = [message["message"] for message in issues["messages"]]
    assert issues["numErrors"] == issues["numWarnings"] == 0, "; ".join(found[:3])
    return [("gltf", f"gltf-validator {report['validatorVersion']}", 0, 0)]


def check_usd(folder, recording, truth):
    files = [folder / "a.usda"] + [folder / f"{frame}.usda" for frame in range(len(truth))]
    weft("export", recording, "--format=usda", "-o", files[0])
    for frame, file in enumerate(files[1:]):
        weft("export", recording, "--format=usda", f"--frames={frame}:{frame}", "-o", file)
    read = json.loads(subprocess.check_output(["node", HERE / "read_usd.mjs", *files], text=True))
    off = 0
    for mesh, points in zip(read["meshes"], [truth[0], *truth]):
        assert mesh["meshes"] == 1, f"{mesh['meshes']} meshes"
        assert mesh["triangles"] == sum(2 * (r - 1) * (c - 1) for r, c in SHEETS.values())
        xyz = mesh["points"]
        off = max(off, largest(list(zip(xyz[0::3], xyz[1::3], xyz[2::3])), points))
    return [("usda", f"tinyusdz {read['version']}", off, FLOAT32)]


def check_blender(folder, recording, truth):
    first = 0
    for name, (rows, columns) in SHEETS.items():
        for kind, ending in (("obj", ""), ("pc2", ".pc2"), ("mdd", ".mdd")):
            weft("export", recording, f"--format={kind}", f"--sheet={name}",
                 "-o", folder / (name + ending))
        count = rows * columns
        part = [frame[first:first + count] for frame in truth]
        (folder / f"{name}.json").write_text(json.dumps(part))
        first += count
    weft("export", recording, "--format=gltf", "-o", folder / "a.glb")
    (folder / "a.json").write_text(json.dumps(truth))
    done = subprocess.run(
        ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
         HERE / "load_in_blender.py", "--", folder, *SHEETS], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr[-1500:]
    lines = [line.split("\t")[1:] for line in done.stdout.splitlines() if line.startswith("RESULT")]
    assert len(lines) == 2 * len(SHEETS) + 1, done.stdout[-1500:]
    return [(what, f"Blender {version}", float(off), FLOAT32) for what, version, off in lines]


CHECKS = {"caches": check_caches, "vtk": check_vtk, "gltf": check_gltf, "usd": check_usd,
          "blender": check_blender}


def main(*wanted):
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        recording, truth = record(folder)
        particles = len(truth[0])
        print(f"{len(truth)} frames of {particles} particles, largest difference to the recording:")
        for name in wanted or CHECKS:
            try:
                for what, reader, off, most in CHECKS[name](folder, recording, truth):
                    good = off <= most
                    wrong += not good
                    distance = f"{off:8.1e} m" if most else "     valid"
                    print(f"  {what:<17}  {reader:<30}  {distance}  {'ok' if good else 'WRONG'}")
            except (AssertionError, subprocess.CalledProcessError) as error:
                wrong += 1
                print(f"  {name:<17}  WRONG: {error}")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
