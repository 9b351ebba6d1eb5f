"""What each call reports; lengths are in the unit of the scans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from ._report import Report

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "AlignReport",
    "AlignedPair",
    "AlignedScan",
    "CheckReport",
    "ClusterReport",
    "DistanceReport",
    "LeftOutReport",
    "MergeReport",
    "QuadReport",
    "ReconstructReport",
    "Report",
    "SculptReport",
    "Snap",
    "TriangleShapes",
    "TurntableFound",
]

_Free: TypeAlias = tuple[Literal["turn", "slide"], list[float], list[float]]


class MergeReport(Report):
    """The figures of a merge, among them those of the paper's tables.

    Attributes:
        scans: Scans merged.
        scan_names: Names of the scans, in their order, not in that of the list: the attribute ``source_scan`` is the
            place in here, and -1 where ``interpolated``.
        input_triangles: Triangles of all scans.
        voxel: Cell size used.
        voxel_reason: What decided that, in words.
        merge_distance: Merge distance used.
        max_hole_length: Longest boundary that was closed.
        overlap_residual: Median distance between overlapping scans along grid lines, as measured; ``None`` where none
            overlap.
        noise: Median standard deviation of the samples along their rays, as measured; 0 where scans are clean.
        noise_across: Of the range images, the median standard deviation of their samples across the rays, that follows
            from how noise grows on surfaces seen at an angle.
        noise_step: Of the range images, the median step that values along the ray are multiples of; 0 for none.
        noise_correlation: Of the range images, the median number of pixels over which errors depend on each other: 1
            for white noise.
        grid: Cells spanned by the scans along x, y and z.
        intersections: Intersections of scans with grid lines.
        seen_through: Edges of the grid whose intersections were dropped: more scans see through there than have a
            surface there. A triangle has about one and a half.
        fused_intersections: Intersections left after fusing.
        artificial_intersections: Artificial intersections that became vertices.
        faces: Triangles made directly (case a), after analysis of the neighbouring cells (case b), by hole filling
            (case c).
        holes: Holes closed, and boundary loops left open.
        dropped_components: Components dropped, those that no scan saw and those below ``min_component_share``, and the
            triangles they had.
        colour_gains: What the red, green and blue light of each scan, in the order of ``scan_names``, was multiplied by
            to make all equally bright; empty where they are, or do not overlap, or differ by more than a factor of
            eight, or that was not asked for.
        working_bytes: Largest number of bytes held by intersections and the surface at once.
        in_files: Whether stages left in files what they leave for each other.
        warnings: A kind and a sentence each, which says what to do. Kinds are ``no_poses`` (no scan has a pose: all are
            depth images that stand at one place), ``apart`` (scans lie many times their noise apart) and ``damaged``
            (files of scans are damaged, and what they held is left out). Empty where all is well.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    scans: int
    scan_names: list[str]
    input_triangles: int
    voxel: float
    voxel_reason: str
    merge_distance: float
    max_hole_length: float
    overlap_residual: float | None
    noise: float
    noise_across: float
    noise_step: float
    noise_correlation: float
    grid: tuple[int, int, int]
    intersections: int
    seen_through: int
    fused_intersections: int
    artificial_intersections: int
    faces: tuple[int, int, int]
    holes: tuple[int, int]
    dropped_components: tuple[int, int]
    colour_gains: list[tuple[float, float, float]]
    working_bytes: int
    in_files: bool
    warnings: list[tuple[str, str]]
    seconds: dict[str, float]


class AlignReport(Report):
    """What was found by ``align``: each scan, each pair, and what the user should know. ``print`` shows the summary.

    Attributes:
        summary: All of it in words, a line each.
        scans: Each scan, in the order given.
        pairs: The pairs of scans of which anything was found.
        groups: Numbers of the scans that are joined, a list a group; the first is the one that is placed.
        placed: Scans that have a pose.
        compared: Pairs that were compared.
        residual: Root mean square distance of the surfaces of all pairs that touch, along normals; ``None`` where none
            do.
        turntable: The turntable, where there was one and it was found; otherwise ``None``.
        messages: What the user should know, a sentence each.
    """

    __slots__ = ()
    summary: list[str]
    scans: list[AlignedScan]
    pairs: list[AlignedPair]
    groups: list[list[int]]
    placed: int
    compared: int
    residual: float | None
    turntable: TurntableFound | None
    messages: list[str]

    def __str__(self) -> str:
        """The summary."""
        return "\n".join(self.summary)


