"""The reports of calls. Lengths are in the unit of the scans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from ._report import Report

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "AlignReport",
    "AlignedPair",
    "AlignedScan",
    "CheckReport",
    "CloseReport",
    "ClusterReport",
    "DistanceReport",
    "Freedom",
    "LeftOutReport",
    "MergeReport",
    "PrepareReport",
    "PrintReport",
    "QuadReport",
    "ReconstructReport",
    "Report",
    "SculptReport",
    "Snap",
    "TextureReport",
    "TexturedPhoto",
    "TriangleShapes",
    "TurntableFound",
    "UnwrapReport",
]


# reports
class Freedom(Report):
    """A way that a scan may move without leaving the surfaces it lies on.

    >>> report = surfrecon.align(scans).report
    >>> [way.turns for pair in report.pairs if pair.state == "fits" for way in pair.freedoms]
    []

    Attributes:
        turns: Whether it is a turn about an axis. Otherwise it is a slide.
        direction: Unit direction of the axis, or of the slide, in the world.
        point: A point of the axis, in the world.
    """

    __slots__ = ()
    turns: bool
    direction: tuple[float, float, float]
    point: tuple[float, float, float]


class AlignedScan(Report):
    """A scan that was aligned: its pose, and how sure that is.

    >>> report = surfrecon.align(scans).report
    >>> [(scan.name, scan.reason) for scan in report.scans if scan.state == "unplaced"]
    []

    Attributes:
        name: Its name.
        state: State of the scan: placed, kept, or neither. ``"unplaced"``: It has no place: the reason says why.
            ``"placed"``: Its pose was found. ``"kept"``: Its pose is as given: the caller fixed it, or it is the frame
            of the others. ``"apart"``: It was joined with others, but nothing joins these with the first group.
            ``"undecided"``: Its pose is as given: that was rough, and nothing decides where it belongs. The reason says
            why.
        reason: Reason why it is not placed, or stays undecided, and what to do. Empty if it is placed.
        group: Number of its group. 0 is the group that is placed. There is none where the scan is joined with no
            other. Then it is ``None``.
        world_from_scan: Its pose in its group, which is rigid. For the first group it is the result. Scans of
            others lie together where the largest of them was given. There is none where the scan has no group. Then it
            is ``None``. 4 x 4 float64.
        covariance: Covariance of a small motion of it in the world: a turn about ``middle`` in radians, then a
            shift. Zero for scans that are kept. 6 x 6 float64.
        middle: The middle of its points, in the world.
        deviation: One standard deviation of the place of its points: the largest over the scan. It is at least the
            scan's size where nothing holds it, the reach where it stays undecided, and infinite where it has no place.
            In the unit of the scans.
        freedoms: Ways that nothing holds it.
        overlap: Share of its surface that lies on the scan that shares most with it.
        residual: Root mean square distance to the surfaces of others, along normals. 0 where there are none. In the
            unit of the scans.
        misfit: Root mean square of how far it lies from the others where noise is averaged out. No rigid pose
            explains that, but warp does. Bending within a few samples counts as well, so that some of it is always
            there. In the unit of the scans.
        spacing: Median distance of its samples. In the unit of the scans.
    """

    __slots__ = ()
    name: str
    state: Literal["unplaced", "placed", "kept", "apart", "undecided"]
    reason: str
    group: int | None
    world_from_scan: NDArray[np.float64] | None
    covariance: NDArray[np.float64]
    middle: tuple[float, float, float]
    deviation: float
    freedoms: list[Freedom]
    overlap: float
    residual: float
    misfit: float
    spacing: float


class AlignedPair(Report):
    """Two scans that were compared, and how well they fit.

    >>> report = surfrecon.align(scans).report
    >>> [pair.scans for pair in report.pairs if pair.state == "fits"][0]
    (0, 1)

    Attributes:
        scans: Their numbers, the smaller first.
        state: State of the pair: it fits, or why it is not used. ``"nothing"``: No motion was found that lays one
            on the other. ``"fits"``: They overlap and fit, where they lie in the end. ``"misfit"``: They overlap where
            they lie in the end, but surfaces lie further apart than noise explains: warp, or something moved.
            ``"slides"``: They fit, but may turn or slide on each other: not used. ``"ambiguous"``: They fit in several
            places: not used. ``"background"``: The shared part stood still before the sensor while the rest moved: not
            used. ``"seen_through"``: They fit by themselves, but other scans' sensors saw through there: not used.
            ``"disagrees"``: They fit by themselves, but other pairs, that fit better, rough poses or the order of a
            recording say otherwise: not used. ``"rejected"``: The caller rejected it.
        overlap: Share of either surface that lies on the other.
        residual: Root mean square distance of the surfaces where they touch, along normals. In the unit of the
            scans.
        balance: How well the pair is held against turning and sliding: 1 at best, 0 where it may turn or slide.
        seen_through: Of what the sensors can tell, the share that speaks against the pair.
        places: Places in which one fits the other.
        freedoms: Ways that one may turn or slide on the other.
    """

    __slots__ = ()
    scans: tuple[int, int]
    state: Literal[
        "nothing", "fits", "misfit", "slides", "ambiguous", "background", "seen_through", "disagrees", "rejected"
    ]
    overlap: tuple[float, float]
    residual: float
    balance: float
    seen_through: float
    places: int
    freedoms: list[Freedom]


class TurntableFound(Report):
    """A turntable as it was found.

    >>> table = surfrecon.align(scans, turntable="turned").report.turntable
    >>> np.degrees(table.angles).round()
    array([  0.,  60., 120., 180., 240., 300.])

    Attributes:
        axis: Its axis, in the frame that the scans were taken in. The direction is of length 1.
        angles: By how much it was turned at each scan, from 0 to 2 pi, counter-clockwise where the axis points to
            the viewer. 0 at the first scan that is placed. There is none for scans that are not placed. Radians.
    """

    __slots__ = ()
    axis: tuple[tuple[float, float, float], tuple[float, float, float]]
    angles: list[float | None]


class AlignReport(Report):
    """Scans that were aligned, and their pairs.

    >>> report = surfrecon.align(scans).report
    >>> report.placed, report.groups
    (6, [[0, 1, 2, 3, 4, 5]])
    >>> report.summary[0].partition(".")[0]
    '6 of 6 scans placed'

    Attributes:
        scans: Each scan, in the order given.
        pairs: The pairs of which anything was found, by their numbers.
        groups: Numbers of the scans of each group, the placed one first. Only scans that are joined with others, or
            kept, are in one.
        compared: Pairs that were compared.
        residual: Root mean square distance of the surfaces of all pairs that touch, along normals. There is none
            where none touch. Then it is ``None``. In the unit of the scans.
        turntable: The turntable, where there was one and it was found. Then it is ``None``.
        messages: Sentences that the user should know.
        placed: Scans that lie in one frame: those that were placed, and those kept. 0 where a single one was kept
            for want of a place for others.
        summary: All of it in words, a line each. ``print`` shows it.
    """

    __slots__ = ()
    scans: list[AlignedScan]
    pairs: list[AlignedPair]
    groups: list[list[int]]
    compared: int
    residual: float | None
    turntable: TurntableFound | None
    messages: list[str]
    placed: int
    summary: list[str]

    def __str__(self) -> str:
        """The summary."""
        return "\n".join(self.summary)


class MergeReport(Report):
    """The figures of a merge, among them those of the paper's tables.

    >>> report = surfrecon.merge(scans).report
    >>> report.scans, report.scan_names[0], report.voxel_reason
    (6, 'view0', 'spacing')

    Attributes:
        scans: Scans merged.
        scan_names: Names of the scans, in their order, not in that in which they were given. The attribute
            ``source_scan`` is the place in here, and -1 where ``interpolated``.
        input_triangles: Triangles of all scans.
        voxel: Size of a cell that was used. In the unit of the scans.
        voxel_reason: Rule that decided the size of a cell. ``"given"``: The caller gave it. ``"spacing"``: 1.5
            times the mean distance of neighbouring samples. ``"noise"``: Half the median standard deviation of the
            samples. ``"distance"``: 1.5 times the median distance between scans that overlap. ``"memory"``: Coarser
            than that, so that it fits into memory: by the limit and the scans alone, or, where there is no limit, by
            what is free at that moment.
        merge_distance: Merge distance that was used. In the unit of the scans.
        max_hole_length: Longest boundary that was closed. In the unit of the scans.
        overlap_residual: Median distance between overlapping scans along grid lines, as measured. There is none
            where no scans overlap. Then it is ``None``. In the unit of the scans.
        noise: Median standard deviation of the samples along their rays, as measured. 0 where scans are clean. In
            the unit of the scans.
        noise_across: Median standard deviation of the samples of range images across the rays. It follows from how
            noise grows on surfaces seen at an angle. In the unit of the scans.
        noise_step: Median step that values of range images along the ray are multiples of. 0 for none. In the unit
            of the scans.
        noise_correlation: Median number of pixels of range images over which errors depend on each other. 1 for
            white noise.
        grid: Cells that the scans span along x, y and z.
        intersections: Intersections of scans with grid lines.
        seen_through: Edges of the grid whose intersections were dropped since more scans see through there than
            have a surface there. A triangle has about one and a half.
        fused_intersections: Intersections left after fusing.
        artificial_intersections: Artificial intersections that became vertices.
        faces: Triangles made directly (case a), after analysis of the neighbouring cells (case b), by filling holes
            (case c).
        shortest_edge: Length of the shortest edge of the surface. It is at least a hundredth of a cell. In the unit
            of the scans.
        holes: Holes closed, and boundary loops left open.
        holes_seen_through: Holes of these that are open as a scan saw through where they would be closed.
        filled_area: Area that was filled, in the square of the unit of the scans. There is none where holes alone
            were closed. Then it is ``None``.
        filled_share: Share of the area of the surface that was filled. There is none where holes alone were closed.
            Then it is ``None``.
        dropped_components: Connected parts dropped, and the triangles they had. These are parts that no scan saw,
            and those that are too small.
        colour_gains: Factors that the red, green and blue light of each scan was multiplied by to make all equally
            bright, in the order of the names. The list is empty if they are equally bright, do not overlap, differ by
            more than a factor of eight, or this was not asked for.
        working_bytes: Largest number of bytes that intersections and the surface held at once.
        in_files: Whether stages left in files what they leave for each other.
        warnings: Scans that plainly do not lie where they belong, or that were damaged, and what to do. Empty where
            all is well. A kind and a sentence each: ``no_poses``: No scan has a pose: all are depth images that stand
            at one place. ``apart``: Scans that overlap lie many times their noise, and the distance of their samples,
            apart. ``damaged``: Files of scans are damaged: what they held is left out. ``open``: An opening that was to
            be closed is open.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    scans: int
    scan_names: list[str]
    input_triangles: int
    voxel: float
    voxel_reason: Literal["given", "spacing", "noise", "distance", "memory"]
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
    shortest_edge: float
    holes: tuple[int, int]
    holes_seen_through: int
    filled_area: float | None
    filled_share: float | None
    dropped_components: tuple[int, int]
    colour_gains: list[tuple[float, float, float]]
    working_bytes: int
    in_files: bool
    warnings: list[tuple[str, str]]
    seconds: dict[str, float]


