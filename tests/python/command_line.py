"""The command line as a program of its own."""

import json
import math
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import surfrecon
from shapes import torus, torus_scans

ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"} | {
    "PYTHONPATH": str(Path(surfrecon.__file__).parents[1].resolve())
}
PROGRAM = [sys.executable, "-m", "surfrecon"]


def run(*arguments, **options):
    """Runs it to its end; what it says is text."""
    given = {"capture_output": True} if not {"stdout", "stderr"} & set(options) else {}
    given |= {"env": ENVIRONMENT, "timeout": 300}
    done = subprocess.run([*PROGRAM, *arguments], **(given | options))
    done.stdout, done.stderr = (None if s is None else s.decode(errors="replace") for s in (done.stdout, done.stderr))
    assert "Traceback" not in (done.stderr or ""), done.stderr
    return done


def start(*arguments, **options):
    """Starts it."""
    return subprocess.Popen([*PROGRAM, *arguments], env=ENVIRONMENT, **options)


def data(folder):
    """Puts scans, a mesh, points and their surface into a folder."""
    surfrecon.write_scans(folder / "ring.conf", torus_scans(pixels=40))
    torus(24).write(folder / "torus.ply")
    # Spread evenly over a ball.
    k = np.arange(512) + 0.5
    height, turn = 1 - k / 256, k * math.pi * (1 + math.sqrt(5))
    ring = np.sqrt(1 - height**2)
    np.savetxt(folder / "points.xyz", np.stack([ring * np.cos(turn), ring * np.sin(turn), height], 1), fmt="%.6f")
    surfrecon.reconstruct(np.loadtxt(folder / "points.xyz")).mesh.write(folder / "ball.ply")
    return folder


def states(folder, *options, code=1):
    """The state of each job."""
    done = run("batch", folder / "jobs.toml", "--json", *options)
    assert done.returncode == code, done.stderr
    return {job["name"]: job["state"] for job in json.loads(done.stdout)["jobs"]}


def buffer_outside(folder, name):
    """A triangle as glTF whose buffer is a file of its own."""
    buffer = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    (folder / f"{name} 1.bin").write_bytes(buffer)
    whole = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": f"{name}%201.bin"}],
    }
    (folder / f"{name}.gltf").write_text(json.dumps(whole))
