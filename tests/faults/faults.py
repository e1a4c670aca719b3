"""Plants each fault of faults.toml in a copy of the sources, and says which tests catch it.

WEFT is where the sources are, COPY where they are copied to and built. Without COPY it says only
whether all can be planted.
"""
import os
import pathlib
import re
import subprocess
import sys
import tomllib

WEFT = pathlib.Path(os.environ["WEFT"]).absolute()
COPY = pathlib.Path(os.environ.get("COPY", "")).absolute()
SECONDS = 120  # within which tests end, or hang


def copy_sources():
    files = subprocess.check_output(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=WEFT, text=True)
    kept = set()
    for name in filter(None, files.split("\0")):
        source, copy = WEFT / name, COPY / name
        if not source.is_file():
            continue
        kept.add(copy)
        if not copy.exists() or copy.read_bytes() != source.read_bytes():
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(source.read_bytes())
            copy.chmod(source.stat().st_mode)
    for folder, folders, names in os.walk(COPY):
        if "build" in folders:
            folders.remove("build")
        for copy in (pathlib.Path(folder) / name for name in names):
            if copy not in kept:
                copy.unlink()  # the build takes up every source that it finds


def build(suites):
    targets = ["weft", "weftd"] + [f"weft-{suite}-tests" for suite in suites]
    done = subprocess.run(["cmake", "--build", "--preset", "release", "--target"] + targets,
                          cwd=COPY, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"does not build:\n{done.stdout[-4000:]}")


def failing(fault):
    """The first test that fails or hangs; None: all pass."""
    program = COPY / "build/release/bin" / f"weft-{fault['suite']}-tests"
    try:
        done = subprocess.run([program, f"--gtest_filter={fault['tests']}"], cwd=COPY,
                              capture_output=True, text=True, errors="replace", timeout=SECONDS)
        code, output = done.returncode, done.stdout
    except subprocess.TimeoutExpired as hung:
        code, output = 1, (hung.stdout or b"").decode(errors="replace")
    if "Running 0 tests" in output:
        sys.exit(f"no test is called {fault['tests']}")
    if code == 0:
        return None
    found = re.search(r"^\[  FAILED  \] (\S+)", output, re.M)
    return found[1] if found else re.findall(r"^\[ RUN      \] (\S+)", output, re.M)[-1]


def main():
    faults = tomllib.loads((WEFT / "tests/faults/faults.toml").read_text())["fault"]
    wanted = " ".join(sys.argv[1:])
    faults = [fault for fault in faults if wanted in fault["promise"]]
    for fault in faults:
        if (WEFT / fault["file"]).read_text().count(fault["sound"]) != 1:
            sys.exit(f"{fault['file']} has not once: {fault['sound']}")
    if "COPY" not in os.environ:
        return
    os.environ["CCACHE_BASEDIR"] = str(COPY)
    copy_sources()
    subprocess.check_call(["cmake", "--preset", "release", "-DWEFT_WERROR=OFF", "--log-level=ERROR"], cwd=COPY,
                          stdout=subprocess.DEVNULL)
    build({fault["suite"] for fault in faults})
    for fault in {(fault["suite"], fault["tests"]): fault for fault in faults}.values():
        if found := failing(fault):
            sys.exit(f"{found} fails without a fault")
    missed = 0
    for fault in faults:
        file = COPY / fault["file"]
        sound = file.read_text()
        file.write_text(sound.replace(fault["sound"], fault["faulty"]))
        try:
            build([fault["suite"]])
            found = failing(fault)
        finally:
            file.write_text(sound)
        missed += found is None
        print(f"{fault['promise']}: " + (f"caught by {found}" if found else "MISSED"), flush=True)
    print(f"{len(faults) - missed} of {len(faults)} faults are caught")
    sys.exit(missed > 0)


main()