class SculptReport(Report):
    """The figures of sculpting.

    >>> report = surfrecon.sculpt(image, tolerance=0.5).report
    >>> report.max_error <= report.tolerance, report.triangles < report.full_triangles
    (True, True)

    Attributes:
        tolerance: Tolerance that was used. In the unit of the scans.
        depth_extent: Difference between the farthest and the nearest range of the covered samples. In the unit of
            the scans.
        full_triangles: Triangles of the mesh that has every covered sample.
        hidden_triangles: Triangles left out because they hide behind others, as seen along the rays. The tolerance
            does not hold for samples that have only such triangles. These samples count as isolated.
        dug_triangles: Triangles before vertices were removed.
        triangles: Triangles of the mesh.
        isolated_pixels: Valid pixels that no mesh covers, for want of neighbours or because they are hidden behind
            others. The tolerance does not hold for them.
        seconds: Wall-clock seconds by the name of the stage.
        max_error: Largest distance between a sample and the mesh along the sample's ray. In the unit of the scans.
        max_error_single: Largest distance once coordinates are rounded to single precision, as STL, GLB and many
            programs keep them, at most. In the unit of the scans.
        rms_error: Root of the mean square of the distances. In the unit of the scans.
        p95_error: 95 % of the samples lie at most this far from the mesh. In the unit of the scans.
        worst_pixel: Row and column of the sample farthest from the mesh. Of several the first one. There is none
            for an empty mesh. Then it is ``None``.
        covered_pixels: Samples that the mesh covers: their rays meet it.
    """

    __slots__ = ()
    tolerance: float
    depth_extent: float
    full_triangles: int
    hidden_triangles: int
    dug_triangles: int
    triangles: int
    isolated_pixels: int
    seconds: dict[str, float]
    max_error: float
    max_error_single: float
    rms_error: float
    p95_error: float
    worst_pixel: tuple[int, int] | None
    covered_pixels: int