class AlignedScan(Report):
    """What was found of a scan.

    Attributes:
        name: Its name.
        state: ``"placed"``, ``"kept"`` (its pose is as given), ``"apart"`` (joined with others, but these with
            nothing), ``"undecided"`` (its pose was rough and is as given: nothing decides where it belongs) or
            ``"unplaced"``.
        reason: Why it is not placed, or undecided, and what to do; empty if it is placed.
        group: Number of its group: 0 is the one that is placed; ``None`` if it is in none.
        world_from_scan: 4 x 4 float64, its pose in its group, or ``None``. Scans of a group that is not placed lie
            together where the largest of them was given.
        covariance: 6 x 6 float64: covariance of a small motion of it in the world, a turn about ``middle`` (radians),
            then a shift. Zero for scans that are kept.
        middle: The middle of its points, in the world.
        deviation: One standard deviation of the place of its points, where it is largest; at least its size where
            nothing holds it, the reach where it stays undecided, infinite where it has no place.
        free: Ways that nothing holds it: ``("turn" or "slide", direction, point of the axis)``.
        overlap: Share of its surface that lies on the scan that shares most with it.
        residual: Root mean square distance to the surfaces of others, along normals.
        misfit: Root mean square of how far it lies from the others where noise is averaged out: what no rigid pose
            explains, such as warp. Bending within a few samples counts as well, so that some of it is always there.
            ``Alignment.misfit`` says where it is.
        spacing: Median distance of its samples.
    """

    __slots__ = ()
    name: str
    state: Literal["placed", "kept", "apart", "undecided", "unplaced"]
    reason: str
    group: int | None
    world_from_scan: NDArray[np.float64] | None
    covariance: NDArray[np.float64]
    middle: list[float]
    deviation: float
    free: list[_Free]
    overlap: float
    residual: float
    misfit: float
    spacing: float


class AlignedPair(Report):
    """What was found of two scans.

    Attributes:
        scans: Their numbers, the smaller first.
        state: ``"fits"``, ``"misfit"`` (they overlap, but further apart than noise explains), or why the pair was not
            used: ``"slides"``, ``"ambiguous"``, ``"background"``, ``"seen_through"``, ``"disagrees"``, ``"rejected"``.
        overlap: Share of either surface that lies on the other.
        residual: Root mean square distance of the surfaces where they touch, along normals.
        balance: How well it is held against turning and sliding: 1 at best, 0 where it may.
        seen_through: Of what the sensors can tell, the share that speaks against it.
        places: Places in which one fits the other.
        free: Ways that it may turn or slide: ``("turn" or "slide", direction, point of the axis)``.
    """

    __slots__ = ()
    scans: tuple[int, int]
    state: str
    overlap: tuple[float, float]
    residual: float
    balance: float
    seen_through: float
    places: int
    free: list[_Free]


class TurntableFound(Report):
    """A turntable as it was found.

    Attributes:
        axis: ``(point, direction)`` in the frame that the scans were taken in; the direction is of length 1. What
            ``align`` takes.
        angles: By how much it was turned at each scan, in radians from 0 to 2 pi, counter-clockwise where the axis
            points to the viewer; 0 at the first scan that is placed. ``None`` for scans that aren't.
    """

    __slots__ = ()
    axis: tuple[list[float], list[float]]
    angles: list[float | None]


