"""Types of the compiled module. The texts are its docstrings (`help(surfrecon.merge)`)."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import IO, Any, ClassVar, Literal, Self, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import deprecated, disjoint_base

from ._reports import (
    AlignReport,
    CheckReport,
    CloseReport,
    ClusterReport,
    DistanceReport,
    LeftOutReport,
    MergeReport,
    PrepareReport,
    PrintReport,
    QuadReport,
    ReconstructReport,
    SculptReport,
    Snap,
    TextureReport,
    UnwrapReport,
)

__all__ = [
    "Aligner",
    "Alignment",
    "Box",
    "Camera",
    "Checked",
    "Closed",
    "Clustered",
    "Context",
    "Figure",
    "Frame",
    "GridCamera",
    "Job",
    "MemoryFolder",
    "MemoryPath",
    "MergeResult",
    "Merger",
    "Mesh",
    "Operation",
    "Parameter",
    "Photo",
    "Pick",
    "Plane",
    "PointCloud",
    "Prepared",
    "QuadGrid",
    "RangeImage",
    "Reconstructed",
    "Reconstructor",
    "Scan",
    "ScanSet",
    "Sculpted",
    "Sculptor",
    "Similarity",
    "Spline",
    "TextureTile",
    "Textured",
    "Unwrapped",
    "__version__",
    "_again",
    "_check_file_in_pieces",
    "_end_merge_tasks",
    "_merge_stages",
    "_merge_task",
    "_merge_tasks_to_file",
    "_nearest",
    "_open_many",
    "_part_path",
    "adaptive_quads",
    "align",
    "check_print",
    "close",
    "cluster",
    "cluster_levels",
    "crs_note",
    "distances",
    "dominant_plane",
    "figures",
    "formats",
    "ground",
    "keep",
    "linear_colours",
    "memory_foreseen",
    "memory_in_use",
    "memory_limit",
    "memory_peak",
    "merge",
    "merge_to_file",
    "nearest_triangles",
    "open",
    "operations",
    "parameters",
    "prepare_print",
    "provenance",
    "read",
    "reconstruct",
    "recording_of",
    "remove",
    "sculpt",
    "sculpture",
    "set_memory_limit",
    "surface_distance",
    "texture",
    "transformed",
    "true_size",
    "turntable",
    "unwrap",
    "virtual_scan",
    "write",
    "write_scans",
]

__version__: str

_Vector: TypeAlias = Sequence[float] | NDArray[np.floating[Any]]
_Matrix: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | bytes | PathLike[str] | PathLike[bytes]
# A path, or a binary file object with a name.
_File: TypeAlias = _Path | IO[bytes]
_Viewing: TypeAlias = tuple[Literal["parallel", "from"], ArrayLike]
_Attributes: TypeAlias = dict[str, NDArray[Any]]
_Alignable: TypeAlias = Scan | RangeImage | PointCloud | Mesh | tuple[Mesh, ArrayLike] | tuple[Mesh, ArrayLike, str]
_Picked: TypeAlias = Pick | tuple[int, int, ArrayLike, ArrayLike] | tuple[int, int, ArrayLike, ArrayLike, float]
_Poses: TypeAlias = Iterable[ArrayLike | None]
_Mergeable: TypeAlias = Scan | RangeImage | Mesh | tuple[Mesh, ArrayLike] | tuple[Mesh, ArrayLike, str]
_Region: TypeAlias = Box | Plane | ArrayLike
_Axis: TypeAlias = Literal["x", "y", "z", "-x", "-y", "-z"]
_Progress: TypeAlias = Callable[[str, float], bool | None]
_Content: TypeAlias = RangeImage | Mesh | PointCloud

@final
class Parameter:
    @property
    def operation(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def kind(self) -> Literal["length", "angle", "ratio", "count", "flag", "choice"]: ...
    @property
    @deprecated("It is called kind now.")
    def unit(self) -> Literal["length", "angle", "ratio", "count", "flag", "choice"]: ...
    @property
    def default(self) -> float | bool | str | None: ...
    @property
    def default_from(self) -> str | None: ...
    @property
    def minimum(self) -> float: ...
    @property
    def minimum_excluded(self) -> bool: ...
    @property
    def maximum(self) -> float: ...
    @property
    def allowed(self) -> str: ...
    def check(self, value: object) -> None: ...
    @property
    def choices(self) -> list[tuple[str, str, str]]: ...
    @property
    def text(self) -> str: ...
    @property
    def off(self) -> str: ...
    @property
    def since(self) -> str: ...

@final
class Operation:
    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def since(self) -> str: ...
    @property
    def takes(self) -> list[str]: ...
    @property
    def gives(self) -> list[str]: ...
    @property
    def command(self) -> tuple[str, str, str] | None: ...
    @property
    def command_name(self) -> str | None: ...
    @property
    def operator(self) -> tuple[str, str, str] | None: ...
    @property
    def filter(self) -> tuple[str, str] | None: ...

@final
class Figure:
    @property
    def operation(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def kind(
        self,
    ) -> Literal[
        "flag",
        "count",
        "integer",
        "bytes",
        "length",
        "angle",
        "ratio",
        "number",
        "choice",
        "text",
        "warning",
        "stage",
        "report",
    ]: ...
    @property
    def shape(self) -> Literal["one", "optional", "array", "optional array", "list"]: ...
    @property
    def choices(self) -> list[tuple[str, str, str]]: ...
    @property
    def text(self) -> str: ...
    @property
    def since(self) -> str: ...

@final
class Box:
    def __new__(cls, world_from_box: ArrayLike) -> Box: ...
    @staticmethod
    def between(low: ArrayLike, high: ArrayLike) -> Box: ...
    def contains(self, points: ArrayLike) -> NDArray[np.bool_]: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class Plane:
    def __new__(cls, point: ArrayLike, normal: ArrayLike, *, margin: float = 0.0) -> Plane: ...
    @staticmethod
    def through(points: ArrayLike, *, above: ArrayLike | None = None) -> Plane: ...
    @property
    def point(self) -> NDArray[np.float64]: ...
    @property
    def normal(self) -> NDArray[np.float64]: ...
    @property
    def margin(self) -> float: ...
    @property
    def share(self) -> float | None: ...
    @property
    def spread(self) -> float | None: ...
    def with_margin(self, margin: float) -> Plane: ...
    def flipped(self) -> Plane: ...
    def height(self, points: ArrayLike) -> NDArray[np.float64]: ...
    def contains(self, points: ArrayLike) -> NDArray[np.bool_]: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class Similarity:
    def __new__(cls, matrix: ArrayLike) -> Similarity: ...
    @property
    def matrix(self) -> _Matrix: ...
    @property
    def scale(self) -> float: ...
    def inverse(self) -> Similarity: ...
    def apply(self, points: ArrayLike) -> NDArray[np.float64]: ...
    def __matmul__(self, value: Similarity, /) -> Similarity: ...
    def __rmatmul__(self, value: Similarity, /) -> Similarity: ...

@final
class Mesh:
    def __new__(
        cls,
        positions: ArrayLike,
        triangles: ArrayLike,
        *,
        colour: ArrayLike | None = None,
        confidence: ArrayLike | None = None,
    ) -> Mesh: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def vertex_attributes(self) -> _Attributes: ...
    @property
    def face_attributes(self) -> _Attributes: ...
    def positions_f32(self, origin: tuple[float, float, float] = ..., scale: float = 1.0) -> NDArray[np.float32]: ...
    @property
    def bounds(self) -> NDArray[np.float64] | None: ...
    def write(
        self,
        path: _File,
        *,
        # options: write
        metres_per_unit: float | None = 1.0,
        up: Literal["y", "z"] | None = "y",
        encoding: Literal["binary", "binary_double", "ascii"] | None = "binary",
        part_triangles: int | None = 0,
        # end
        provenance: Mapping[str, Any] | None = None,
        coarser: Sequence[Mesh] = ...,
        progress: _Progress | None = None,
    ) -> None: ...
    def check(self) -> CheckReport: ...
    def keep(self, region: _Region, *, world_from_mesh: ArrayLike | None = None) -> Mesh: ...
    def remove(self, region: _Region, *, world_from_mesh: ArrayLike | None = None) -> Mesh: ...
    def transformed(self, similarity: Similarity | ArrayLike) -> Mesh: ...
    @property
    def crs(self) -> str | None: ...
    def with_crs(self, crs: str | None) -> Mesh: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class PointCloud:
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def normals(self) -> NDArray[np.float32] | None: ...
    @property
    def colour(self) -> NDArray[np.uint8] | None: ...
    @property
    def intensity(self) -> NDArray[np.float32] | None: ...
    @property
    def sensor(self) -> NDArray[np.float64] | None: ...
    @property
    def world_from_cloud(self) -> _Matrix: ...
    @property
    def crs(self) -> str | None: ...
    def keep(self, region: _Region) -> PointCloud: ...
    def remove(self, region: _Region) -> PointCloud: ...
    def transformed(self, similarity: Similarity | ArrayLike) -> PointCloud: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class GridCamera:
    def __new__(
        cls, rows: int, cols: int, projection: dict[str, Any], anchors: ArrayLike | None = None
    ) -> GridCamera: ...
    @property
    def rows(self) -> int: ...
    @property
    def cols(self) -> int: ...
    @property
    def projection(self) -> dict[str, Any]: ...
    @property
    def anchors(self) -> NDArray[np.float64]: ...
    def scaled(self, scale: float) -> GridCamera: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getnewargs__(self) -> tuple[int, int, dict[str, Any], NDArray[np.float64]]: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]

@final
class RangeImage:
    name: str
    crs: str | None
    @staticmethod
    def from_points(points: ArrayLike, *, viewing: _Viewing | None = None, name: str | None = None) -> RangeImage: ...
    @staticmethod
    def orthographic(
        values: ArrayLike,
        *,
        step: tuple[float, float],
        first: tuple[float, float] = ...,
        name: str | None = None,
    ) -> RangeImage: ...
    @staticmethod
    def pinhole(
        values: ArrayLike,
        *,
        focal: tuple[float, float],
        centre: tuple[float, float],
        depth: Literal["planar", "ray"] = "planar",
        name: str | None = None,
    ) -> RangeImage: ...
    @staticmethod
    def spherical(
        values: ArrayLike,
        *,
        step: tuple[float, float],
        first: tuple[float, float] = ...,
        name: str | None = None,
    ) -> RangeImage: ...
    @staticmethod
    def from_vertices(
        camera: GridCamera,
        row: ArrayLike,
        col: ArrayLike,
        positions: ArrayLike,
        *,
        world_from_host: ArrayLike | None = None,
        colour: ArrayLike | None = None,
        intensity: ArrayLike | None = None,
        confidence: ArrayLike | None = None,
        name: str | None = None,
    ) -> RangeImage: ...
    @property
    def rows(self) -> int: ...
    @property
    def cols(self) -> int: ...
    @property
    def projection(self) -> dict[str, Any]: ...
    @property
    def points(self) -> NDArray[np.float32] | NDArray[np.float64]: ...
    @property
    def values(self) -> NDArray[np.float64] | None: ...
    @property
    def valid(self) -> NDArray[np.bool_]: ...
    @property
    def world_from_sensor(self) -> _Matrix: ...
    @world_from_sensor.setter
    def world_from_sensor(self, pose: ArrayLike) -> None: ...
    @property
    def colour(self) -> NDArray[np.uint8] | None: ...
    @colour.setter
    def colour(self, colour: ArrayLike | None) -> None: ...
    @property
    def intensity(self) -> NDArray[np.float32] | None: ...
    @intensity.setter
    def intensity(self, intensity: ArrayLike | None) -> None: ...
    @property
    def confidence(self) -> NDArray[np.float32] | None: ...
    @confidence.setter
    def confidence(self, confidence: ArrayLike | None) -> None: ...
    def write(
        self, path: _File, *, provenance: Mapping[str, Any] | None = None, progress: _Progress | None = None
    ) -> None: ...
    @property
    def sensor(self) -> NDArray[np.float64] | None: ...
    def world_points(self) -> NDArray[np.float64]: ...
    def to_mesh(self, faces: bool = True) -> Mesh: ...
    def to_cloud(self) -> PointCloud: ...
    def grid_camera(self) -> GridCamera: ...
    def keep(self, region: _Region) -> RangeImage: ...
    def remove(self, region: _Region) -> RangeImage: ...
    def transformed(self, similarity: Similarity | ArrayLike) -> RangeImage: ...
    def triangulate(
        self,
        *,
        # options: triangulate
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        # end
    ) -> Mesh: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@disjoint_base
class Scan:
    @property
    def name(self) -> str: ...
    @property
    def path(self) -> Path: ...
    @property
    def part(self) -> int: ...
    @property
    def world_from_sensor(self) -> _Matrix: ...
    @property
    def crs(self) -> str | None: ...
    @property
    def _is_one_of_many(self) -> bool: ...
    def read(self, *, progress: _Progress | None = None) -> _Content: ...
    def keep(self, region: _Region) -> Self: ...
    def remove(self, region: _Region) -> Self: ...
    def transformed(self, similarity: Similarity | ArrayLike) -> Self: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class Frame(Scan):
    @property
    def has_colour(self) -> bool: ...
    @property
    def colour(self) -> NDArray[np.uint8] | None: ...
    @property
    def confidence(self) -> NDArray[np.uint8] | None: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def pose(self) -> _Matrix: ...
    @property
    def depth(self) -> RangeImage: ...
    @property
    def image(self) -> RangeImage: ...
    @property
    def left_out(self) -> LeftOutReport: ...

@final
class ScanSet(Sequence[Scan]):
    @property
    def notes(self) -> list[str]: ...
    @property
    def crs(self) -> str | None: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: int, /) -> Scan: ...
    @overload
    def __getitem__(self, key: slice, /) -> ScanSet: ...
    def __iter__(self) -> Iterator[Scan]: ...
    def keep(self, region: Box | Plane | Iterable[ArrayLike | None]) -> ScanSet: ...
    def remove(self, region: Box | Plane | Iterable[ArrayLike | None]) -> ScanSet: ...
    def transformed(self, similarity: Similarity | ArrayLike) -> ScanSet: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class Alignment:
    @property
    def world_from_scan(self) -> list[NDArray[np.float64] | None]: ...
    @property
    def scans(self) -> list[Any]: ...
    @property
    def report(self) -> AlignReport: ...
    @property
    def aligner(self) -> Aligner: ...
    def misfit(
        self, scan: int, points: ArrayLike | None = None, *, progress: _Progress | None = None
    ) -> NDArray[np.float64]: ...
    def write(self, path: _File) -> None: ...

@final
class Pick:
    def __new__(
        cls,
        a: int,
        b: int,
        point_a: ArrayLike,
        point_b: ArrayLike,
        *,
        normals: tuple[ArrayLike, ArrayLike] | None = None,
        weight: float = 1.0,
    ) -> Pick: ...
    @property
    def a(self) -> int: ...
    @property
    def b(self) -> int: ...
    @property
    def point_a(self) -> list[float]: ...
    @property
    def point_b(self) -> list[float]: ...
    @property
    def normals(self) -> tuple[list[float], list[float]] | None: ...
    @property
    def weight(self) -> float: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

@final
class Aligner:
    def __new__(
        cls,
        scans: Iterable[_Alignable],
        *,
        # options: align only threads
        threads: int | None = 0,
        # end
        progress: _Progress | None = None,
    ) -> Aligner: ...
    def align(
        self,
        *,
        # options: align
        start: Literal["auto", "unknown", "rough", "sequence"] | None = "auto",
        reach: float | None = None,
        turntable: Literal["no", "turned", "equal"] | None = "no",
        tolerance: float | None = None,
        min_overlap: float | None = 0.03,
        use_colour: bool | None = True,
        threads: int | None = 0,
        # end
        fixed: Iterable[int] | None = None,
        picks: Iterable[_Picked] | None = None,
        trusted: Iterable[tuple[int, int]] | None = None,
        rejected: Iterable[tuple[int, int]] | None = None,
        axis: tuple[ArrayLike, ArrayLike] | None = None,
        angles: ArrayLike | None = None,
        progress: _Progress | None = None,
    ) -> Alignment: ...
    def snap(
        self,
        scan: int,
        world_from_scan: ArrayLike,
        *,
        # options: align only reach tolerance min_overlap threads
        reach: float | None = None,
        tolerance: float | None = None,
        min_overlap: float | None = 0.03,
        threads: int | None = 0,
        # end
        poses: _Poses | None = None,
        progress: _Progress | None = None,
    ) -> Snap: ...
    def misfit(
        self,
        scan: int,
        poses: _Poses | None = None,
        points: ArrayLike | None = None,
        *,
        progress: _Progress | None = None,
    ) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

@final
class MemoryFolder:
    def __new__(cls, sink: Callable[[str, bytes | None], object] | None = None) -> Self: ...
    def put_source(self, name: str, length: int, read: Callable[[int, int], bytes]) -> MemoryPath: ...
    def get(self, name: str, default: Any = None) -> Any: ...
    def items(self) -> list[tuple[str, bytes]]: ...
    def keys(self) -> list[str]: ...
    def values(self) -> list[bytes]: ...
    def __truediv__(self, name: str, /) -> MemoryPath: ...
    def __rtruediv__(self, other: object, /) -> Any: ...
    def __fspath__(self) -> str: ...
    def __setitem__(self, name: str, content: bytes | bytearray | memoryview | IO[bytes], /) -> None: ...
    def __getitem__(self, name: str, /) -> bytes: ...
    def __delitem__(self, name: str, /) -> None: ...
    def __contains__(self, name: object, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...

@final
class MemoryPath:
    @property
    def name(self) -> str: ...
    def __fspath__(self) -> str: ...

@final
class Merger:
    def __new__(cls, scans: Iterable[_Mergeable] | None = None) -> Merger: ...
    def add(self, scan: _Mergeable) -> int: ...
    def insert(self, index: int, scan: _Mergeable) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Scan | RangeImage | tuple[Mesh, NDArray[np.float64], str]: ...
    def __iter__(self) -> Iterator[Scan | RangeImage | tuple[Mesh, NDArray[np.float64], str]]: ...
    def __setitem__(self, index: int, scan: _Mergeable, /) -> None: ...
    def __delitem__(self, index: int, /) -> None: ...
    def merge(
        self,
        *,
        # options: merge
        voxel: float | None = None,
        merge_distance: float | None = None,
        max_hole_length: float | None = None,
        min_component_share: float | None = 0.0,
        match_exposure: bool | None = True,
        close: Literal["all", "seen", "holes", "none"] | None = "holes",
        flat_base: bool | None = False,
        base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        threads: int | None = 0,
        # end
        measure: bool = False,
        files: Literal["never", "if_needed", "always"] | None = None,
        max_memory: int | None = None,
        workspace: _Path | None = None,
        progress: _Progress | None = None,
    ) -> MergeResult: ...
    @property
    def renewed(self) -> tuple[int, int]: ...
    def forget(self) -> None: ...

@final
class MergeResult:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def report(self) -> MergeReport: ...
    @property
    def distances(self) -> NDArray[np.float64] | None: ...

@final
class Job:
    @staticmethod
    def dominant_plane(
        scans: Iterable[_Alignable],
        *,
        # options: plane
        tolerance: float | None = None,
        min_share: float | None = 0.05,
        margin: float | None = None,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def align(
        scans: Iterable[_Alignable],
        *,
        # options: align
        start: Literal["auto", "unknown", "rough", "sequence"] | None = "auto",
        reach: float | None = None,
        turntable: Literal["no", "turned", "equal"] | None = "no",
        tolerance: float | None = None,
        min_overlap: float | None = 0.03,
        use_colour: bool | None = True,
        threads: int | None = 0,
        # end
        fixed: Iterable[int] | None = None,
        picks: Iterable[_Picked] | None = None,
        trusted: Iterable[tuple[int, int]] | None = None,
        rejected: Iterable[tuple[int, int]] | None = None,
        axis: tuple[ArrayLike, ArrayLike] | None = None,
        angles: ArrayLike | None = None,
    ) -> Job: ...
    @staticmethod
    def aligner(
        scans: Iterable[_Alignable],
        *,
        # options: align only threads
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def merge(
        scans: Iterable[_Mergeable] | Merger,
        *,
        # options: merge
        voxel: float | None = None,
        merge_distance: float | None = None,
        max_hole_length: float | None = None,
        min_component_share: float | None = 0.0,
        match_exposure: bool | None = True,
        close: Literal["all", "seen", "holes", "none"] | None = "holes",
        flat_base: bool | None = False,
        base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        threads: int | None = 0,
        # end
        measure: bool = False,
        files: Literal["never", "if_needed", "always"] | None = None,
        max_memory: int | None = None,
        workspace: _Path | None = None,
    ) -> Job: ...
    @staticmethod
    def merge_to_file(
        scans: Iterable[_Mergeable],
        path: _File,
        *,
        # options: merge
        voxel: float | None = None,
        merge_distance: float | None = None,
        max_hole_length: float | None = None,
        min_component_share: float | None = 0.0,
        match_exposure: bool | None = True,
        close: Literal["all", "seen", "holes", "none"] | None = "holes",
        flat_base: bool | None = False,
        base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        threads: int | None = 0,
        # end
        max_memory: int | None = None,
        workspace: _Path | None = None,
        keep: bool = False,
        encoding: Literal["binary", "binary_double"] | None = None,
        part_triangles: int | None = None,
        provenance: Mapping[str, Any] | None = None,
    ) -> Job: ...
    @staticmethod
    def sculptor(
        image: RangeImage,
        *,
        # options: sculpt but tolerance relative_tolerance
        effort: int | None = 1,
        interpolate: bool | None = True,
        min_angle: float | None = 0.0,
        simplify_borders: bool | None = False,
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def refine(
        sculptor: Sculptor,
        *,
        # options: sculpt only tolerance relative_tolerance
        tolerance: float | None = None,
        relative_tolerance: float | None = 0.001,
        # end
    ) -> Job: ...
    @staticmethod
    def surface(
        reconstructor: Reconstructor,
        *,
        # options: reconstruct
        factor: float | None = 1.0,
        threshold: Literal["local", "global"] | None = "local",
        topology: Literal["manifold", "free"] | None = "manifold",
        closure: Literal["auto", "closed", "open"] | None = "auto",
        smooth: float | None = None,
        noisy_points: Literal["moved", "put_back", "as_clean"] | None = "moved",
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def distances(
        points: ArrayLike,
        mesh: Mesh | Iterable[_Mergeable],
        *,
        signed: bool = False,
        crs: str | None = None,
        threads: int | None = None,
    ) -> Job: ...
    @staticmethod
    def surface_distance(mesh: Mesh, reference: Mesh, *, signed: bool = False, threads: int | None = None) -> Job: ...
    @staticmethod
    def virtual_scan(
        mesh: Mesh,
        cameras: Camera | Sequence[Camera],
        *,
        # options: scan
        noise: float | None = 0.0,
        noise_grazing: float | None = 0.0,
        quantum: float | None = 0.0,
        dropout: float | None = 0.0,
        dropout_grazing: float | None = 0.0,
        max_range: float | None = None,
        backfaces: bool | None = False,
        pose_shift: float | None = 0.0,
        pose_turn: float | None = 0.0,
        seed: int | None = 0,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def open(
        paths: _File | Sequence[_File],
        *,
        # options: open
        scale: float | None = None,
        offset: float | None = 0.0,
        step: float | None = None,
        invalid: float | None = None,
        depth: Literal["planar", "ray"] | None = "planar",
        pixels: Literal["auto", "number", "terrain_rgb", "terrarium"] | None = "auto",
        max_decoded_gib: float | None = 4.0,
        allow_outside: bool | None = False,
        poses: Literal["auto", "camera_to_world", "world_to_camera"] | None = "auto",
        axes: Literal["auto", "y_down", "y_up"] | None = "auto",
        # end
        camera: tuple[float, float, float, float] | None = None,
        crs: str | None = None,
    ) -> Job: ...
    @staticmethod
    def read(scans: Sequence[Scan]) -> Job: ...
    @staticmethod
    def adaptive_quads(
        image: RangeImage,
        *,
        # options: quads
        tiles_down: int | None = None,
        tiles_across: int | None = None,
        rows: int | None = 9,
        columns: int | None = 9,
        max_error: float | None = None,
        rms_error: float | None = None,
        gap_passes: int | None = 1,
        gap_neighbours: int | None = 8,
        curvature_unit: float | None = 0.001,
        curvature_limit: int | None = 255,
        exponent: float | None = 0.7,
        floor: float | None = 2.0,
        smoothing: float | None = 2.0,
        background_curvature: int | None = None,
        coverage: float | None = 0.5,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def cluster(
        mesh: Mesh | PointCloud | ArrayLike,
        *,
        # options: cluster
        vertices: int | None = None,
        patches: int | None = None,
        max_error: float | None = None,
        triangles: int | None = None,
        adaptivity: float | None = 1.0,
        iterations: int | None = 40,
        relaxation: int | None = 50,
        fitting: int | None = 0,
        min_angle: float | None = 0.0,
        feature_angle: float | None = 0.6981317007977318,
        seed: int | None = 0,
        threads: int | None = 0,
        # end
        levels: Sequence[int] | None = None,
        levels_of: Literal["vertices", "triangles"] | None = None,
    ) -> Job: ...
    def progress(self) -> tuple[str, float]: ...
    def cancel(self) -> None: ...
    def done(self) -> bool: ...
    def result(self) -> Any: ...
    # types of Job
    @staticmethod
    def check_print(
        mesh: Mesh,
        *,
        # options: check_print
        min_wall: float | None = None,
        max_wall: float | None = None,
        overhang: float | None = 0.7853981633974483,
        print_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        printer_width: float | None = None,
        printer_depth: float | None = None,
        printer_height: float | None = None,
        density: float | None = None,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def close(
        mesh: Mesh,
        scans: Iterable[_Alignable] | None = None,
        *,
        # options: close
        openings: Literal["all", "seen", "holes", "none"] | None = "all",
        max_hole_length: float | None = None,
        cell: float | None = None,
        merge_distance: float | None = None,
        flat_base: bool | None = False,
        force: bool | None = False,
        base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        base_depth: float | None = 0.0,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def prepare_print(
        mesh: Mesh,
        *,
        # options: prepare_print
        scale_to: float | None = None,
        scale_side: Literal["longest", "height"] | None = "longest",
        flat_base: bool | None = False,
        base_height: float | None = None,
        min_wall: float | None = None,
        hollow: float | None = None,
        hollow_cell: float | None = None,
        drain: float | None = None,
        drain_sides: int | None = 32,
        printer_width: float | None = None,
        printer_depth: float | None = None,
        printer_height: float | None = None,
        print_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def texture(
        mesh: Mesh,
        detail: Mesh,
        photos: Iterable[Photo] | None = None,
        *,
        # options: texture
        size: int | None = 2048,
        refine_cameras: bool | None = True,
        match_exposure: bool | None = True,
        drop_highlights: bool | None = True,
        normal_map: bool | None = False,
        height_map: bool | None = False,
        occlusion_rays: int | None = 0,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    @staticmethod
    def unwrap(
        mesh: Mesh,
        *,
        # options: unwrap
        tiles: int | None = None,
        texels_per_unit: float | None = None,
        size: int | None = 2048,
        padding: int | None = 4,
        cone: float | None = 1.2217304763960306,
        max_stretch: float | None = 4.0,
        threads: int | None = 0,
        # end
    ) -> Job: ...
    # end of types of Job

@final
class Camera:
    @staticmethod
    def orthographic(
        rows: int, cols: int, *, spacing: float, target: _Vector, toward: _Vector, up: _Vector | None = None
    ) -> Camera: ...
    @staticmethod
    def pinhole(
        rows: int, cols: int, *, height_angle: float, eye: _Vector, target: _Vector, up: _Vector | None = None
    ) -> Camera: ...
    @staticmethod
    def intrinsic(
        rows: int,
        cols: int,
        *,
        focal: tuple[float, float],
        centre: tuple[float, float],
        world_from_sensor: ArrayLike,
    ) -> Camera: ...
    @staticmethod
    def spherical(
        rows: int, cols: int, *, lowest: float, highest: float, eye: _Vector, up: _Vector | None = None
    ) -> Camera: ...
    @property
    def rows(self) -> int: ...
    @property
    def cols(self) -> int: ...
    @property
    def projection(self) -> dict[str, Any]: ...
    @property
    def world_from_sensor(self) -> _Matrix: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __reduce__(self) -> tuple[Any, tuple[str, dict[str, Any]]]: ...

def open(
    paths: _File | Iterable[_File],
    *,
    # options: open
    scale: float | None = None,
    offset: float | None = 0.0,
    step: float | None = None,
    invalid: float | None = None,
    depth: Literal["planar", "ray"] | None = "planar",
    pixels: Literal["auto", "number", "terrain_rgb", "terrarium"] | None = "auto",
    max_decoded_gib: float | None = 4.0,
    allow_outside: bool | None = False,
    poses: Literal["auto", "camera_to_world", "world_to_camera"] | None = "auto",
    axes: Literal["auto", "y_down", "y_up"] | None = "auto",
    # end
    camera: tuple[float, float, float, float] | None = None,
    crs: str | None = None,
) -> ScanSet: ...
def read(path: _File, **options: Any) -> _Content: ...
def recording_of(path: _Path) -> Path | None: ...
def write(
    path: _File,
    content: _Content | Sequence[RangeImage],
    *,
    provenance: Mapping[str, Any] | None = None,
    progress: _Progress | None = None,
    **options: Any,
) -> None: ...
def write_scans(
    path: _File,
    images: Sequence[RangeImage],
    *,
    provenance: Mapping[str, Any] | None = None,
    progress: _Progress | None = None,
) -> None: ...
def provenance(path: _File) -> dict[str, Any] | None: ...
def crs_note(
    path: _Path, content: Literal["mesh", "quads", "points", "image", "images"], crs: str | None
) -> str | None: ...
def formats(
    *, written: Literal["mesh", "quads", "points", "image", "images"] | None = None
) -> dict[str, list[str]]: ...

@final
class Context:
    def __new__(
        cls, *, threads: int = 0, memory_limit: int | None = None, log: Callable[[int, str], object] | None = None
    ) -> Context: ...
    @property
    def threads(self) -> int: ...
    @property
    def memory_limit(self) -> int | None: ...
    @property
    def log(self) -> Callable[[int, str], object] | None: ...
    def __enter__(self) -> Context: ...
    def __exit__(self, *_raised: object) -> None: ...

def set_memory_limit(bytes: int | None) -> None: ...
def memory_limit() -> int | None: ...
def memory_foreseen() -> int: ...
def memory_in_use() -> int: ...
def memory_peak(*, restart: bool = False) -> int: ...
def linear_colours(colours: NDArray[np.uint8]) -> NDArray[np.float32]: ...
def parameters(operation: str | None = None) -> list[Parameter]: ...
def operations() -> list[Operation]: ...
def figures(operation: str | None = None) -> list[Figure]: ...
def dominant_plane(
    scans: Iterable[_Alignable],
    *,
    # options: plane
    tolerance: float | None = None,
    min_share: float | None = 0.05,
    margin: float | None = None,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Plane: ...
@overload
def keep(  # type: ignore[overload-overlap]
    scans: ScanSet, region: Box | Plane | Iterable[ArrayLike | None], *, progress: _Progress | None = None
) -> ScanSet: ...
@overload
def keep(
    scans: Iterable[_Alignable],
    region: Box | Plane | Iterable[ArrayLike | None],
    *,
    progress: _Progress | None = None,
) -> list[Any]: ...
@overload
def remove(  # type: ignore[overload-overlap]
    scans: ScanSet, region: Box | Plane | Iterable[ArrayLike | None], *, progress: _Progress | None = None
) -> ScanSet: ...
@overload
def remove(
    scans: Iterable[_Alignable],
    region: Box | Plane | Iterable[ArrayLike | None],
    *,
    progress: _Progress | None = None,
) -> list[Any]: ...
@overload
def transformed(  # type: ignore[overload-overlap]
    scans: ScanSet, similarity: Similarity | ArrayLike, *, progress: _Progress | None = None
) -> ScanSet: ...
@overload
def transformed(
    scans: Iterable[_Alignable], similarity: Similarity | ArrayLike, *, progress: _Progress | None = None
) -> list[Any]: ...
def true_size(a: ArrayLike, b: ArrayLike, distance: float) -> Similarity: ...
def ground(plane: Plane, *, up: _Axis | ArrayLike = "z") -> Similarity: ...
def align(
    scans: Iterable[_Alignable],
    *,
    # options: align
    start: Literal["auto", "unknown", "rough", "sequence"] | None = "auto",
    reach: float | None = None,
    turntable: Literal["no", "turned", "equal"] | None = "no",
    tolerance: float | None = None,
    min_overlap: float | None = 0.03,
    use_colour: bool | None = True,
    threads: int | None = 0,
    # end
    fixed: Iterable[int] | None = None,
    picks: Iterable[_Picked] | None = None,
    trusted: Iterable[tuple[int, int]] | None = None,
    rejected: Iterable[tuple[int, int]] | None = None,
    axis: tuple[ArrayLike, ArrayLike] | None = None,
    angles: ArrayLike | None = None,
    progress: _Progress | None = None,
) -> Alignment: ...
def merge(
    scans: Iterable[_Mergeable],
    *,
    # options: merge
    voxel: float | None = None,
    merge_distance: float | None = None,
    max_hole_length: float | None = None,
    min_component_share: float | None = 0.0,
    match_exposure: bool | None = True,
    close: Literal["all", "seen", "holes", "none"] | None = "holes",
    flat_base: bool | None = False,
    base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
    edge_limit: float | None = None,
    grazing_limit: float | None = 1.5707963267948966,
    threads: int | None = 0,
    # end
    measure: bool = False,
    files: Literal["never", "if_needed", "always"] | None = None,
    max_memory: int | None = None,
    workspace: _Path | None = None,
    progress: _Progress | None = None,
) -> MergeResult: ...
def merge_to_file(
    scans: Iterable[_Mergeable],
    path: _File,
    *,
    # options: merge
    voxel: float | None = None,
    merge_distance: float | None = None,
    max_hole_length: float | None = None,
    min_component_share: float | None = 0.0,
    match_exposure: bool | None = True,
    close: Literal["all", "seen", "holes", "none"] | None = "holes",
    flat_base: bool | None = False,
    base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
    edge_limit: float | None = None,
    grazing_limit: float | None = 1.5707963267948966,
    threads: int | None = 0,
    # end
    max_memory: int | None = None,
    workspace: _Path | None = None,
    keep: bool = False,
    encoding: Literal["binary", "binary_double"] | None = None,
    part_triangles: int | None = None,
    provenance: Mapping[str, Any] | None = None,
    progress: _Progress | None = None,
) -> MergeReport: ...
def _again(kind: str, parts: dict[str, Any]) -> Any: ...
def _check_file_in_pieces(path: _Path, encoding: str | None = None) -> None: ...
def _nearest(given: str, known: Sequence[str]) -> str | None: ...
def _open_many(
    paths: _File | Iterable[_File],
    *,
    unplaced: bool = False,
    camera: tuple[float, float, float, float] | None = None,
    crs: str | None = None,
    **options: Any,
) -> ScanSet: ...
def _part_path(path: _Path, number: int, count: int) -> str: ...
def _merge_stages(tasks: int) -> list[tuple[str, int]]: ...
def _merge_task(
    scans: Iterable[_Mergeable],
    folder: _Path,
    stage: str,
    number: int,
    *,
    tasks: int,
    keep: bool = False,
    has_a_part: bool = False,
    max_memory: int | None = None,
    progress: _Progress | None = None,
    **options: Any,
) -> None: ...
def _merge_tasks_to_file(
    scans: Iterable[_Mergeable],
    folder: _Path,
    path: _File,
    *,
    tasks: int,
    keep: bool = False,
    has_a_part: bool = False,
    max_memory: int | None = None,
    encoding: str | None = None,
    part_triangles: int | None = None,
    provenance: Mapping[str, Any] | None = None,
    progress: _Progress | None = None,
    **options: Any,
) -> MergeReport: ...
def _end_merge_tasks(
    scans: Iterable[_Mergeable],
    folder: _Path,
    *,
    tasks: int,
    keep: bool = False,
    has_a_part: bool = False,
    max_memory: int | None = None,
    **options: Any,
) -> None: ...

@final
class Clustered:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def labels(self) -> NDArray[np.int32]: ...
    @property
    def report(self) -> ClusterReport: ...

def cluster(
    mesh: Mesh | PointCloud | ArrayLike,
    *,
    # options: cluster
    vertices: int | None = None,
    patches: int | None = None,
    max_error: float | None = None,
    triangles: int | None = None,
    adaptivity: float | None = 1.0,
    iterations: int | None = 40,
    relaxation: int | None = 50,
    fitting: int | None = 0,
    min_angle: float | None = 0.0,
    feature_angle: float | None = 0.6981317007977318,
    seed: int | None = 0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Clustered: ...
def cluster_levels(
    mesh: Mesh | PointCloud | ArrayLike,
    vertices: Sequence[int],
    *,
    # options: cluster but vertices patches max_error triangles
    adaptivity: float | None = 1.0,
    iterations: int | None = 40,
    relaxation: int | None = 50,
    fitting: int | None = 0,
    min_angle: float | None = 0.0,
    feature_angle: float | None = 0.6981317007977318,
    seed: int | None = 0,
    threads: int | None = 0,
    # end
    levels_of: Literal["vertices", "triangles"] | None = None,
    progress: _Progress | None = None,
) -> list[Clustered]: ...

@final
class QuadGrid:
    @property
    def rows(self) -> int: ...
    @property
    def columns(self) -> int: ...
    @property
    def grid(self) -> NDArray[np.float64]: ...
    @property
    def pixels(self) -> NDArray[np.uint32]: ...
    @property
    def background(self) -> NDArray[np.bool_]: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    def positions_f32(self) -> NDArray[np.float32]: ...
    @property
    def quads(self) -> NDArray[np.uint32]: ...
    @property
    def uvs(self) -> NDArray[np.float32]: ...
    @property
    def vertex_attributes(self) -> _Attributes: ...
    @property
    def face_attributes(self) -> _Attributes: ...
    def triangles(self) -> Mesh: ...
    def spline(
        self,
        *,
        # options: spline
        order: int | None = 4,
        rows: int | None = None,
        columns: int | None = None,
        # end
        progress: _Progress | None = None,
    ) -> Spline: ...
    def write(self, path: _File, *, provenance: Mapping[str, Any] | None = None) -> None: ...
    @property
    def report(self) -> QuadReport: ...

@final
class Spline:
    @property
    def order(self) -> int: ...
    @property
    def control(self) -> NDArray[np.float64]: ...
    @property
    def mirrored(self) -> bool: ...
    @property
    def knots(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    @property
    def max_residual(self) -> float: ...
    @property
    def rms_residual(self) -> float: ...
    def evaluate(self, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]: ...
    def write(self, path: _File, rows: int, columns: int) -> None: ...

def adaptive_quads(
    image: RangeImage,
    *,
    # options: quads
    tiles_down: int | None = None,
    tiles_across: int | None = None,
    rows: int | None = 9,
    columns: int | None = 9,
    max_error: float | None = None,
    rms_error: float | None = None,
    gap_passes: int | None = 1,
    gap_neighbours: int | None = 8,
    curvature_unit: float | None = 0.001,
    curvature_limit: int | None = 255,
    exponent: float | None = 0.7,
    floor: float | None = 2.0,
    smoothing: float | None = 2.0,
    background_curvature: int | None = None,
    coverage: float | None = 0.5,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> QuadGrid: ...

@final
class Sculpted:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def max_error(self) -> float: ...
    @property
    def max_error_single(self) -> float: ...
    @property
    def rms_error(self) -> float: ...
    @property
    def p95_error(self) -> float: ...
    @property
    def worst_pixel(self) -> tuple[int, int] | None: ...
    @property
    def error_image(self) -> NDArray[np.float32]: ...
    @property
    def report(self) -> SculptReport: ...

@final
class Sculptor:
    def __new__(
        cls,
        image: RangeImage,
        *,
        # options: sculpt but tolerance relative_tolerance
        effort: int | None = 1,
        interpolate: bool | None = True,
        min_angle: float | None = 0.0,
        simplify_borders: bool | None = False,
        edge_limit: float | None = None,
        grazing_limit: float | None = 1.5707963267948966,
        threads: int | None = 0,
        # end
        progress: _Progress | None = None,
    ) -> Sculptor: ...
    @property
    def depth_extent(self) -> float: ...
    def refine(
        self,
        *,
        # options: sculpt only tolerance relative_tolerance
        tolerance: float | None = None,
        relative_tolerance: float | None = 0.001,
        # end
        progress: _Progress | None = None,
    ) -> Sculpted: ...
    def at_most(self, triangles: int, *, progress: _Progress | None = None) -> Sculpted: ...
    def levels(self, tolerances: Sequence[float], *, progress: _Progress | None = None) -> list[Sculpted]: ...

def sculpt(
    image: RangeImage,
    *,
    # options: sculpt
    tolerance: float | None = None,
    relative_tolerance: float | None = 0.001,
    effort: int | None = 1,
    interpolate: bool | None = True,
    min_angle: float | None = 0.0,
    simplify_borders: bool | None = False,
    edge_limit: float | None = None,
    grazing_limit: float | None = 1.5707963267948966,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Sculpted: ...

@final
class Reconstructed:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def dropped(self) -> dict[str, NDArray[np.uint32]]: ...
    @property
    def report(self) -> ReconstructReport: ...

@final
class Reconstructor:
    def __new__(
        cls,
        points: PointCloud | ArrayLike,
        *,
        normals: ArrayLike | None = None,
        colour: ArrayLike | None = None,
        sensors: ArrayLike | None = None,
        toward: ArrayLike | None = None,
    ) -> Reconstructor: ...
    def surface(
        self,
        *,
        # options: reconstruct
        factor: float | None = 1.0,
        threshold: Literal["local", "global"] | None = "local",
        topology: Literal["manifold", "free"] | None = "manifold",
        closure: Literal["auto", "closed", "open"] | None = "auto",
        smooth: float | None = None,
        noisy_points: Literal["moved", "put_back", "as_clean"] | None = "moved",
        threads: int | None = 0,
        # end
        progress: _Progress | None = None,
    ) -> Reconstructed: ...

def reconstruct(
    points: PointCloud | ArrayLike,
    *,
    # options: reconstruct
    factor: float | None = 1.0,
    threshold: Literal["local", "global"] | None = "local",
    topology: Literal["manifold", "free"] | None = "manifold",
    closure: Literal["auto", "closed", "open"] | None = "auto",
    smooth: float | None = None,
    noisy_points: Literal["moved", "put_back", "as_clean"] | None = "moved",
    threads: int | None = 0,
    # end
    normals: ArrayLike | None = None,
    colour: ArrayLike | None = None,
    sensors: ArrayLike | None = None,
    toward: ArrayLike | None = None,
    progress: _Progress | None = None,
) -> Reconstructed: ...
def sculpture(*, cell: float | None = None, threads: int | None = None, progress: _Progress | None = None) -> Mesh: ...
def turntable(
    mesh: Mesh,
    *,
    around: int | None = None,
    above: int | None = None,
    below: int | None = None,
    elevation: float | None = None,
    up: _Vector | None = None,
    pixels: int | None = None,
    height_angle: float | None = None,
) -> list[Camera]: ...
@overload
def virtual_scan(
    mesh: Mesh,
    cameras: Camera,
    *,
    # options: scan
    noise: float | None = 0.0,
    noise_grazing: float | None = 0.0,
    quantum: float | None = 0.0,
    dropout: float | None = 0.0,
    dropout_grazing: float | None = 0.0,
    max_range: float | None = None,
    backfaces: bool | None = False,
    pose_shift: float | None = 0.0,
    pose_turn: float | None = 0.0,
    seed: int | None = 0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> RangeImage: ...
@overload
def virtual_scan(
    mesh: Mesh,
    cameras: Sequence[Camera],
    *,
    # options: scan
    noise: float | None = 0.0,
    noise_grazing: float | None = 0.0,
    quantum: float | None = 0.0,
    dropout: float | None = 0.0,
    dropout_grazing: float | None = 0.0,
    max_range: float | None = None,
    backfaces: bool | None = False,
    pose_shift: float | None = 0.0,
    pose_turn: float | None = 0.0,
    seed: int | None = 0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> list[RangeImage]: ...
def nearest_triangles(
    points: ArrayLike, mesh: Mesh, *, threads: int | None = None, progress: _Progress | None = None
) -> NDArray[np.uint32]: ...
def distances(
    points: ArrayLike,
    mesh: Mesh | Iterable[_Mergeable],
    *,
    signed: bool = False,
    crs: str | None = None,
    threads: int | None = None,
    progress: _Progress | None = None,
) -> NDArray[np.float64]: ...
def surface_distance(
    mesh: Mesh,
    reference: Mesh,
    *,
    signed: bool = False,
    threads: int | None = None,
    progress: _Progress | None = None,
) -> DistanceReport: ...

# types

@final
class Checked:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def crossings(self) -> NDArray[np.uint32]: ...
    @property
    def report(self) -> PrintReport: ...

def check_print(
    mesh: Mesh,
    *,
    # options: check_print
    min_wall: float | None = None,
    max_wall: float | None = None,
    overhang: float | None = 0.7853981633974483,
    print_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
    printer_width: float | None = None,
    printer_depth: float | None = None,
    printer_height: float | None = None,
    density: float | None = None,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Checked: ...

@final
class Closed:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def report(self) -> CloseReport: ...

def close(
    mesh: Mesh,
    scans: Iterable[_Alignable] | None = None,
    *,
    # options: close
    openings: Literal["all", "seen", "holes", "none"] | None = "all",
    max_hole_length: float | None = None,
    cell: float | None = None,
    merge_distance: float | None = None,
    flat_base: bool | None = False,
    force: bool | None = False,
    base_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
    base_depth: float | None = 0.0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Closed: ...

@final
class Photo:
    def __new__(
        cls,
        name: str,
        pixels: ArrayLike | Callable[[], ArrayLike],
        focal: tuple[float, float],
        centre: tuple[float, float],
        world_from_camera: ArrayLike,
        depths: ArrayLike | None = None,
        *,
        shape: tuple[int, int] | None = None,
    ) -> Photo: ...
    @property
    def name(self) -> str: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def focal(self) -> tuple[float, float]: ...
    @property
    def centre(self) -> tuple[float, float]: ...
    @property
    def world_from_camera(self) -> _Matrix: ...
    def read(self) -> NDArray[np.uint8]: ...
    def read_depths(self) -> NDArray[np.float32] | None: ...

@final
class Prepared:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def parts(self) -> list[Mesh]: ...
    @property
    def report(self) -> PrepareReport: ...

def prepare_print(
    mesh: Mesh,
    *,
    # options: prepare_print
    scale_to: float | None = None,
    scale_side: Literal["longest", "height"] | None = "longest",
    flat_base: bool | None = False,
    base_height: float | None = None,
    min_wall: float | None = None,
    hollow: float | None = None,
    hollow_cell: float | None = None,
    drain: float | None = None,
    drain_sides: int | None = 32,
    printer_width: float | None = None,
    printer_depth: float | None = None,
    printer_height: float | None = None,
    print_up: Literal["z", "y", "x", "minus_z", "minus_y", "minus_x"] | None = "z",
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Prepared: ...

@final
class Textured:
    @property
    def size(self) -> int: ...
    @property
    def tiles(self) -> list[TextureTile]: ...
    @property
    def world_from_camera(self) -> NDArray[np.float64]: ...
    @property
    def report(self) -> TextureReport: ...

@final
class TextureTile:
    @property
    def colour(self) -> NDArray[np.uint8]: ...
    @property
    def mask(self) -> NDArray[np.uint8]: ...
    @property
    def normal(self) -> NDArray[np.uint8] | None: ...
    @property
    def height(self) -> NDArray[np.uint16] | None: ...
    @property
    def occlusion(self) -> NDArray[np.uint8] | None: ...

def texture(
    mesh: Mesh,
    detail: Mesh,
    photos: Iterable[Photo] | None = None,
    *,
    # options: texture
    size: int | None = 2048,
    refine_cameras: bool | None = True,
    match_exposure: bool | None = True,
    drop_highlights: bool | None = True,
    normal_map: bool | None = False,
    height_map: bool | None = False,
    occlusion_rays: int | None = 0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Textured: ...

@final
class Unwrapped:
    @property
    def mesh(self) -> Mesh: ...
    @property
    def uv(self) -> NDArray[np.float32]: ...
    @property
    def source(self) -> NDArray[np.uint32]: ...
    @property
    def chart(self) -> NDArray[np.int32]: ...
    @property
    def report(self) -> UnwrapReport: ...

def unwrap(
    mesh: Mesh,
    *,
    # options: unwrap
    tiles: int | None = None,
    texels_per_unit: float | None = None,
    size: int | None = 2048,
    padding: int | None = 4,
    cone: float | None = 1.2217304763960306,
    max_stretch: float | None = 4.0,
    threads: int | None = 0,
    # end
    progress: _Progress | None = None,
) -> Unwrapped: ...

# end of types