class QuadReport(Report):
    """The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the
    pixels' quads, over all valid pixels of the image but those missed, with each quad cut along its better diagonal. On
    the background the grid continues the surface.

    >>> report = surfrecon.adaptive_quads(image).report
    >>> report.rms_error <= report.uniform_rms_error
    True

    Attributes:
        tiles: Tiles from top to bottom and from left to right.
        depth_extent: Difference between the farthest and the nearest range of the valid pixels. In the unit of the
            scans.
        relative_error: Mean error as a share of the depth extent, the paper's relative error. 0 where all ranges
            are equal.
        uniform_relative_error: Relative error of the uniform grid of the same size.
        rms_error: Root of the mean square error. In the unit of the scans.
        uniform_rms_error: Root of the mean square error of the uniform grid. In the unit of the scans.
        max_error: Largest error. In the unit of the scans.
        uniform_max_error: Largest error of the uniform grid. In the unit of the scans.
        is_uniform: Whether the result is the uniform grid, as the adaptive one lay no nearer. Vertices snapped to
            the border moved all the same.
        valid_pixels: Valid pixels of the image.
        missed_pixels: Valid pixels whose rays do not meet the planes of their quad in front of the sensor. They
            have no error.
        uniform_missed_pixels: Missed pixels of the uniform grid.
        gaps_filled: Invalid pixels that were filled.
        unfolded: Vertices that were moved so that no quad folds over.
        snapped: Vertices that were moved from the background onto the border of the surface.
        quads: Quads of the mesh: those that are not on the background.
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

    >>> report = surfrecon.reconstruct(points).report
    >>> report.closed, report.used == report.points
    (True, True)

    Attributes:
        points: Points given.
        used: Points on the surface.
        tetrahedra: Delaunay tetrahedra. None where the points lie in one plane.
        closed: Whether the surface is closed: it has no border, also not one of a gap or of facets left out.
        threshold: The threshold that was used: a perimeter with a global one, in mean spacings of a facet's points
            with a local one.
        rounds: Times the mean perimeter was taken, with the paper's carving or in a plane.
        repaired: Tetrahedra that changed sides to make the surface manifold, and points brought onto it afterwards.
        cut_facets: Facets left out: those over gaps, and those that kept the surface from being manifold.
        turned_parts: Parts turned over by normals, sensors or direction.
        noise: Noise of the points as measured: their standard deviation across the surface. 0 for fewer than 1,024.
            In the unit of the scans.
        spacing: Side of a square of the surface that has one point, as measured. In the unit of the scans.
        smoothing: Radius within which the surface was smoothed. 0 if it goes through the points. It was so many
            times smaller or larger where points that carry noise lie much closer together or further apart than usual.
            In the unit of the scans.
        moved: Root mean square of the distances by which smoothing moved the points on the surface. In the unit of
            the scans.
        seconds: Wall-clock seconds by the name of the stage.
        not_finite: Points dropped since a coordinate isn't finite.
        duplicates: Points dropped since they are at the same place as a point before them.
        inside: Points dropped inside of the surface.
        outside: Points dropped outside of the surface.
        outliers: Points dropped since they are far from any surface that the others tell.
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
    not_finite: int
    duplicates: int
    inside: int
    outside: int
    outliers: int


class TriangleShapes(Report):
    """Shapes of triangles: how well-shaped they are.

    >>> shapes = surfrecon.cluster(mesh, vertices=500).report.after
    >>> shapes.smallest_angle < shapes.mean_smallest_angle < np.pi / 3
    True

    Attributes:
        mean_smallest_angle: Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral.
            Radians.
        smallest_angle: Smallest angle of all. Radians.
        largest_angle: Largest angle of all. Radians.
        angles: Counts of all angles, three per triangle, in steps of 5 degrees.
    """

    __slots__ = ()
    mean_smallest_angle: float
    smallest_angle: float
    largest_angle: float
    angles: list[int]


class ClusterReport(Report):
    """The figures of clustering.

    >>> report = surfrecon.cluster(mesh, vertices=500).report
    >>> report.vertices, report.after.mean_smallest_angle > report.before.mean_smallest_angle
    (500, True)

    Attributes:
        patches: Patches made.
        vertices: Vertices of the mesh.
        triangles: Triangles of the mesh.
        separated: Parts of patches that became patches as they were not connected to the rest.
        dissolved: Parts and patches that were given to their neighbours.
        halved: Patches that were halved as they were no disks.
        cut_edges: Edges of the input that were cut as they don't join two triangles of the same orientation.
        off_surface: Points that are not on the surface through them. 0 for a mesh.
        energy: Weighted sum of the squared distances of the input's vertices to their centres, after the last step
            of k-means.
        before: Shapes of the triangles before they were relaxed.
        after: Shapes of the triangles of the mesh.
        max_error: No point of the input is farther from the mesh, and none of the mesh farther from the input,
            measured on the mesh. Some point is nearly as far: the bound is seldom more than 1 % above it, unless a
            largest error was asked for. 0 for the input itself. In the unit of the scans.
        rms_error: Root mean square of the distances of the input's vertices from the mesh. In the unit of the
            scans.
        kept_input: Whether the mesh is the input, as nothing coarser was found within the largest error, or has its
            topology.
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
    max_error: float
    rms_error: float
    kept_input: bool
    seconds: dict[str, float]