class Snap(Report):
    """Where a scan was drawn to by ``Aligner.snap``, and how well it lies there.

    Attributes:
        world_from_scan: 4 x 4 float64: where it was drawn to; where it was if it touches nothing.
        state: ``"fits"``, ``"misfit"`` (it overlaps, but further apart than noise explains), ``"slides"`` (it fits, but
            may turn or slide), ``"seen_through"`` (sensors saw through where it lies) or ``"nothing"`` (it touches
            nothing, or too little).
        touches: Numbers of the scans that it touches.
        overlap: Share of its surface that lies on the scan that shares most with it.
        residual: Root mean square distance to the surfaces of the others, along normals.
        balance: How well it is held against turning and sliding: 1 at best, 0 where it may.
        seen_through: Of what the sensors can tell, the share that speaks against it.
        moved: How far its points moved, at most.
        free: Ways that it may turn or slide: ``("turn" or "slide", direction, point of the axis)``.
    """

    __slots__ = ()
    world_from_scan: NDArray[np.float64]
    state: Literal["fits", "misfit", "slides", "seen_through", "nothing"]
    touches: list[int]
    overlap: float
    residual: float
    balance: float
    seen_through: float
    moved: float
    free: list[_Free]


class SculptReport(Report):
    """The figures of sculpting.

    Attributes:
        tolerance: Tolerance used.
        depth_extent: Difference between the farthest and the nearest range of the covered samples.
        full_triangles: Triangles of the mesh with every sample.
        hidden_triangles: Those left out because they hide behind others. The tolerance does not hold for samples that
            have only such triangles; these count as isolated.
        dug_triangles: Triangles before vertices were removed.
        triangles: Triangles of the mesh.
        covered_pixels: Samples that the mesh covers.
        isolated_pixels: Valid ones without a triangle.
        max_error: Largest distance between a sample and the mesh along the sample's ray.
        max_error_single: That of the mesh rounded to single precision, at most.
        rms_error: Root of the mean square of the distances.
        p95_error: 95 % of the samples lie at most this far from the mesh.
        worst_pixel: (row, col) of the sample farthest from the mesh, ``None`` for an empty mesh.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    tolerance: float
    depth_extent: float
    full_triangles: int
    hidden_triangles: int
    dug_triangles: int
    triangles: int
    covered_pixels: int
    isolated_pixels: int
    max_error: float
    max_error_single: float
    rms_error: float
    p95_error: float
    worst_pixel: tuple[int, int] | None
    seconds: dict[str, float]


class QuadReport(Report):
    """The figures of a quad grid; those that begin with ``uniform_`` are of the uniform grid of the same size.

    Attributes:
        tiles: Tiles from top to bottom and from left to right.
        depth_extent: Difference between the farthest and the nearest range of the samples.
        relative_error: Mean distance of the samples by depth extent.
        rms_error: Root of the mean square of their distances.
        max_error: Largest distance.
        is_uniform: Whether the grid is the uniform one.
        valid_pixels: Samples.
        missed_pixels: Of them, those whose rays do not meet the grid: they have no error.
        gaps_filled: Invalid pixels that were filled.
        unfolded: Vertices that were moved so that no quad is folded.
        snapped: Vertices that were moved to valid pixels.
        quads: Quads of the mesh.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    tiles: tuple[int, int]
    depth_extent: float
    relative_error: float
    uniform_relative_error: float
    rms_error: float
    uniform_rms_error: float
    max_error: float
    uniform_max_error: float
    is_uniform: bool
    valid_pixels: int
    missed_pixels: int
    uniform_missed_pixels: int
    gaps_filled: int
    unfolded: int
    snapped: int
    quads: int
    seconds: dict[str, float]


