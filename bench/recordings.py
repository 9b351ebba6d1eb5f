"""Reading recordings of depth cameras and phones, beside what decoding their images takes: 100 frames of each layout.

They are taken by the virtual scanner and written by write_recordings.py. A small Rust program (decoders.rs) reads them,
one way a process: the images alone by the same decoders, called without us; as frames; as range images with a colour a
sample. CPU time is that of reading without opening; MB are those of the files.
"""

import json
import subprocess
import tempfile
from pathlib import Path

import measured
import table
from write_recordings import LAYOUTS

HERE = Path(__file__).parent
WAYS = {"decoders": "decoders", "surfrecon": "frames", "surfrecon-images": "read"}
FRAMES, FEWEST = 100, 3
SMALLEST = "Record3D.r3d"


def megabytes(path):
    """Of a file, or of all files of a folder."""
    files = [file for file in path.rglob("*") if file.is_file()] if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files) / 1e6


def against_decoders(rows):
    """How many times the decoders' CPU time each way takes."""
    alone = next((row.get("cpu_s") for row in rows if row["tool"] == "decoders"), None)
    for row in rows:
        if alone and "cpu_s" in row:
            row["of_decoders"] = row["cpu_s"] / alone


def main(wanted, record):
    """Has each layout written and read; rows of tool and layout."""
    names = [SMALLEST] if wanted.smallest else list(LAYOUTS)
    names = [name for name in names if wanted.takes(f"recording, {name}")]
    if not names:
        return
    made = subprocess.run([HERE.parent / "tools" / "venv.sh", "bench-recordings"], capture_output=True, text=True)
    if made.returncode:
        record.skip("recordings: the environment that writes them could not be made")
        return
    python = Path(made.stdout.strip()) / "bin" / "python"
    first = len(record.rows)
    for name in names:
        # One at a time: a hundred frames of colours are some hundred megabytes.
        with tempfile.TemporaryDirectory() as folder:
            frames = FEWEST if wanted.smallest else FRAMES
            subprocess.run([python, HERE / "write_recordings.py", folder, str(frames), name], check=True)
            read(name, Path(folder, name), wanted, record)
    shown = {
        "layout": "case",
        "tool": "tool",
        "MB": "file_mb",
        "MB/s": "mb_per_s",
        "CPU s": "cpu_s",
        "opening s": "open_s",
    }
    table.show(record.rows[first:], shown | {"of decoders": "of_decoders", "peak MB": "peak_mb"})


def read(name, path, wanted, record):
    """A row for each way to read a recording."""
    case, size = f"recording, {name}", megabytes(path)

    def once(tool):
        program = [wanted.programs / "examples" / "decoders", WAYS[tool], path]
        figures, printed = measured.run(program, timeout=600)
        told = json.loads(printed.strip().splitlines()[-1])
        speed = {"mb_per_s": size / max(told["cpu_s"], measured.LEAST_S), "file_mb": size}
        return told | speed | {"wall_s": figures["wall_s"], "peak_mb": figures["peak_mb"]}, None

    def head(tool):
        return {"case": case, "format": "recording", "tool": tool}

    record.measure(wanted.tools(case, list(WAYS)), wanted.repeats, once, head, derive=against_decoders)