class CloseReport(Report):
    """The figures of closing.

    >>> merged = surfrecon.merge(scans).mesh
    >>> report = surfrecon.close(merged, scans).report
    >>> report.is_closed == (report.open_edges == 0) and sum(report.left) == len(report.open)
    True

    Attributes:
        cell: Size of a cell of the merge that was used. In the unit of the scans.
        fill_cell: Size of a cell of the fill. It is twice a cell of the merge, more where memory asks for it. 0 if
            nothing was filled. In the unit of the scans.
        merge_distance: Merge distance that was used. In the unit of the scans.
        max_hole_length: Longest boundary that was closed. There is none where length does not matter. Then it is
            ``None``. In the unit of the scans.
        has_sight: Whether scans said where nothing is. Without them openings are closed by their shape alone.
        closed: Openings closed.
        left: Openings left open, wholly or in part, by reason.
        open: The openings left open, each with its place, its reason and what to do. A kind and a sentence each:
            ``not_asked``: No opening was to be closed. ``too_long``: Its boundary is longer than the longest hole.
            ``not_enclosed``: Seen space does not surround what lies before it: a rim, or a border of what was scanned.
            ``seen_through``: A scan saw through where it would be closed. ``crossing``: Any fill would cross the
            surface. ``base``: The flat base cuts through where it would be closed. ``inside_out``: The surface is so
            thin there that its fill would turn it inside out.
        warnings: Doubts about the surface and its scans: a surface that seems to be inside out, scans that do not
            meet it. A kind and a sentence each: ``elsewhere``: A scan does not meet the surface. ``inside_out``: Scans
            saw through behind the surface. ``looks_inward``: Without scans: the surface looks toward its own middle.
        largest_opening: Length of the longest boundary of an opening that was closed. In the unit of the scans.
        added: Vertices and triangles that were added.
        filled_area: Area of the triangles that were added, in the square of the unit of the surface.
        filled_share: Share of the result's area that was filled.
        forced_triangles: Triangles that were filled where a scan saw through, as was asked for.
        open_edges: Edges that are left open.
        is_closed: Whether the result is a closed manifold.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    cell: float
    fill_cell: float
    merge_distance: float
    max_hole_length: float | None
    has_sight: bool
    closed: int
    left: tuple[int, int, int, int, int, int, int]
    open: list[tuple[str, str]]
    warnings: list[tuple[str, str]]
    largest_opening: float
    added: tuple[int, int]
    filled_area: float
    filled_share: float
    forced_triangles: int
    open_edges: int
    is_closed: bool
    seconds: dict[str, float]


class PrintReport(Report):
    """The figures of the checks for printing.

    >>> report = surfrecon.check_print(mesh).report
    >>> report.is_closed, report.crossing_pairs, report.bodies
    (True, 0, 1)

    Attributes:
        findings: Faults with their remedies. There are none if the mesh can be printed as it is. A kind and a
            sentence each: ``not_manifold``: Edges of three faces, faces that are turned, or other places that bound no
            body. ``open``: Openings: the mesh bounds no body. ``crossing``: Faces that cross each other.
            ``inside_out``: Bodies whose outside is inside. Cavities are no such bodies. ``no_volume``: Closed, but
            nothing is inside. ``too_large``: Larger than the printer. ``thin``: Walls thinner than the printer makes.
            ``overhang``: Faces that hang over. ``nested``: Bodies in the solid of others. ``several_bodies``: Several
            bodies that hang together nowhere.
        is_closed: Whether the mesh is an oriented manifold without openings.
        is_manifold: Whether it is an oriented manifold, with or without openings.
        openings: Openings: groups of open edges that hang together.
        open_edges: Edges of one face.
        non_manifold_edges: Edges of more than two faces.
        non_manifold_vertices: Vertices at which more than one fan of faces meets.
        misoriented_edges: Edges whose two faces are turned against each other.
        crossing_pairs: Pairs of faces that cross. This is exact.
        crossing_faces: Faces that cross another.
        bodies: Bodies: faces joined over edges. A cavity is a body, too.
        size: Size along x, y and z. In the unit of the scans.
        is_fitting: Whether it fits into the printer, as it is or turned by a quarter about the vertical.
        volume: Volume of all bodies together, in the cube of the unit of the mesh. There is none unless the mesh is
            closed. Then it is ``None``.
        weight: Volume times density. There is none without either. Then it is ``None``.
        wall_limit: Thickness up to which walls are measured. In the unit of the scans.
        thinnest_wall: Thickness of the thinnest wall. There is none if no wall is thinner than they are measured.
            Then it is ``None``. In the unit of the scans.
        thinnest_face: Number of the face in front of the thinnest wall, counted from 0. There is none without such
            a wall. Then it is ``None``.
        thin_faces: Faces whose walls are thinner than the thinnest wall that the printer makes, by more than the
            error of measuring, 2 %.
        wall_spacing: Largest distance of a corner from the centre of its face. Walls are measured at centres. Where
            faces are larger than walls are thick, a wall may be thinner between them. In the unit of the scans.
        overhang_faces: Faces that hang over and do not lie on the ground.
        overhang_area: Area of the faces that hang over, in the square of the unit of the mesh.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    findings: list[tuple[str, str]]
    is_closed: bool
    is_manifold: bool
    openings: int
    open_edges: int
    non_manifold_edges: int
    non_manifold_vertices: int
    misoriented_edges: int
    crossing_pairs: int
    crossing_faces: int
    bodies: int
    size: tuple[float, float, float]
    is_fitting: bool
    volume: float | None
    weight: float | None
    wall_limit: float
    thinnest_wall: float | None
    thinnest_face: int | None
    thin_faces: int
    wall_spacing: float
    overhang_faces: int
    overhang_area: float
    seconds: dict[str, float]


