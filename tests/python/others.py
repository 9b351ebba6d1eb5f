"""Files of somebody else in a workspace."""

# As a merge calls its own.
NAMES = ("segment-0", "unfinished-x", "tile-1", "done-plan-000000", "lock", "surfrecon-merge-0/x", "x.json")


def put(workspace):
    """Puts them there; as they are then."""
    for name in NAMES:
        path = workspace / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"somebody's {name}")
    return looked_at(workspace)


def looked_at(workspace):
    """The bytes of each, and when it was written."""
    paths = [path for name in NAMES if (path := workspace / name).exists()]
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in paths}


def ours(workspace):
    """The other files that are there."""
    return {path.name for path in workspace.iterdir()} - {name.split("/")[0] for name in NAMES}