class ReconstructReport(Report):
    """The figures of a surface through points.

    Attributes:
        points: Points given.
        used: Those of them that are on the surface.
        tetrahedra: Tetrahedra of the points.
        closed: Whether the surface has no border.
        threshold: A perimeter with a global one, in mean spacings of a facet's points with a local one.
        rounds: Rounds of the paper's carving.
        repaired: Cells that changed sides to make it manifold, points brought onto it afterwards.
        cut_facets: Facets left out over gaps and for the manifold.
        turned_parts: Parts that were turned.
        noise: Standard deviation of the points across the surface; 0 for fewer than 1,024.
        spacing: Side of a square of the surface that has one point.
        smoothing: Radius within which the surface was smoothed, 0 if it goes through the points.
        moved: Root mean square of the distances by which that moved the points on it.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    points: int
    used: int
    tetrahedra: int
    closed: bool
    threshold: float
    rounds: int
    repaired: tuple[int, int]
    cut_facets: int
    turned_parts: int
    noise: float
    spacing: float
    smoothing: float
    moved: float
    seconds: dict[str, float]


class TriangleShapes(Report):
    """How well-shaped triangles are; angles in radians.

    Attributes:
        mean_smallest_angle: Mean of the smallest angle of each.
        smallest_angle: Smallest angle of all.
        largest_angle: Largest angle of all.
        angles: How many of all angles lie in each 5 degrees of 180.
    """

    __slots__ = ()
    mean_smallest_angle: float
    smallest_angle: float
    largest_angle: float
    angles: list[int]


class ClusterReport(Report):
    """The figures of clustering.

    Attributes:
        patches: Patches made.
        vertices: Vertices of the mesh.
        triangles: Triangles of the mesh.
        separated: Parts that became patches.
        dissolved: Patches given to their neighbours.
        halved: Patches that were no disks.
        cut_edges: Edges where the input is no manifold.
        off_surface: Points that are not on the surface through them.
        energy: That of k-means.
        before: Shapes of the triangles before the relaxation.
        after: Shapes of the triangles after it.
        max_error: Where asked for: no point of either surface is farther from the other; else ``None``.
        kept_input: Whether the result is the input, as nothing coarser was found within it, or has the topology.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    patches: int
    vertices: int
    triangles: int
    separated: int
    dissolved: int
    halved: int
    cut_edges: int
    off_surface: int
    energy: float
    before: TriangleShapes
    after: TriangleShapes
    max_error: float | None
    kept_input: bool
    seconds: dict[str, float]


class DistanceReport(Report):
    """How far a surface lies from another.

    Attributes:
        mean: Mean of the absolute distances of the vertices.
        rms: Root of their mean square.
        p95: 95 % of them are at most this.
        max: The largest.
        bias: Mean with signs; without signs the mean.
        reached: Largest distance found, between the vertices too.
        bound: No point of the surface is farther.
        distances: (n,) float64, exact, one a vertex.
    """

    __slots__ = ()
    mean: float
    rms: float
    p95: float
    max: float
    bias: float
    reached: float
    bound: float
    distances: NDArray[np.float64]


class CheckReport(Report):
    """What a mesh is as a surface: counts, and what follows from them.

    Attributes:
        is_manifold: Whether it is what a surface must be: no edge of three triangles, one fan around each vertex,
            turned alike.
        is_closed: Whether it has no border.
        genus: Handles of all parts together; ``None`` unless it is a manifold.
        largest_component: Triangles of the largest part.
        boundary_loops: Borders.
    """

    __slots__ = ()
    triangles: int
    vertices: int
    unused_vertices: int
    non_finite_vertices: int
    out_of_range_triangles: int
    degenerate_triangles: int
    zero_area_triangles: int
    duplicate_triangles: int
    edges: int
    boundary_edges: int
    non_manifold_edges: int
    misoriented_edges: int
    non_manifold_vertices: int
    components: int
    largest_component: int
    boundary_loops: int
    euler_characteristic: int
    is_manifold: bool
    is_closed: bool
    genus: int | None


class LeftOutReport(Report):
    """How many samples of a frame are left out.

    Attributes:
        of: Samples that were measured.
        low_confidence: Those of low confidence.
        out_of_reach: Those beyond the reach of the sensor.
        black_rim: Those of the black rim of a corrected image.
        far: Those far beyond all others of their frame, which stand for no measurement.
    """

    __slots__ = ()
    of: int
    low_confidence: int
    out_of_reach: int
    black_rim: int
    far: int