class PrepareReport(Report):
    """The figures of preparing a print. Lengths are in the unit of the result.

    >>> report = surfrecon.prepare_print(mesh).report
    >>> report.scale == report["scale"]
    True

    Attributes:
        notes: Steps that were not done as they were asked for, with the reason. A kind and a sentence each:
            ``base_moved``: The plane of the base lies a hair beside the height that was asked for. ``nothing_below``:
            Nothing lies below the base. ``still_thin``: Some walls find no room to become thicker. ``nothing_hollow``:
            The mesh is nowhere thick enough for a cavity. ``no_drain``: A hole of that diameter finds no room.
            ``shut_cavities``: Some cavities have no hole. ``part_moved``: The plane between two parts lies a hair
            beside the place that makes them equal. ``size_missed``: The side has another length than was asked for.
            ``too_fine``: Some vertices lie closer together than single precision tells apart, as STL and 3MF have it.
        scale: Factor by which the mesh was scaled. 1 if it was not.
        size: Size along x, y and z. In the unit of the scans.
        volume_before: Volume before all steps, in the cube of the unit of the input.
        volume: Volume of the result.
        deviation: Largest distance by which a vertex that was kept moved, but for scaling. In the unit of the
            scans.
        added_faces: Faces that were added. The attribute added marks them.
        base_height: Height of the base above the lowest point. There is none if no base was asked for. Then it is
            ``None``. In the unit of the scans.
        base_faces: Faces of the base.
        base_area: Area of the base without a hole in it, in the square of the unit.
        wall_before: Thickness of the thinnest wall before walls were thickened, measured behind the centres of
            faces. There is none if that was not asked for, or no wall is thinner than twice that. Then it is ``None``.
            In the unit of the scans.
        wall_after: Thickness of the thinnest wall after that. Faces beside a wall tilt when its sides move apart.
            So a wall at a sharp edge may be thinner than the thinnest before. Then it is ``None``. In the unit of the
            scans.
        moved_faces: Faces that moved when walls were thickened.
        thin_faces: Faces of the result whose walls are thinner than asked for. The attribute thin marks them.
        hollow_cell: Cell in which the cavity was made. The walls are as thick as asked for within one. Then it is
            ``None``. In the unit of the scans.
        thinnest_wall: Least distance of the cavity from the surface. It is measured at the vertices and the centres
            of the faces of the cavity. There is none without a cavity. Then it is ``None``. In the unit of the scans.
        thickest_wall: Largest distance of the cavity from the surface, measured likewise. Then it is ``None``. In
            the unit of the scans.
        shut_cavities: Cavities that no hole leads into.
        drain_room: Diameter of the largest hole that would find room. There is none if no drain was asked for. Then
            it is ``None``. In the unit of the scans.
        is_drained: Whether a hole was made.
        parts: Parts that it was cut into. 1 if it was not cut.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    notes: list[tuple[str, str]]
    scale: float
    size: tuple[float, float, float]
    volume_before: float
    volume: float
    deviation: float
    added_faces: int
    base_height: float | None
    base_faces: int
    base_area: float
    wall_before: float | None
    wall_after: float | None
    moved_faces: int
    thin_faces: int
    hollow_cell: float | None
    thinnest_wall: float | None
    thickest_wall: float | None
    shut_cavities: int
    drain_room: float | None
    is_drained: bool
    parts: int
    seconds: dict[str, float]


class UnwrapReport(Report):
    """The figures of unwrapping.

    >>> report = surfrecon.unwrap(mesh).report
    >>> report.charts == report["charts"]
    True

    Attributes:
        charts: Charts.
        charts_before: Charts before small ones were joined to their neighbours.
        tiles: Tiles.
        used: Share of the tiles that triangles cover.
        texels_per_unit: Texels per unit of length: the root of the texels that triangles cover over their area on
            the surface.
        stretch: Mean stretch over the surface. The stretch of a triangle is the larger of its longest stretched
            length and the inverse of its shortest one, as a multiple of the texels per unit. 1 is none.
        stretch_p95: Nineteen twentieths of the surface are stretched less.
        collapsed: Triangles that have no area in the texture: degenerate ones, and those too thin for single
            precision.
        collapsed_area: Their share of the surface.
        moved: Vertices that were moved as single precision turned one of their triangles.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    charts: int
    charts_before: int
    tiles: int
    used: float
    texels_per_unit: float
    stretch: float
    stretch_p95: float
    collapsed: int
    collapsed_area: float
    moved: int
    seconds: dict[str, float]


