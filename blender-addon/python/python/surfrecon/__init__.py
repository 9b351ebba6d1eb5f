"""Surfaces from range scans: registered scans in, one merged surface out.

Arrays in and out are NumPy's; work runs on all cores with the interpreter lock released. Lengths are in the unit of the
scans, angles in radians; ``parameters()`` lists every option with default, range and meaning.

>>> scans = surfrecon.open("bun.conf")
>>> result = surfrecon.merge(scans)
>>> result.mesh.positions.shape
"""

from ._errors import (
    Cancelled,
    FileError,
    FormatError,
    InputError,
    InternalError,
    OutOfMemoryError,
    ParameterError,
    SurfreconError,
)
from ._native import (
    Camera,
    Clustered,
    Job,
    MergeReport,
    MergeResult,
    Mesh,
    Parameter,
    PointCloud,
    RangeImage,
    Scan,
    ScanSet,
    Sculpted,
    Sculptor,
    __version__,
    cluster,
    cluster_levels,
    distances,
    formats,
    merge,
    open,
    parameters,
    read,
    sculpt,
    sculpture,
    turntable,
    virtual_scan,
    write,
    write_scans,
)

__all__ = [
    "Camera",
    "Cancelled",
    "Clustered",
    "FileError",
    "FormatError",
    "InputError",
    "InternalError",
    "Job",
    "Mesh",
    "MergeReport",
    "MergeResult",
    "OutOfMemoryError",
    "Parameter",
    "ParameterError",
    "PointCloud",
    "RangeImage",
    "Scan",
    "ScanSet",
    "Sculpted",
    "Sculptor",
    "SurfreconError",
    "__version__",
    "cluster",
    "cluster_levels",
    "distances",
    "formats",
    "merge",
    "open",
    "parameters",
    "read",
    "sculpt",
    "sculpture",
    "turntable",
    "virtual_scan",
    "write",
    "write_scans",
]