class TexturedPhoto(Report):
    """A photo, and how it was used.

    >>> flat = surfrecon.unwrap(light, size=128).mesh
    >>> report = surfrecon.texture(flat, detail, photos, size=128).report
    >>> [photo.name for photo in report.photos] == [photo.name for photo in photos]
    True

    Attributes:
        name: Its name.
        reason: Reason why nothing was taken of it. Empty for a photo that was used.
        texels: Texels that it sees.
        gain: Factors of its light: red, green, blue.
        moved: Distance by which its camera was moved: pixels, in the root mean square over the surface.
    """

    __slots__ = ()
    name: str
    reason: str
    texels: int
    gain: tuple[float, float, float]
    moved: float


class TextureReport(Report):
    """The figures of texturing.

    >>> flat = surfrecon.unwrap(light, size=128).mesh
    >>> report = surfrecon.texture(flat, detail, photos, size=128).report
    >>> 0 < report.seen <= report.texels < 128**2
    True

    Attributes:
        tiles: Tiles.
        texels: Texels that triangles cover.
        seen: Texels that a photo sees.
        photos: The photos, in the order in which they were given.
        differences: Grey by which the photos differ from their mean, of 255, in the root mean square: before and
            after cameras were moved. There is none if no camera could be moved. Then it is ``None``.
        heights: Heights that 0 and 65,535 of the height map stand for. There are none without a height map. Then it
            is ``None``. In the unit of the scans.
        seconds: Wall-clock seconds by the name of the stage.
    """

    __slots__ = ()
    tiles: int
    texels: int
    seen: int
    photos: list[TexturedPhoto]
    differences: tuple[float, float] | None
    heights: tuple[float, float] | None
    seconds: dict[str, float]


class CheckReport(Report):
    """A mesh as a surface: counts, and what follows from them. Triangles that name a vertex out of range or a vertex
    twice are counted, then left out of all that follows. So are vertices without a triangle.

    >>> report = mesh.check()
    >>> report.is_manifold, report.boundary_edges
    (True, 0)

    Attributes:
        triangles: Triangles, all of them.
        vertices: Vertices that a triangle uses.
        unused_vertices: Vertices that none uses.
        non_finite_vertices: Vertices with a coordinate that is not finite.
        out_of_range_triangles: Triangles that name a vertex that doesn't exist.
        degenerate_triangles: Triangles that name a vertex twice.
        zero_area_triangles: Triangles of three different vertices whose area, computed in double precision, is
            zero.
        duplicate_triangles: Triangles with the same three vertices as another one, beyond the first.
        edges: Edges, each counted once.
        boundary_edges: Edges of one triangle.
        non_manifold_edges: Edges of more than two triangles.
        misoriented_edges: Edges whose two triangles run through it in the same direction.
        non_manifold_vertices: Vertices whose triangles fall into more than one fan of triangles joined over edges.
        components: Parts joined over edges.
        largest_component: Triangles of the largest part.
        boundary_loops: Connected groups of boundary edges. They are closed loops on a manifold.
        euler_characteristic: Vertices - edges + triangles.
        is_manifold: Whether the mesh is an oriented manifold with boundary, with finite coordinates and no
            degenerate or duplicate triangle. Triangles of zero area are no matter of topology.
        is_closed: Whether it is a manifold without boundary.
        genus: Handles of all parts together, boundary loops taken as closed by disks. There are none unless it is a
            manifold. Then it is ``None``.
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


class Snap(Report):
    """The place that a scan was drawn to by hand, and how well it lies there.

    >>> snap = surfrecon.Aligner(scans).snap(2, scans[2].world_from_sensor)
    >>> snap.state, 3 in snap.touches
    ('fits', True)

    Attributes:
        world_from_scan: The pose that the scan was drawn to. It is the pose that the scan had if it touches
            nothing. 4 x 4 float64.
        state: Whether it fits there, and if not, why: one of ``fits``, ``misfit``, ``slides``, ``seen_through`` and
            ``nothing``. ``"nothing"``: No motion was found that lays one on the other. ``"fits"``: They overlap and
            fit, where they lie in the end. ``"misfit"``: They overlap where they lie in the end, but surfaces lie
            further apart than noise explains: warp, or something moved. ``"slides"``: They fit, but may turn or slide
            on each other: not used. ``"ambiguous"``: They fit in several places: not used. ``"background"``: The shared
            part stood still before the sensor while the rest moved: not used. ``"seen_through"``: They fit by
            themselves, but other scans' sensors saw through there: not used. ``"disagrees"``: They fit by themselves,
            but other pairs, that fit better, rough poses or the order of a recording say otherwise: not used.
            ``"rejected"``: The caller rejected it.
        touches: Numbers of the scans that it touches, the nearest first.
        overlap: Share of its surface that lies on the scan that shares most with it.
        residual: Root mean square distance to the surfaces of the others, along normals. In the unit of the scans.
        balance: How well it is held against turning and sliding: 1 at best, 0 where it may turn or slide.
        seen_through: Of what the sensors can tell, the share that speaks against it.
        moved: How far its points moved, at most. In the unit of the scans.
        freedoms: Ways that it may turn or slide.
    """

    __slots__ = ()
    world_from_scan: NDArray[np.float64]
    state: Literal[
        "nothing", "fits", "misfit", "slides", "ambiguous", "background", "seen_through", "disagrees", "rejected"
    ]
    touches: list[int]
    overlap: float
    residual: float
    balance: float
    seen_through: float
    moved: float
    freedoms: list[Freedom]


class DistanceReport(Report):
    """Distances of points, or of a surface, from another surface. All figures but ``bias`` are of absolute values.

    >>> coarse = surfrecon.cluster(mesh, vertices=500).mesh
    >>> report = surfrecon.surface_distance(coarse, mesh)
    >>> report.rms <= report.p95 <= report.max <= report.bound
    True

    Attributes:
        count: Distances that were measured: of the points, or of the surface's vertices.
        mean: Their mean. In the unit of the scans.
        rms: Root of their mean square. In the unit of the scans.
        p95: The smallest value that at least 95 % of them do not exceed. In the unit of the scans.
        max: The largest of them. In the unit of the scans.
        bias: Their mean with signs. Without signs it is the mean. In the unit of the scans.
        worst: Index of the largest, the first of several. There is none where nothing was measured. Then it is
            ``None``.
        reached: Largest distance that was found on a surface, between its vertices too. There is none for points.
            Then it is ``None``. In the unit of the scans.
        bound: No point of the surface is farther. It is within 1 % of ``reached``, or above it by a millionth of
            the extent of the other surface, unless that takes more than 8 measurements for each vertex and 100,000.
            There is none for points. Then it is ``None``. In the unit of the scans.
        distances: (n,) float64, exact, one for each vertex.
    """

    __slots__ = ()
    count: int
    mean: float
    rms: float
    p95: float
    max: float
    bias: float
    worst: int | None
    reached: float | None
    bound: float | None
    distances: NDArray[np.float64]


class LeftOutReport(Report):
    """Samples that were left out of a frame, or of several, each counted for the first reason that it has.

    >>> left_out = scans[0].left_out
    >>> left_out.low_confidence <= left_out.of
    True

    Attributes:
        of: Samples that were measured.
        low_confidence: Those of too low a confidence.
        out_of_reach: Those beyond the reach of the sensor.
        black_rim: Those seen through the black rim of the colour image.
        far: Those far beyond all others of their frame, which stand for no measurement.
    """

    __slots__ = ()
    of: int
    low_confidence: int
    out_of_reach: int
    black_rim: int
    far: int


# end
