/*
 * surfrecon: surfaces from range scans. A whole program, without the looks at what calls return:
 *
 *     #include <surfrecon.h>
 *     int main(int count, char **arguments)
 *     {
 *         srf_scans *scans; srf_merger *merger; srf_mesh *mesh;
 *         if (count != 3) return 2;
 *         srf_scans_open((const char *const *)&arguments[1], 1, NULL, NULL, &scans);
 *         srf_merger_create(&merger);
 *         srf_merger_add_scans(merger, scans);
 *         srf_merger_run(merger, NULL, NULL, &mesh, NULL);
 *         return srf_mesh_write(mesh, arguments[2], NULL, NULL) == SRF_OK ? 0 : 1;
 *     }
 *
 * Chapters, each with examples of all its functions before the first of them. Structs and values stand before them all. What a verb may
 * be told is in its struct of parameters.
 *    1. The library: errors, threads, memory, progress  srf_version()
 *    2. Range images                                    srf_projection_pinhole()
 *    3. Point clouds and meshes                         srf_cloud_create()
 *    4. Reading files                                   srf_format_count()
 *    5. Writing files                                   srf_mesh_write()
 *    6. Aligning                                        srf_aligner_create()
 *    7. What to keep, true size and ground              srf_plane_through()
 *    8. Merging                                         srf_merger_create()
 *    9. Sculpting one scan                              srf_sculptor_create()
 *   10. Quad grids and splines                          srf_quads_create()
 *   11. Surfaces through points                         srf_reconstructor_create()
 *   12. Coarse meshes                                   srf_mesh_cluster()
 *   13. Closed surfaces                                 srf_mesh_close()
 *   14. Checks before printing                          srf_mesh_check_print()
 *   15. Preparing a print                               srf_mesh_prepare_print()
 *   16. Texture coordinates                             srf_mesh_unwrap()
 *   17. Textures from photos                            srf_photo_create()
 *   18. The virtual scanner                             srf_scan_mesh()
 *   19. Measuring                                       srf_mesh_distances()
 *
 * Conventions
 *   Names begin with srf_. A call that can fail returns srf_status; srf_last_error_message() then has the text.
 *   Results are written through the last arguments, and only on SRF_OK.
 *   Besides what its comment lists, any call may return SRF_ERR_OUT_OF_MEMORY and SRF_ERR_INTERNAL.
 *   Pointers are borrowed for the call unless the comment says otherwise; const means not modified.
 *   A view (srf_array as a result) points into what its handle stands for; it is there until that is freed or changed.
 *   Functions of yours are called on the thread that made the call unless the comment says otherwise. They must not unwind, by an exception
 *   or by longjmp(): what they throw ends the program, or worse. surfrecon.hpp takes exceptions across.
 *   What is set of threads, memory and the log holds for the process. Each of several plugins in a program uses a context of its own instead:
 *   srf_context_create() once, srf_context_use() around its calls.
 *   A long call ends early where its srf_progress says so: its function, or its srf_cancel, which any thread sets, and a handler of Ctrl-C.
 *   Every call may be made from any thread, and no input ends the program. Work that would not fit into the memory that
 *   is free (see srf_set_memory_limit()) is refused by any call with SRF_ERR_OUT_OF_MEMORY before it begins, as far as it
 *   can be foreseen; if the system refuses memory after that, the call ends with the same status and leaves nothing behind.
 *   Files appear whole or not at all, under their name only at the end. One that is there is replaced and keeps its
 *   permissions; links are followed; a read-only file is left alone (SRF_ERR_IO), and so is what is no file
 *   (SRF_ERR_INPUT).
 *   Handles are numbers looked up in a table: a wrong or freed one is refused with SRF_ERR_HANDLE, never followed. A handle
 *   may be used by several threads at once. Of several loaded copies of the library each refuses the handles of the others.
 *   Once loaded the library stays: on Linux and macOS dlclose() does nothing, since its threads wait in its code for the next call; on
 *   Windows do not call FreeLibrary() after a call was made.
 *   Poses (srf_pose) are made orthonormal where they are within 0.02 of it, and refused beyond (SRF_ERR_INPUT).
 *   Structs that start with struct_size are filled by their _init function before use and grow only at the end: a program
 *   built with an older header gets the defaults for what it does not know.
 *   Values of enums are handed over as integers of fixed width, and checked. Lengths are in the unit of the data, angles
 *   in radians, texts are UTF-8 and end with a zero byte.
 *
 * Generated from c-api/src by `make generate`; a test compares. Do not edit.
 */

#ifndef SURFRECON_H
#define SURFRECON_H

#include <stddef.h>
#include <stdint.h>

// A length, or another value, that is to be measured from the data.
#define SRF_FROM_DATA (-1.0)

// Number of the binary interface this header describes. It grows when a program built against an older header would no longer work.
// Compare it with srf_abi_version().
#define SRF_ABI_VERSION 2

// Version of the library this header belongs to: major number.
#define SRF_VERSION_MAJOR 0

// Minor number. Before 1.0 it grows with every change that breaks programs.
#define SRF_VERSION_MINOR 2

// Patch number.
#define SRF_VERSION_PATCH 0

// The three as one number that compares: 1000000 * major + 1000 * minor + patch.
#define SRF_VERSION 2000

// Outcome of a call. Numbers are never reused.
typedef enum {
  // All went well.
  SRF_OK = 0,
  // A number or an enumerator that was passed, as an argument, in a struct or as what an array is said to be, is out of its range. The
  // text has the value, the range and the unit.
  SRF_ERR_PARAMETER = 1,
  // The content of an array, a matrix, a text, a mesh or a file can't be used, or does not go with another. The text names the element.
  SRF_ERR_INPUT = 2,
  // A file does not hold what its format promises. The text names the place.
  SRF_ERR_FORMAT = 3,
  // Reading or writing a file failed.
  SRF_ERR_IO = 4,
  // There is not enough memory.
  SRF_ERR_OUT_OF_MEMORY = 5,
  // The caller cancelled. Nothing was left behind.
  SRF_ERR_CANCELLED = 6,
  // A pointer is NULL that must not be.
  SRF_ERR_NULL = 7,
  // A mistake of the library itself: please report it with the text.
  SRF_ERR_INTERNAL = 8,
  // A handle is of another kind than asked for, was freed or never was one.
  SRF_ERR_HANDLE = 9,
  // The size a struct starts with is none this library can work with.
  SRF_ERR_STRUCT_SIZE = 10,
} srf_status;

// Importance of a message of the log.
typedef enum {
  // For people who want to know, for example how a file was understood.
  SRF_LOG_LEVEL_INFO = 1,
  // For people to look at, for example a part of the input that was left out.
  SRF_LOG_LEVEL_WARNING = 2,
} srf_log_level;

// Type of the numbers of an array.
typedef enum {
  // float
  SRF_TYPE_F32 = 1,
  // double
  SRF_TYPE_F64 = 2,
  // int32_t
  SRF_TYPE_I32 = 3,
  // uint32_t
  SRF_TYPE_U32 = 4,
  // uint8_t
  SRF_TYPE_U8 = 5,
  // uint16_t, of the depths of frames and of height maps
  SRF_TYPE_U16 = 6,
} srf_type;

// Kinds of projection: how pixels see.
typedef enum {
  // Rays along -z. The value is z. numbers: x and y of pixel (0, 0), x from column to column, y from row to row.
  SRF_PROJECTION_ORTHOGRAPHIC = 1,
  // Rays from the origin through ((col - cx) / fx, (row - cy) / fy, 1). The value is z. numbers: fx, fy, cx, cy in pixels.
  SRF_PROJECTION_PINHOLE_DEPTH = 2,
  // The same, the value is the distance along the ray.
  SRF_PROJECTION_PINHOLE_RANGE = 3,
  // Rays from the origin. The value is the distance along the ray. numbers: azimuth (from +x toward +y) and elevation (from the horizon
  // toward +z) of pixel (0, 0), azimuth from column to column, elevation from row to row, in radians.
  SRF_PROJECTION_SPHERICAL = 4,
  // A point a pixel, seen along parallel rays. numbers: x, y, z of their direction, toward the scene.
  SRF_PROJECTION_GRID_PARALLEL = 5,
  // A point a pixel, seen from one place. numbers: x, y, z of it.
  SRF_PROJECTION_GRID_FROM = 6,
} srf_projection_kind;

// The owners of an attribute's entries.
typedef enum {
  // One entry per vertex.
  SRF_DOMAIN_VERTICES = 1,
  // One entry per triangle.
  SRF_DOMAIN_TRIANGLES = 2,
} srf_domain;

// Quantity that the pixels of depth images measure.
typedef enum {
  // Distance from the image plane through the centre of projection (z).
  SRF_DEPTH_PLANAR = 1,
  // Distance along the pixel's ray.
  SRF_DEPTH_RAY = 2,
} srf_depth;

// How images store numbers.
typedef enum {
  // Numbers if the image is grey. Terrain RGB if it is coloured and every pixel then lies between -500 and 9000 m.
  SRF_PIXELS_AUTO = 1,
  // A number per pixel.
  SRF_PIXELS_NUMBER = 2,
  // Mapbox: -10000 + (65536 R + 256 G + B) / 10.
  SRF_PIXELS_TERRAIN_RGB = 3,
  // Mapzen: 256 R + G + B / 256 - 32768.
  SRF_PIXELS_TERRARIUM = 4,
} srf_pixels;

// Direction of the poses of a recording or of a list of poses.
typedef enum {
  // As the layout has them, unless the frames lie on each other only in the other sense.
  SRF_POSES_AUTO = 1,
  // From the camera to the world.
  SRF_POSES_CAMERA_TO_WORLD = 2,
  // From the world to the camera.
  SRF_POSES_WORLD_TO_CAMERA = 3,
} srf_poses;

// Axes of the cameras that the poses of a recording or of a list of poses place.
typedef enum {
  // As the layout has them, unless the frames lie on each other only with the other axes.
  SRF_AXES_AUTO = 1,
  // y down, looking along z, as OpenCV and Open3D have them.
  SRF_AXES_Y_DOWN = 2,
  // y up, looking along -z, as OpenGL, Blender and ARKit have them.
  SRF_AXES_Y_UP = 3,
} srf_axes;

// Sort of content of a scan.
typedef enum {
  // A srf_image.
  SRF_CONTENT_IMAGE = 1,
  // A srf_mesh.
  SRF_CONTENT_MESH = 2,
  // A srf_cloud.
  SRF_CONTENT_CLOUD = 3,
} srf_content;

// Axis of the mesh that points up, for glTF, where y does.
typedef enum {
  // As glTF has it: nothing is turned.
  SRF_UP_Y = 1,
  // A node above all others turns z up to y up.
  SRF_UP_Z = 2,
} srf_up;

// Form of the numbers in PLY files. Other formats have one way.
typedef enum {
  // Coordinates in single precision unless they lie so far from the origin that they would lose detail.
  SRF_ENCODING_BINARY = 1,
  // Coordinates in double precision.
  SRF_ENCODING_BINARY_DOUBLE = 2,
  // Coordinates with the fewest digits that read back as the same numbers.
  SRF_ENCODING_ASCII = 3,
} srf_encoding;

// Facts that are known of the poses of the scans.
typedef enum {
  // As the scans say: `sequence` where all are frames of one recording that follow each other in time and at least half
  // of them fit the frame before, `unknown` otherwise.
  SRF_START_AUTO = 1,
  // Nothing: each scan may lie anywhere, whatever pose it has.
  SRF_START_UNKNOWN = 2,
  // They are near where they belong: no scan is placed further from its pose than `reach`.
  SRF_START_ROUGH = 3,
  // Nothing, but each scan was taken a moment after the one before it, by a sensor that moved little: in the order of
  // the recording that they are frames of, else in the order given.
  SRF_START_SEQUENCE = 4,
} srf_start;

// Whether the object turned on a table while the sensor stood still: then only turns about one axis are looked for, unless none is found, which is said.
typedef enum {
  // No, or not known.
  SRF_TURNTABLE_NO = 1,
  // By angles that are found, or given, about an axis that is found, or given: the same one in the frames of all scans.
  SRF_TURNTABLE_TURNED = 2,
  // A whole turn in equal steps, in the order of the scans.
  SRF_TURNTABLE_EQUAL = 3,
} srf_turntable;

// State of the scan: placed, kept, or neither.
typedef enum {
  // It has no place: the reason says why.
  SRF_SCAN_STATE_UNPLACED = 1,
  // Its pose was found.
  SRF_SCAN_STATE_PLACED = 2,
  // Its pose is as given: the caller fixed it, or it is the frame of the others.
  SRF_SCAN_STATE_KEPT = 3,
  // It was joined with others, but nothing joins these with the first group.
  SRF_SCAN_STATE_APART = 4,
  // Its pose is as given: that was rough, and nothing decides where it belongs. The reason says why.
  SRF_SCAN_STATE_UNDECIDED = 5,
} srf_scan_state;

// State of the pair: it fits, or why it is not used.
typedef enum {
  // No motion was found that lays one on the other.
  SRF_PAIR_STATE_NOTHING = 1,
  // They overlap and fit, where they lie in the end.
  SRF_PAIR_STATE_FITS = 2,
  // They overlap where they lie in the end, but surfaces lie further apart than noise explains: warp, or something
  // moved.
  SRF_PAIR_STATE_MISFIT = 3,
  // They fit, but may turn or slide on each other: not used.
  SRF_PAIR_STATE_SLIDES = 4,
  // They fit in several places: not used.
  SRF_PAIR_STATE_AMBIGUOUS = 5,
  // The shared part stood still before the sensor while the rest moved: not used.
  SRF_PAIR_STATE_BACKGROUND = 6,
  // They fit by themselves, but other scans' sensors saw through there: not used.
  SRF_PAIR_STATE_SEEN_THROUGH = 7,
  // They fit by themselves, but other pairs, that fit better, rough poses or the order of a recording say otherwise: not
  // used.
  SRF_PAIR_STATE_DISAGREES = 8,
  // The caller rejected it.
  SRF_PAIR_STATE_REJECTED = 9,
} srf_pair_state;

// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell. All and those inside the scans are closed by a smooth fill, with the whole surface in memory.
typedef enum {
  // Everything that seen space allows: the result is closed.
  SRF_CLOSE_ALL = 1,
  // Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim,
  // a relief's border and the foot of a statue stay open.
  SRF_CLOSE_SEEN = 2,
  // Openings whose boundaries are at most as long as the longest hole.
  SRF_CLOSE_HOLES = 3,
  // None: the surface stays as it is, and the report says what is open.
  SRF_CLOSE_NONE = 4,
} srf_close;

// Rule that decided the size of a cell.
typedef enum {
  // The caller gave it.
  SRF_VOXEL_REASON_GIVEN = 1,
  // 1.5 times the mean distance of neighbouring samples.
  SRF_VOXEL_REASON_SPACING = 2,
  // Half the median standard deviation of the samples.
  SRF_VOXEL_REASON_NOISE = 3,
  // 1.5 times the median distance between scans that overlap.
  SRF_VOXEL_REASON_DISTANCE = 4,
  // Coarser than that, so that it fits into memory: by the limit and the scans alone, or, where there is no limit, by
  // what is free at that moment.
  SRF_VOXEL_REASON_MEMORY = 5,
} srf_voxel_reason;

// Length that the perimeter of a facet is compared with.
typedef enum {
  // The spacing of the points around it: sparse parts may have large facets.
  SRF_THRESHOLD_LOCAL = 1,
  // The mean over the whole surface, as in the paper.
  SRF_THRESHOLD_GLOBAL = 2,
} srf_threshold;

// Form of the surface.
typedef enum {
  // Every edge has at most two facets, every vertex one fan of them.
  SRF_TOPOLOGY_MANIFOLD = 1,
  // The paper's carving: closed, but not manifold where parts touch, and without the points carved away.
  SRF_TOPOLOGY_FREE = 2,
} srf_topology;

// Whether the points are of a closed surface. Only with a manifold topology.
typedef enum {
  // Closed if a closed surface goes through more than half of the points at once, or through 5 % at once and 99 % in the
  // end. But not if sensors saw it from one side only, or if points carry noise and more than 15 % of the area would be
  // in facets above the threshold. Else it is open and grows from the most certain facet on. Parts are joined over
  // facets up to 4 times as large as the threshold, or 16 times where they continue a part smoothly. Small holes are
  // closed. Parts that lie further apart stay apart.
  SRF_CLOSURE_AUTO = 1,
  // Gaps in the sampling are spanned by large facets.
  SRF_CLOSURE_CLOSED = 2,
  // Facets above the threshold are left out, so that gaps stay open.
  SRF_CLOSURE_OPEN = 3,
} srf_closure;

// Treatment of the noise of points.
typedef enum {
  // They are moved to the surface that those around them tell. Outliers, also around points that carry no noise, are
  // left out.
  SRF_NOISY_POINTS_MOVED = 1,
  // The surface is found as with `moved`, and goes through the points as they were measured. Noise may make it cross
  // itself.
  SRF_NOISY_POINTS_PUT_BACK = 2,
  // Nothing is smoothed and no outlier left out, whatever noise the points carry and whatever the smoothing is. If noise
  // is half a spacing or more, no surface may be found, or one full of holes.
  SRF_NOISY_POINTS_AS_CLEAN = 3,
} srf_noisy_points;

// Reasons why a point is not on a surface.
typedef enum {
  // It is on it.
  SRF_DROPPED_USED = 0,
  // A coordinate isn't a finite number.
  SRF_DROPPED_NOT_FINITE = 1,
  // At the same place as a point before it. Of points that are flat but for noise, also right above another.
  SRF_DROPPED_DUPLICATE = 2,
  // Inside the closed surface, out of its reach.
  SRF_DROPPED_INSIDE = 3,
  // Outside the surface: too far away for the threshold, or carved away.
  SRF_DROPPED_OUTSIDE = 4,
  // Far from any surface that the others tell. Since 0.2.
  SRF_DROPPED_OUTLIER = 5,
} srf_dropped;

// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell.
typedef enum {
  // Everything that seen space allows: the result is closed.
  SRF_OPENINGS_ALL = 1,
  // Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim,
  // a relief's border and the foot of a statue stay open.
  SRF_OPENINGS_SEEN = 2,
  // Openings whose boundaries are at most as long as the longest hole.
  SRF_OPENINGS_HOLES = 3,
  // None: the surface stays as it is, and the report says what is open.
  SRF_OPENINGS_NONE = 4,
} srf_openings;

// Direction away from the ground, where there is a flat base.
typedef enum {
  // Along z.
  SRF_BASE_UP_Z = 1,
  // Along y.
  SRF_BASE_UP_Y = 2,
  // Along x.
  SRF_BASE_UP_X = 3,
  // Against z.
  SRF_BASE_UP_MINUS_Z = 4,
  // Against y.
  SRF_BASE_UP_MINUS_Y = 5,
  // Against x.
  SRF_BASE_UP_MINUS_X = 6,
} srf_base_up;

// Direction away from the plate that is printed on.
typedef enum {
  // Along z.
  SRF_PRINT_UP_Z = 1,
  // Along y.
  SRF_PRINT_UP_Y = 2,
  // Along x.
  SRF_PRINT_UP_X = 3,
  // Against z.
  SRF_PRINT_UP_MINUS_Z = 4,
  // Against y.
  SRF_PRINT_UP_MINUS_Y = 5,
  // Against x.
  SRF_PRINT_UP_MINUS_X = 6,
} srf_print_up;

// The side that gets this length.
typedef enum {
  // The longest of the sides along x, y and z.
  SRF_SCALE_SIDE_LONGEST = 1,
  // The side along up.
  SRF_SCALE_SIDE_HEIGHT = 2,
} srf_scale_side;

// An image of a tile.
typedef enum {
  // Base colour: 3 SRF_TYPE_U8, sRGB.
  SRF_TEXTURE_MAP_COLOUR = 1,
  // Source of the colour: one SRF_TYPE_U8. 255 where a photo sees the place, 128 where none does and the colour is that of the detailed
  // surface's vertices or of the nearest place that is seen, 0 where no triangle is.
  SRF_TEXTURE_MAP_MASK = 2,
  // Normals in the tangent space of MikkTSpace, y up: 3 SRF_TYPE_U8, of which 128 is 0.
  SRF_TEXTURE_MAP_NORMAL = 3,
  // Heights of the detailed surface over the mesh: one SRF_TYPE_U16, from lowest to highest of the report.
  SRF_TEXTURE_MAP_HEIGHT = 4,
  // Ambient occlusion: one SRF_TYPE_U8, as light. 255 where all directions are open.
  SRF_TEXTURE_MAP_OCCLUSION = 5,
} srf_texture_map;

// An alignment being put together: scans are added, known facts about them are said, then it is run, as often as wanted. Scans are
// numbered from 0 in the order of adding. They are read when srf_aligner_run(), srf_aligner_snap() or srf_aligner_misfit() first needs
// them. What these compare is kept, 1 to 2.5 MB per scan, until scans are added. Released with srf_aligner_free().
typedef struct srf_aligner srf_aligner;

// The result of an alignment: the poses and how sure they are. Released with srf_alignment_free().
typedef struct srf_alignment srf_alignment;

// A switch that cancels the calls it is handed to (srf_progress), from any thread. Released with srf_cancel_free().
typedef struct srf_cancel srf_cancel;

// Scattered points with optional normals and colours, and a place in the world. Released with srf_cloud_free().
typedef struct srf_cloud srf_cloud;

// Threads, a limit on memory and a log for a part of a program, for example for one of several plugins of a host. What it has none of
// it takes from the process (srf_set_threads(), srf_set_memory_limit(), srf_set_log()). Released with srf_context_free().
typedef struct srf_context srf_context;

// A folder whose files lie in memory, or behind functions of yours. Each of its files has a path (srf_folder_path()), which every function
// that takes the path of a file takes. So scans, lists of scans and whole recordings are read from memory, and all files can be written
// there. Released with srf_folder_free(). Scans that were opened in it keep it.
typedef struct srf_folder srf_folder;

// A range image: rows x cols pixels, row after row, each valid or not, each with a viewing ray, placed in the world.
// Released with srf_image_free().
typedef struct srf_image srf_image;

// A merge being put together: scans are added, replaced and removed, and it is run as often as wanted. Released with srf_merger_free().
typedef struct srf_merger srf_merger;

// A triangle mesh with named attributes of its vertices and triangles. Triangles turn counter-clockwise seen from outside. Released with
// srf_mesh_free().
typedef struct srf_mesh srf_mesh;

// A photo whose camera is known. Released with srf_photo_free().
typedef struct srf_photo srf_photo;

// A regular grid of quads over a range image, dense where the surface bends. Released with srf_quads_free().
typedef struct srf_quads srf_quads;

// Scattered points from which surfaces are made with one set of parameters after the other. Released with
// srf_reconstructor_free().
typedef struct srf_reconstructor srf_reconstructor;

// The region that samples are kept or removed by: a box, a plane or a mask. Released with srf_region_free().
typedef struct srf_region srf_region;

// Scans of one or several files, opened but not read: their samples stay on disk until they are needed. Released with
// srf_scans_free().
typedef struct srf_scans srf_scans;

// A range image ready to be sculpted to one tolerance after the other. Released with srf_sculptor_free().
typedef struct srf_sculptor srf_sculptor;

// A tensor-product B-spline surface over 0..1 x 0..1: u runs along columns, v down rows. Knots are uniform and clamped. Released with
// srf_spline_free().
typedef struct srf_spline srf_spline;

// The images of a mesh, in square tiles of one size. Released with srf_textures_free().
typedef struct srf_textures srf_textures;

// Gets the messages of the log. level: a value of srf_log_level. text: UTF-8, valid during the call. user: the pointer given to
// srf_set_log. Runs on the thread of the call that has something to tell. Must not unwind.
typedef void (*srf_log_fn)(int32_t level, const char *text, void *user);

// Gives size bytes, at least 1, that begin at a multiple of alignment, a power of two. NULL where there are none.
typedef void *(*srf_allocate_fn)(void *user, size_t size, size_t alignment);

// Makes a block of old_size bytes one of new_size, which may lie elsewhere and begins with what the old one held, as far as that fits.
// NULL where that can't be: the block then stays as it was.
typedef void *(*srf_reallocate_fn)(void *user, void *block, size_t old_size, size_t new_size, size_t alignment);

// Takes a block back, with the size and the alignment that it was asked for with.
typedef void (*srf_deallocate_fn)(void *user, void *block, size_t size, size_t alignment);

// Source of the library's memory. Its functions are called on any thread, on several at once, at any time until the process has ended, and
// within any call of this library. So they must not call it, nor unwind.
typedef struct {
  // Not NULL.
  srf_allocate_fn allocate;
  // NULL for a new block and a copy.
  srf_reallocate_fn reallocate;
  // Not NULL.
  srf_deallocate_fn deallocate;
  // Handed to them as it is.
  void *user;
} srf_allocator;

// How range images become surfaces: limits of the step-discontinuity triangulation. Starts with its size. Set to the
// defaults by srf_triangulate_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
  // the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
  // pixels are not square.
  double edge_limit;
  // Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
  // grazing angle. Radians, > 0, at most pi/2, default pi/2.
  double grazing_limit;
} srf_triangulate_params;

// Projection of an image: how its pixels see, in the sensor's frame.
typedef struct {
  // A value of srf_projection_kind.
  uint32_t kind;
  // 0.
  uint32_t reserved;
  // Their meaning is said with the kind. Those it does not name are 0. srf_projection_pinhole() and the functions beside it fill them.
  double numbers[4];
} srf_projection;

// An array of `count` elements of `components` numbers each.
//
// Handed in it is borrowed for the call and copied. Handed out it is a view that copies nothing: it stays until the handle
// it came from is freed or changed, and must not be written to.
typedef struct {
  // The first number of the first element. May be NULL if count is 0. Needs no alignment.
  const void *data;
  // Number of elements.
  size_t count;
  // Bytes from one element to the next. 0 for elements without gaps. At least the size of an element.
  size_t stride;
  // A value of srf_type.
  uint32_t type;
  // Numbers an element: 3 for points and triangles, 4 for colours, 1 for plain values.
  uint32_t components;
} srf_array;

// Places a frame in another: 16 numbers, column after column, as OpenGL and glTF have them. The last row is 0 0 0 1. If a rotation and a
// translation are asked for, the axes must be orthonormal within 0.02: the nearest rotation is taken.
typedef struct {
  // Column after column.
  double matrix[16];
} srf_pose;

// Asked about every 30 ms during a long call, on the thread that made the call. stage: what is being done, for people. fraction: the share
// of the whole call that is done, 0 to 1, never falling, and 1 in the last report of a call that succeeds. message: both as one line.
// user: as given in srf_progress. The texts are UTF-8 and valid during the call of the function. Answer 0 to go on, anything else to
// cancel. The call then returns SRF_ERR_CANCELLED within a tenth of a second and leaves nothing behind. The answer once all is done
// changes nothing. Must not unwind.
typedef int32_t (*srf_progress_fn)(const char *stage, double fraction, const char *message, void *user);

// Watcher of a long call, and the switch that cancels it. NULL where one is asked for: nobody and nothing.
typedef struct {
  // Asked during the call. NULL for nobody.
  srf_progress_fn report;
  // Handed to report as it is.
  void *user;
  // Cancels the call once it is set, by whatever thread, also where it was before the call began. NULL for nothing. It may be freed
  // during the call, and be given to several calls at once.
  const srf_cancel *cancel;
} srf_progress;

// Samples that were left out of a frame, or of several, each counted for the first reason that it has. Starts with its
// size. Prepared by srf_left_out_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Samples that were measured.
  uint64_t of;
  // Those of too low a confidence.
  uint64_t low_confidence;
  // Those beyond the reach of the sensor.
  uint64_t out_of_reach;
  // Those seen through the black rim of the colour image.
  uint64_t black_rim;
  // Those far beyond all others of their frame, which stand for no measurement.
  uint64_t far;
} srf_left_out_report;

// How the images of a frame were taken and how they lie in memory. One serves all frames of a recording. Cameras look along z, with
// x to the right and y down. Pixel centres lie at whole numbers, that of the first pixel at 0, 0. Starts with its size. Prepared by
// srf_frame_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // The kind of the depths: SRF_PROJECTION_PINHOLE_DEPTH, along z, the default, or SRF_PROJECTION_PINHOLE_RANGE, along the ray.
  uint32_t kind;
  // Rows of the depth image.
  uint64_t rows;
  // Its columns.
  uint64_t cols;
  // Bytes from one of its rows to the next. 0 for rows without gaps.
  uint64_t row_stride;
  // Its camera: fx, fy, cx, cy in pixels.
  double intrinsics[4];
  // The factor of stored depths, > 0: 0.001 makes millimetres metres. 1 by default.
  double scale;
  // Samples further away along z are the sensor's guesses and are left out, in the unit of the scaled depths. 0, the default, for none.
  double reach;
  // Rows of the colour image. 0, as its columns, for the size of the depth image.
  uint64_t colour_rows;
  // Its columns.
  uint64_t colour_cols;
  // Bytes from one of its rows to the next. 0 for rows without gaps.
  uint64_t colour_row_stride;
  // Its camera: fx, fy, cx, cy in its pixels. All 0, the default, for that of the depth image, scaled to its size.
  double colour_intrinsics[4];
  // Takes points of the depth camera's frame into that of the colour camera: a rotation and a translation, the identity by default.
  srf_pose colour_from_depth;
  // 1: undistorting left the colour image a black rim. Samples seen through it are left out. 0 by default.
  uint32_t has_black_rim;
  // 1: poses and colour_from_depth are of cameras with y up that look along -z, as ARKit's and OpenGL's. 0 by default.
  uint32_t looks_along_minus_z;
  // Rows of the confidence image. 0, as its columns, for the size of the depth image.
  uint64_t confidence_rows;
  // Its columns.
  uint64_t confidence_cols;
  // Bytes from one of its rows to the next. 0 for rows without gaps.
  uint64_t confidence_row_stride;
  // Samples of a lower level are left out, 0 to 255. 1 by default.
  uint64_t least_confidence;
} srf_frame;

// A mesh as a surface: counts, and what follows from them. Triangles that name a vertex out of range or a vertex twice are
// counted, then left out of all that follows. So are vertices without a triangle. Starts with its size. Prepared by
// srf_check_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Triangles, all of them.
  uint64_t triangles;
  // Vertices that a triangle uses.
  uint64_t vertices;
  // Vertices that none uses.
  uint64_t unused_vertices;
  // Vertices with a coordinate that is not finite.
  uint64_t non_finite_vertices;
  // Triangles that name a vertex that doesn't exist.
  uint64_t out_of_range_triangles;
  // Triangles that name a vertex twice.
  uint64_t degenerate_triangles;
  // Triangles of three different vertices whose area, computed in double precision, is zero.
  uint64_t zero_area_triangles;
  // Triangles with the same three vertices as another one, beyond the first.
  uint64_t duplicate_triangles;
  // Edges, each counted once.
  uint64_t edges;
  // Edges of one triangle.
  uint64_t boundary_edges;
  // Edges of more than two triangles.
  uint64_t non_manifold_edges;
  // Edges whose two triangles run through it in the same direction.
  uint64_t misoriented_edges;
  // Vertices whose triangles fall into more than one fan of triangles joined over edges.
  uint64_t non_manifold_vertices;
  // Parts joined over edges.
  uint64_t components;
  // Triangles of the largest part.
  uint64_t largest_component;
  // Connected groups of boundary edges. They are closed loops on a manifold.
  uint64_t boundary_loops;
  // Vertices - edges + triangles.
  int64_t euler_characteristic;
  // Whether the mesh is an oriented manifold with boundary, with finite coordinates and no degenerate or duplicate
  // triangle. Triangles of zero area are no matter of topology. 1 or 0.
  uint64_t is_manifold;
  // Whether it is a manifold without boundary. 1 or 0.
  uint64_t is_closed;
  // Handles of all parts together, boundary loops taken as closed by disks. There are none unless it is a manifold. Then
  // it is -1.
  int64_t genus;
} srf_check_report;

// Place where a vertex of a range image was: by it a motion of all vertices is recognized.
typedef struct {
  // Its pixel's row.
  uint64_t row;
  // Its pixel's column.
  uint64_t col;
  // The point in the sensor's frame.
  double point[3];
} srf_anchor;

// The camera that a host keeps of a range image beside its vertices: how the pixels see, and where some of the vertices were. Numbers
// only: it may be stored as it is. Starts with its size. Prepared by srf_grid_camera_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Number of the anchors, up to 256. With 0, the default, vertices are taken to lie in the sensor's frame.
  uint32_t anchor_count;
  // Projection of the pixels.
  srf_projection projection;
  // Vertices far from each other.
  srf_anchor anchors[256];
  // Rows of the grid.
  uint64_t rows;
  // Its columns.
  uint64_t cols;
} srf_grid_camera;

// Takes what is written into a folder. user: as given in srf_file_sink. name: of the file within the folder. bytes: the next ones, or NULL
// if the file is complete. count: how many. Files of a set may take turns, and its list is complete last. A file whose call ended with an
// error is not complete, and its bytes are to be discarded. Called on any thread, never on two at once. Answers are those of srf_read_fn,
// as is what it must not do. Nor must it write into its own folder.
typedef int32_t (*srf_write_fn)(void *user, const char *name, const void *bytes, size_t count);

// Called once, on any thread, when nobody needs user any more.
typedef void (*srf_release_fn)(void *user);

// Receiver of the bytes of files.
typedef struct {
  // Takes them. Not NULL.
  srf_write_fn write;
  // NULL if there is nothing to release.
  srf_release_fn release;
  // Handed to both as it is.
  void *user;
} srf_file_sink;

// Reads bytes of a file for srf_folder_put_source(). user: as given there. at: the place of the first byte. buffer: receives them. count:
// the most that are wanted, at least 1. out_count: receives how many there are now, at least 1. No more is asked for than the file has.
// Called on any thread, for one file never on two at once. Answer SRF_OK, or the status of what went wrong. The call that reads then ends
// with SRF_ERR_IO, or SRF_ERR_OUT_OF_MEMORY for that, and says what srf_last_error_message() says on the thread of this function
// (srf_set_last_error() says it). Must not unwind, nor leave by longjmp(). Must not call functions with handles of what is being read.
typedef int32_t (*srf_read_fn)(void *user, uint64_t at, void *buffer, size_t count, size_t *out_count);

// Source of the bytes of a file.
typedef struct {
  // Number of bytes. Must not change.
  uint64_t length;
  // Reads them. Not NULL.
  srf_read_fn read;
  // NULL if there is nothing to release.
  srf_release_fn release;
  // Handed to both as it is.
  void *user;
} srf_file_source;

// Facts that files do not say themselves. Starts with its size. Set to the defaults by srf_read_options_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // fx, fy, cx, cy in pixels, pixel centres at whole numbers: images are depth images of that camera. All 0, the
  // default: they are height maps, unless a file of a camera is opened with them.
  double intrinsics[4];
  // Of the camera of these intrinsics: columns and rows of its images. Others are refused. 0 and 0, the default: any.
  uint64_t camera_size[2];
  // Factor by which the numbers of an image are multiplied. Larger values make heights and depths larger. > 0.
  // SRF_FROM_DATA, the default: 0.001 for whole numbers seen by a camera (millimetres), else 1.
  double scale;
  // Number that is added to the numbers of an image afterwards. Default 0.
  double offset;
  // Distance of neighbouring pixels of a height map. Larger values make it wider. > 0. SRF_FROM_DATA, the default: the
  // size in the file, else 1.
  double step;
  // The number of an image, before scaling, that means no sample. It counts besides those that the format itself
  // defines. NaN, the default: none.
  double invalid;
  // Quantity that the pixels of depth images measure. A value of srf_depth, default SRF_DEPTH_PLANAR.
  uint64_t depth;
  // How images store numbers. A value of srf_pixels, default SRF_PIXELS_AUTO.
  uint64_t pixels;
  // Largest size of what one compressed file unpacks to, in GiB. Larger values let larger files be read. Small ones
  // refuse files that unpack to more than they should. > 0, at most 1000000, default 4.
  double max_decoded_gib;
  // Lists may name files outside their own folder. Off: such lists are refused. 1 or 0, default 0.
  uint64_t allow_outside;
  // Direction of the poses of a recording or of a list of poses. A value of srf_poses, default SRF_POSES_AUTO.
  uint64_t poses;
  // Axes of the cameras that the poses of a recording or of a list of poses place. A value of srf_axes, default
  // SRF_AXES_AUTO.
  uint64_t axes;
} srf_read_options;

// How a mesh is written. Starts with its size. Set to the defaults by srf_write_options_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Metres a unit of the mesh, for glTF, which is in metres, and 3MF, which says its unit: 0.001 for millimetres. STL
  // files say it in their header, unless it is 1, and are then read in metres. Other formats keep the unit. > 0, default
  // 1.
  double metres_per_unit;
  // Axis of the mesh that points up, for glTF, where y does. A value of srf_up, default SRF_UP_Y.
  uint64_t up;
  // Form of the numbers in PLY files. Other formats have one way. A value of srf_encoding, default SRF_ENCODING_BINARY.
  uint64_t encoding;
  // A PLY file gets no more triangles than this. Of a larger mesh it gets the first, and files beside it called
  // name-2-of-3.ply and so on get the others. Each has the vertices that its triangles name, so that parts meet in
  // vertices of the same coordinates. 0: one file. 0 to 2147483647, default 0.
  uint64_t part_triangles;
} srf_write_options;

// How scans are brought to one frame. Lengths are in the unit of the scans. Starts with its size. Set to the defaults by
// srf_align_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Facts that are known of the poses of the scans. A value of srf_start, default SRF_START_AUTO.
  uint64_t start;
  // With rough poses, how far off they may be: no sample of a scan is placed further from where its pose has it. A scan
  // that fits no nearer is left out, and the report says how far that would be. > 0. SRF_FROM_DATA, the default: a tenth
  // of the scan's size.
  double reach;
  // Whether the object turned on a table while the sensor stood still: then only turns about one axis are looked for,
  // unless none is found, which is said. A value of srf_turntable, default SRF_TURNTABLE_NO.
  uint64_t turntable;
  // Surfaces that lie further apart, as a root mean square, don't fit. > 0. SRF_FROM_DATA, the default: a fifth of the
  // distance of the points that are compared, 8,000 to a scan, or more where noise asks for it.
  double tolerance;
  // Scans fit only if one of them lies on the other with at least this share of its surface. 0 to 1, default 0.03.
  double min_overlap;
  // Colours or intensities decide where shape lets scans turn or slide, or fits in several places. Off: shape alone
  // counts. 1 or 0, default 1.
  uint64_t use_colour;
} srf_align_params;

// A point that two scans show. Starts with its size. Prepared by srf_pick_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 1 if the normals are known: two picks with normals already give a pose. 0, the default, if not.
  uint32_t has_normals;
  // Numbers of the scans.
  uint32_t scans[2];
  // The place of the point, in each scan's own frame.
  double points[2][3];
  // Outward normals there, in the scans' frames, of any length but 0.
  double normals[2][3];
  // Its weight: at 1, the default, as much as a two-thousandth of the smaller scan's surface. > 0.
  double weight;
} srf_pick;

// Makes the range image of a scan, for example with srf_image_from_frame(). user: as given in srf_image_source. out_image: receives a
// handle that nobody else uses, which the library then frees, also if the answer is an error. Its pose and its name are passed over: those
// of adding count. Called on threads of the library or on the thread that made the call, for several scans at once, and for a scan more
// than once. Each time it must make the same image, or the result is none of any scan. It may call any function of this library. While it
// is in one that takes longer it may be called for another scan on the same thread, so it must hold no lock then that it takes itself.
// Answer SRF_OK, or the status of what went wrong. The call for which it was made then ends, with SRF_ERR_CANCELLED or
// SRF_ERR_OUT_OF_MEMORY for these, else with SRF_ERR_INPUT. Its text has the scan's name and what srf_last_error_message() says on the
// thread of this function (srf_set_last_error() says it). A call that is cancelled waits for those that are being made. Must not unwind,
// nor leave by longjmp().
typedef int32_t (*srf_image_fn)(void *user, srf_image **out_image);

// Maker of the image of a scan when it is needed, so that it need not stay in memory: not before a run, and a few times in it at most.
typedef struct {
  // Makes it. Not NULL.
  srf_image_fn make;
  // Handed to make as it is. Must stay until what it was added to is freed and no call works with it.
  void *user;
} srf_image_source;

// A way that a scan may move without leaving the surfaces it lies on.
typedef struct {
  // Whether it is a turn about an axis. Otherwise it is a slide. 1 or 0.
  uint64_t turns;
  // Unit direction of the axis, or of the slide, in the world.
  double direction[3];
  // A point of the axis, in the world.
  double point[3];
} srf_freedom;

// A scan that was aligned: its pose, and how sure that is. Starts with its size. Prepared by srf_aligned_scan_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // State of the scan: placed, kept, or neither. A value of srf_scan_state, such as SRF_SCAN_STATE_UNPLACED.
  uint64_t state;
  // Number of its group. 0 is the group that is placed. There is none where the scan is joined with no other. Then it is
  // UINT64_MAX.
  uint64_t group;
  // Its pose in its group, which is rigid. For the first group it is the result. Scans of others lie together where the
  // largest of them was given. There is none where the scan has no group. Then it is all 0.
  srf_pose world_from_scan;
  // Covariance of a small motion of it in the world: a turn about `middle` in radians, then a shift. Zero for scans that
  // are kept.
  double covariance[6][6];
  // The middle of its points, in the world.
  double middle[3];
  // One standard deviation of the place of its points: the largest over the scan. It is at least the scan's size where
  // nothing holds it, the reach where it stays undecided, and infinite where it has no place. In the unit of the scans.
  double deviation;
  // Number of freedoms. Ways that nothing holds it.
  uint64_t freedoms_count;
  // Ways that nothing holds it. Those behind them are 0.
  srf_freedom freedoms[6];
  // Share of its surface that lies on the scan that shares most with it.
  double overlap;
  // Root mean square distance to the surfaces of others, along normals. 0 where there are none. In the unit of the
  // scans.
  double residual;
  // Root mean square of how far it lies from the others where noise is averaged out. No rigid pose explains that, but
  // warp does. Bending within a few samples counts as well, so that some of it is always there. In the unit of the
  // scans.
  double misfit;
  // Median distance of its samples. In the unit of the scans.
  double spacing;
} srf_aligned_scan;

// Two scans that were compared, and how well they fit. Starts with its size. Prepared by srf_aligned_pair_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Their numbers, the smaller first.
  uint64_t scans[2];
  // State of the pair: it fits, or why it is not used. A value of srf_pair_state, such as SRF_PAIR_STATE_NOTHING.
  uint64_t state;
  // Share of either surface that lies on the other.
  double overlap[2];
  // Root mean square distance of the surfaces where they touch, along normals. In the unit of the scans.
  double residual;
  // How well the pair is held against turning and sliding: 1 at best, 0 where it may turn or slide.
  double balance;
  // Of what the sensors can tell, the share that speaks against the pair.
  double seen_through;
  // Places in which one fits the other.
  uint64_t places;
  // Number of freedoms. Ways that one may turn or slide on the other.
  uint64_t freedoms_count;
  // Ways that one may turn or slide on the other. Those behind them are 0.
  srf_freedom freedoms[6];
} srf_aligned_pair;

// Scans that were aligned, and their pairs. Starts with its size. Prepared by srf_align_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Number of scans. Each scan, in the order given.
  uint64_t scans_count;
  // Number of pairs. The pairs of which anything was found, by their numbers.
  uint64_t pairs_count;
  // Number of groups. Numbers of the scans of each group, the placed one first. Only scans that are joined with others,
  // or kept, are in one.
  uint64_t groups_count;
  // Pairs that were compared.
  uint64_t compared;
  // Root mean square distance of the surfaces of all pairs that touch, along normals. There is none where none touch.
  // Then it is SRF_FROM_DATA. In the unit of the scans.
  double residual;
  // Turntable: A point of the axis.
  double turntable_point[3];
  // Turntable: Unit direction of the axis.
  double turntable_direction[3];
  // Number of messages. Sentences that the user should know.
  uint64_t messages_count;
  // Scans that lie in one frame: those that were placed, and those kept. 0 where a single one was kept for want of a
  // place for others.
  uint64_t placed;
} srf_align_report;

// The place that a scan was drawn to by hand, and how well it lies there. Starts with its size. Prepared by
// srf_snap_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // The pose that the scan was drawn to. It is the pose that the scan had if it touches nothing.
  srf_pose world_from_scan;
  // Whether it fits there, and if not, why: one of `fits`, `misfit`, `slides`, `seen_through` and `nothing`. A value of
  // srf_pair_state, such as SRF_PAIR_STATE_NOTHING.
  uint64_t state;
  // Number of touches. Numbers of the scans that it touches, the nearest first.
  uint64_t touches_count;
  // Share of its surface that lies on the scan that shares most with it.
  double overlap;
  // Root mean square distance to the surfaces of the others, along normals. In the unit of the scans.
  double residual;
  // How well it is held against turning and sliding: 1 at best, 0 where it may turn or slide.
  double balance;
  // Of what the sensors can tell, the share that speaks against it.
  double seen_through;
  // How far its points moved, at most. In the unit of the scans.
  double moved;
  // Number of freedoms. Ways that it may turn or slide.
  uint64_t freedoms_count;
  // Ways that it may turn or slide. Those behind them are 0.
  srf_freedom freedoms[6];
} srf_snap_report;

// How the dominant plane is found. Lengths are in the unit of the scans. Starts with its size. Set to the defaults by
// srf_plane_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Samples that lie further off do not count for the plane. > 0. SRF_FROM_DATA, the default: three times the scatter of
  // its samples, at most a hundredth of the extent of the scans.
  double tolerance;
  // A plane on which a smaller share of the samples lies is refused. 0 to 1, default 0.05.
  double min_share;
  // Points that lie at most so far above the plane are removed with it. >= 0. SRF_FROM_DATA, the default: four times the
  // scatter of its samples.
  double margin;
} srf_plane_params;

// A plane in the world. Starts with its size. Prepared by srf_plane_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 1 if srf_dominant_plane() found it, else 0.
  uint32_t is_found;
  // On the plane.
  double point[3];
  // Of any length but 0. It points above.
  double normal[3];
  // Points that lie at most so far above the plane are removed with it.
  double margin;
  // Of one that was found: the share of the samples that lie on it.
  double share;
  // Of one that was found: how far these scatter about it, root mean square, in the unit of the scans.
  double spread;
} srf_plane;

// How registered scans are merged into one surface. Lengths are in the unit of the scans. Starts with its size. Set to the
// defaults by srf_merge_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square. > 0.
  // SRF_FROM_DATA, the default: 1.5 times the mean distance of neighbouring samples, or more if noise, the distance
  // between overlapping scans or little memory ask for it.
  double voxel;
  // Surfaces of different scans closer than this, facing the same way, become one. At least a voxel. Choose it above the
  // residual of the registration and below the thinnest wall. >= 0. SRF_FROM_DATA, the default: from the voxel and the
  // measured distance between overlapping scans.
  double merge_distance;
  // Holes whose boundary is at most this long are closed, if holes alone are closed. 0: all are left open. >= 0.
  // SRF_FROM_DATA, the default: 100 voxels, but at most a fifth of the diagonal of the connected part the hole is in.
  double max_hole_length;
  // Connected parts with fewer triangles than this share of the largest part's are dropped. Parts that no scan saw,
  // between layers of badly placed scans or out of their noise, are dropped in any case. 0: all are kept that scans are
  // evidence of. 0 to 1, default 0.
  double min_component_share;
  // Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
  // the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
  // pixels are not square.
  double edge_limit;
  // Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
  // grazing angle. Radians, > 0, at most pi/2, default pi/2.
  double grazing_limit;
  // Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ
  // from scan to scan. By up to a factor of eight: what differs more is of different things. Off: colours are averaged
  // as they are. 1 or 0, default 1.
  uint64_t match_exposure;
  // Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a
  // cell. All and those inside the scans are closed by a smooth fill, with the whole surface in memory. A value of
  // srf_close, default SRF_CLOSE_HOLES.
  uint64_t close;
  // Nothing is filled below the lowest measured point, so that what stood on the ground gets a flat foot instead of a
  // round one. It is for more than holes. Off: parts that nobody saw from below continue as their sides bend. 1 or 0,
  // default 0.
  uint64_t flat_base;
  // Direction away from the ground, where there is a flat base. A value of srf_base_up, default SRF_BASE_UP_Z.
  uint64_t base_up;
} srf_merge_params;

// The figures of a merge, among them those of the paper's tables. Starts with its size. Prepared by
// srf_merge_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Scans merged.
  uint64_t scans;
  // Triangles of all scans.
  uint64_t input_triangles;
  // Size of a cell that was used. In the unit of the scans.
  double voxel;
  // Rule that decided the size of a cell. A value of srf_voxel_reason, such as SRF_VOXEL_REASON_GIVEN.
  uint64_t voxel_reason;
  // Merge distance that was used. In the unit of the scans.
  double merge_distance;
  // Longest boundary that was closed. In the unit of the scans.
  double max_hole_length;
  // Median distance between overlapping scans along grid lines, as measured. There is none where no scans overlap. Then
  // it is SRF_FROM_DATA. In the unit of the scans.
  double overlap_residual;
  // Median standard deviation of the samples along their rays, as measured. 0 where scans are clean. In the unit of the
  // scans.
  double noise;
  // Median standard deviation of the samples of range images across the rays. It follows from how noise grows on
  // surfaces seen at an angle. In the unit of the scans.
  double noise_across;
  // Median step that values of range images along the ray are multiples of. 0 for none. In the unit of the scans.
  double noise_step;
  // Median number of pixels of range images over which errors depend on each other. 1 for white noise.
  double noise_correlation;
  // Cells that the scans span along x, y and z.
  uint64_t grid[3];
  // Intersections of scans with grid lines.
  uint64_t intersections;
  // Edges of the grid whose intersections were dropped since more scans see through there than have a surface there. A
  // triangle has about one and a half.
  uint64_t seen_through;
  // Intersections left after fusing.
  uint64_t fused_intersections;
  // Artificial intersections that became vertices.
  uint64_t artificial_intersections;
  // Triangles made directly (case a).
  uint64_t faces_direct;
  // Triangles made after analysis of the neighbouring cells (case b).
  uint64_t faces_settled;
  // Triangles that fill holes (case c).
  uint64_t faces_filling;
  // Holes closed.
  uint64_t holes_closed;
  // Boundary loops left open.
  uint64_t holes_open;
  // Connected parts dropped: those that no scan saw, and those that are too small.
  uint64_t dropped_components;
  // Triangles of the parts that were dropped.
  uint64_t dropped_faces;
  // Largest number of bytes that intersections and the surface held at once.
  uint64_t working_bytes;
  // Whether stages left in files what they leave for each other. 1 or 0.
  uint64_t in_files;
  // Length of the shortest edge of the surface. It is at least a hundredth of a cell. In the unit of the scans. Since
  // 0.2.
  double shortest_edge;
  // Holes of these that are open as a scan saw through where they would be closed. Since 0.2.
  uint64_t holes_seen_through;
  // Area that was filled, in the square of the unit of the scans. There is none where holes alone were closed. Then it
  // is SRF_FROM_DATA. Since 0.2.
  double filled_area;
  // Share of the area of the surface that was filled. There is none where holes alone were closed. Then it is
  // SRF_FROM_DATA. Since 0.2.
  double filled_share;
} srf_merge_report;

// How a range image is sculpted to few triangles. Starts with its size. Set to the defaults by srf_sculpt_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Largest distance between a sample and the mesh along the sample's ray. Larger values give fewer triangles. 0: every
  // sample is reproduced. >= 0. SRF_FROM_DATA, the default: the relative tolerance times the depth extent of the covered
  // samples.
  double tolerance;
  // The tolerance as a share of the depth extent, the difference between the farthest and the nearest range of the
  // covered samples. Used where no tolerance is given. >= 0, default 0.001.
  double relative_tolerance;
  // Work spent on fewer triangles at the same tolerance: 0 digs only, 1 also removes vertices, for about twice the time,
  // 2 searches for fewer yet, for about ten times the time. 0 to 2, default 1.
  uint64_t effort;
  // Every vertex is a sample. Off: vertices may leave their samples along the ray within the tolerance, for about a
  // sixth fewer triangles than effort 2 and a little more time. With effort 0, which moves nothing, it has no effect. 1
  // or 0, default 1.
  uint64_t interpolate;
  // Smallest angle, as seen from the sensor, of triangles made to replace others. Those of the digging keep theirs. 10
  // degrees cost up to 12 % more triangles. Radians, 0 to pi/6, default 0.
  double min_angle;
  // Smooths open borders, too, for fewer triangles: the mesh reaches at most half a pixel beyond them, covers all that
  // it did, and no other pixel. Needs an effort of at least 1. Off: borders stay as they are in the image but for
  // vertices on straight lines. 1 or 0, default 0.
  uint64_t simplify_borders;
  // Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
  // the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
  // pixels are not square.
  double edge_limit;
  // Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
  // grazing angle. Radians, > 0, at most pi/2, default pi/2.
  double grazing_limit;
} srf_sculpt_params;

// The figures of sculpting. Starts with its size. Prepared by srf_sculpt_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Tolerance that was used. In the unit of the scans.
  double tolerance;
  // Difference between the farthest and the nearest range of the covered samples. In the unit of the scans.
  double depth_extent;
  // Triangles of the mesh that has every covered sample.
  uint64_t full_triangles;
  // Triangles left out because they hide behind others, as seen along the rays. The tolerance does not hold for samples
  // that have only such triangles. These samples count as isolated.
  uint64_t hidden_triangles;
  // Triangles before vertices were removed.
  uint64_t dug_triangles;
  // Triangles of the mesh.
  uint64_t triangles;
  // Valid pixels that no mesh covers, for want of neighbours or because they are hidden behind others. The tolerance
  // does not hold for them.
  uint64_t isolated_pixels;
  // Largest distance between a sample and the mesh along the sample's ray. In the unit of the scans.
  double max_error;
  // Largest distance once coordinates are rounded to single precision, as STL, GLB and many programs keep them, at most.
  // In the unit of the scans.
  double max_error_single;
  // Root of the mean square of the distances. In the unit of the scans.
  double rms_error;
  // 95 % of the samples lie at most this far from the mesh. In the unit of the scans.
  double p95_error;
  // Row of the sample farthest from the mesh, the first one of several. There is none for an empty mesh. Then it is
  // UINT64_MAX.
  uint64_t worst_row;
  // Its column. There is none for an empty mesh. Then it is UINT64_MAX.
  uint64_t worst_col;
  // Samples that the mesh covers: their rays meet it.
  uint64_t covered_pixels;
} srf_sculpt_report;

// How a quad grid is made. Starts with its size. Set to the defaults by srf_quads_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Tiles from top to bottom. Every tile gets the same number of rows: more tiles spread them more evenly over the
  // image. 1 to 67108864. 0, the default: one tile every 64 rows of pixels, at least one.
  uint64_t tiles_down;
  // Tiles from left to right. Every tile gets the same number of columns: more tiles spread them more evenly over the
  // image. 1 to 67108864. 0, the default: one tile every 64 columns of pixels, at least one.
  uint64_t tiles_across;
  // Rows of vertices per tile, both borders counted. Neighbouring tiles share the row between them. Not used where an
  // error is asked for. 2 to 67108864, default 9.
  uint64_t rows;
  // Columns of vertices per tile, both borders counted. Neighbouring tiles share the column between them. Not used where
  // an error is asked for. 2 to 67108864, default 9.
  uint64_t columns;
  // Chooses rows and columns so that no sample is farther from the grid along its ray. Smaller values give more quads.
  // >= 0. SRF_FROM_DATA, the default: no limit, rows and columns are used as given.
  double max_error;
  // Chooses rows and columns so that the root of the mean square distance of the samples to the grid along their rays is
  // at most this. Smaller values give more quads. >= 0. SRF_FROM_DATA, the default: no limit, rows and columns are used
  // as given.
  double rms_error;
  // How often invalid pixels are filled with the mean of their valid neighbours. 0: never. 0 to 1024, default 1.
  uint64_t gap_passes;
  // Valid ones among the eight neighbours that an invalid pixel needs to be filled: 8 fills single pixels, fewer grow
  // into larger gaps, a pixel a pass. 1 to 8, default 8.
  uint64_t gap_neighbours;
  // Curvature that counts as 1 in the 8-bit curvature image, as a share of the depth extent. Smaller values let fine
  // relief attract vertices, and noise as well. > 0, default 0.001.
  double curvature_unit;
  // Largest value of the curvature image: stronger curvature, such as that of jumps, attracts no more vertices than
  // this. 1 to 255, default 255.
  uint64_t curvature_limit;
  // Density of vertices as this power of the curvature K. Larger values draw more vertices to strong curvature. 0: the
  // logarithm of the paper, log(1 + K). 0 to 4, default 0.7.
  double exponent;
  // Density spread evenly, as a share of the mean density. Large values give a uniform grid. 0: flat regions are left
  // without vertices. 0 to 1000000, default 2.
  double floor;
  // Size of the window that the density is averaged over, in quads. Larger values give smoother lines. 0: each row of
  // pixels is sampled for itself, as in the paper. 0 to 16, default 2.
  double smoothing;
  // Curvature given to invalid pixels, as in the paper (5 and 20 there). Larger values draw vertices to the background.
  // A whole number. 0 to 255. SRF_FROM_DATA, the default: none, the background attracts no vertices beyond the floor.
  double background_curvature;
  // Smallest share of valid pixels that a quad of the mesh may have. With more than 0 its corners must be valid too. 0:
  // every quad is kept, over the background as well. 0 to 1, default 0.5.
  double coverage;
} srf_quads_params;

// The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the pixels'
// quads, over all valid pixels of the image but those missed, with each quad cut along its better diagonal. On the
// background the grid continues the surface. Starts with its size. Prepared by srf_quads_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Tiles from top to bottom.
  uint64_t tiles_down;
  // Tiles from left to right.
  uint64_t tiles_across;
  // Difference between the farthest and the nearest range of the valid pixels. In the unit of the scans.
  double depth_extent;
  // Mean error as a share of the depth extent, the paper's relative error. 0 where all ranges are equal.
  double relative_error;
  // Relative error of the uniform grid of the same size.
  double uniform_relative_error;
  // Root of the mean square error. In the unit of the scans.
  double rms_error;
  // Root of the mean square error of the uniform grid. In the unit of the scans.
  double uniform_rms_error;
  // Largest error. In the unit of the scans.
  double max_error;
  // Largest error of the uniform grid. In the unit of the scans.
  double uniform_max_error;
  // Whether the result is the uniform grid, as the adaptive one lay no nearer. Vertices snapped to the border moved all
  // the same. 1 or 0.
  uint64_t is_uniform;
  // Valid pixels of the image.
  uint64_t valid_pixels;
  // Valid pixels whose rays do not meet the planes of their quad in front of the sensor. They have no error.
  uint64_t missed_pixels;
  // Missed pixels of the uniform grid.
  uint64_t uniform_missed_pixels;
  // Invalid pixels that were filled.
  uint64_t gaps_filled;
  // Vertices that were moved so that no quad folds over.
  uint64_t unfolded;
  // Vertices that were moved from the background onto the border of the surface.
  uint64_t snapped;
  // Quads of the mesh: those that are not on the background.
  uint64_t quads;
} srf_quads_report;

// How a surface is fitted to a quad grid. Starts with its size. Set to the defaults by srf_spline_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Order of the surface, its degree plus one: 2 is made of straight pieces, 4 is cubic. 2 to 4, default 4.
  uint64_t order;
  // Rows of control points, from the order to the grid's rows. Fewer make the surface smoother, in the sense of least
  // squares. 2 to 67108864. 0, the default: as many as the grid has, so that the surface runs through its vertices.
  uint64_t rows;
  // Columns of control points, from the order to the grid's columns. Fewer make the surface smoother, in the sense of
  // least squares. 2 to 67108864. 0, the default: as many as the grid has, so that the surface runs through its
  // vertices.
  uint64_t columns;
} srf_spline_params;

// How a surface is made through scattered points. Starts with its size. Set to the defaults by
// srf_reconstruct_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Makes the threshold on the perimeters of facets larger. Larger closes more gaps and keeps more stray points. 1 to 2,
  // default 1.
  double factor;
  // Length that the perimeter of a facet is compared with. A value of srf_threshold, default SRF_THRESHOLD_LOCAL.
  uint64_t threshold;
  // Form of the surface. A value of srf_topology, default SRF_TOPOLOGY_MANIFOLD.
  uint64_t topology;
  // Whether the points are of a closed surface. Only with a manifold topology. A value of srf_closure, default
  // SRF_CLOSURE_AUTO.
  uint64_t closure;
  // The surface is the one that points within this distance tell, and those far from any surface are left out. Larger
  // takes away more noise, and what is thin: bars thinner than twice this may tear. Smaller may leave good points out.
  // Less than the usual distance to the 16 nearest points counts as that distance. > 0. SRF_FROM_DATA, the default: the
  // distance at which points are best foretold by the others, if the noise of 1,024 points or more is more than 0.2
  // spacings, else points stay.
  double smooth;
  // Treatment of the noise of points. A value of srf_noisy_points, default SRF_NOISY_POINTS_MOVED.
  uint64_t noisy_points;
} srf_reconstruct_params;

// The figures of a surface through points. Starts with its size. Prepared by srf_reconstruct_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Points given.
  uint64_t points;
  // Points on the surface.
  uint64_t used;
  // Delaunay tetrahedra. None where the points lie in one plane.
  uint64_t tetrahedra;
  // Whether the surface is closed: it has no border, also not one of a gap or of facets left out. 1 or 0.
  uint64_t closed;
  // The threshold that was used: a perimeter with a global one, in mean spacings of a facet's points with a local one.
  double threshold;
  // Times the mean perimeter was taken, with the paper's carving or in a plane.
  uint64_t rounds;
  // Tetrahedra that changed sides to make the surface manifold.
  uint64_t repaired;
  // Points brought onto the surface afterwards.
  uint64_t gathered;
  // Facets left out: those over gaps, and those that kept the surface from being manifold.
  uint64_t cut_facets;
  // Parts turned over by normals, sensors or direction.
  uint64_t turned_parts;
  // Points dropped since a coordinate isn't finite.
  uint64_t not_finite;
  // Points dropped since they are at the same place as a point before them.
  uint64_t duplicates;
  // Points dropped inside of the surface.
  uint64_t inside;
  // Points dropped outside of the surface.
  uint64_t outside;
  // Noise of the points as measured: their standard deviation across the surface. 0 for fewer than 1,024. In the unit of
  // the scans. Since 0.2.
  double noise;
  // Side of a square of the surface that has one point, as measured. In the unit of the scans. Since 0.2.
  double spacing;
  // Radius within which the surface was smoothed. 0 if it goes through the points. It was so many times smaller or
  // larger where points that carry noise lie much closer together or further apart than usual. In the unit of the scans.
  // Since 0.2.
  double smoothing;
  // Root mean square of the distances by which smoothing moved the points on the surface. In the unit of the scans.
  // Since 0.2.
  double moved;
  // Points dropped since they are far from any surface that the others tell. Since 0.2.
  uint64_t outliers;
} srf_reconstruct_report;

// How a mesh, or points, are clustered. Starts with its size. Set to the defaults by srf_cluster_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Vertices wanted. More come only if the input's topology needs them, at most as many as the input has when cut to a
  // manifold. 1 to 4000000000. 0, the default: a tenth of the input's vertices.
  uint64_t vertices;
  // Patches wanted, instead of vertices: k patches give about 3 k vertices. 1 to 4000000000. 0, the default: about a
  // third of the vertices wanted.
  uint64_t patches;
  // Largest distance of any point of the input from the result and of the result from the input, instead of a number of
  // vertices: there are as many as it takes. > 0. SRF_FROM_DATA, the default: none, a number of vertices is asked for.
  double max_error;
  // How much smaller triangles are where the surface bends: 0 makes them alike everywhere, 1 gives the least mean
  // distance from the input. 0 to 2, default 1.
  double adaptivity;
  // Most Lloyd steps at the final number of patches. Fewer if they no longer gain. 0 to 10000, default 40.
  uint64_t iterations;
  // Most steps of the spring relaxation. 0: the fans stay as they are. 0 to 10000, default 50.
  uint64_t relaxation;
  // Rounds in which vertices leave the surface for where it lies nearest in the mean square. 1 takes a third off the
  // mean error, more lower the largest. 0: vertices stay on the surface. 0 to 100, default 0.
  uint64_t fitting;
  // Smallest angle of triangles that may have any shape for the least mean square distance, instead of one as even as
  // can be. Vertices leave the surface, in as many rounds as `fitting` says, but at least two. 30 degrees leave a third
  // of the mean error at the same number of vertices, in up to five times the time. 0: triangles are as even as can be.
  // Radians, 0 to pi/6, default 0.
  double min_angle;
  // Edges whose triangles turn by at least this angle are kept as edges of the result, where they make lines a few of
  // its edges long: those of parts and buildings. Noise makes no such lines. 0: no edge is kept. Radians, 0 to pi,
  // default 0.6981317007977318.
  double feature_angle;
  // Direction in which round patches are split. 0 to 4294967295, default 0.
  uint64_t seed;
  // Most triangles wanted, instead of vertices. So many come, or one fewer. More come only if the input's topology needs
  // them, at most as many as the input has. 1 to 4000000000. 0, the default: about a tenth of the input's.
  uint64_t triangles;
} srf_cluster_params;

// The figures of clustering. Starts with its size. Prepared by srf_cluster_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Patches made.
  uint64_t patches;
  // Vertices of the mesh.
  uint64_t vertices;
  // Triangles of the mesh.
  uint64_t triangles;
  // Parts of patches that became patches as they were not connected to the rest.
  uint64_t separated;
  // Parts and patches that were given to their neighbours.
  uint64_t dissolved;
  // Patches that were halved as they were no disks.
  uint64_t halved;
  // Edges of the input that were cut as they don't join two triangles of the same orientation.
  uint64_t cut_edges;
  // Points that are not on the surface through them. 0 for a mesh.
  uint64_t off_surface;
  // Weighted sum of the squared distances of the input's vertices to their centres, after the last step of k-means.
  double energy;
  // Before: Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral. Radians.
  double before_mean_smallest_angle;
  // Before: Smallest angle of all. Radians.
  double before_smallest_angle;
  // Before: Largest angle of all. Radians.
  double before_largest_angle;
  // After: Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral. Radians.
  double after_mean_smallest_angle;
  // After: Smallest angle of all. Radians.
  double after_smallest_angle;
  // After: Largest angle of all. Radians.
  double after_largest_angle;
  // No point of the input is farther from the mesh, and none of the mesh farther from the input, measured on the mesh.
  // Some point is nearly as far: the bound is seldom more than 1 % above it, unless a largest error was asked for. 0 for
  // the input itself. In the unit of the scans.
  double max_error;
  // Whether the mesh is the input, as nothing coarser was found within the largest error, or has its topology. 1 or 0.
  uint64_t kept_input;
  // Root mean square of the distances of the input's vertices from the mesh. In the unit of the scans. Since 0.2.
  double rms_error;
} srf_cluster_report;

// How the openings of a surface are closed. Lengths are in its unit. Starts with its size. Set to the defaults by
// srf_close_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a
  // cell. A value of srf_openings, default SRF_OPENINGS_ALL.
  uint64_t openings;
  // Longest boundary of an opening that is closed, if holes alone are closed. >= 0. SRF_FROM_DATA, the default: 100
  // cells.
  double max_hole_length;
  // Size of a cell of the merge that the surface is of. The fill has twice that size. > 0. SRF_FROM_DATA, the default:
  // 1.3 times the median edge of the surface.
  double cell;
  // How far the surface and the poses of its scans may be off: the merge distance. > 0. SRF_FROM_DATA, the default: a
  // cell.
  double merge_distance;
  // Nothing is filled below a plane under the surface, so that what stood on the ground gets a flat foot instead of a
  // round one. Off: parts that nobody saw from below continue as their sides bend. 1 or 0, default 0.
  uint64_t flat_base;
  // Closes too where scans saw through. These faces are marked in the attribute forced. Off: openings in seen space stay
  // open, and the report says where. 1 or 0, default 0.
  uint64_t force;
  // Direction away from the ground, where there is a flat base. A value of srf_base_up, default SRF_BASE_UP_Z.
  uint64_t base_up;
  // How far below the lowest measured point the flat base lies, if there is one. >= 0, default 0.
  double base_depth;
} srf_close_params;

// The figures of closing. Starts with its size. Prepared by srf_close_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Size of a cell of the merge that was used. In the unit of the scans. Since 0.2.
  double cell;
  // Size of a cell of the fill. It is twice a cell of the merge, more where memory asks for it. 0 if nothing was filled.
  // In the unit of the scans. Since 0.2.
  double fill_cell;
  // Merge distance that was used. In the unit of the scans. Since 0.2.
  double merge_distance;
  // Longest boundary that was closed. There is none where length does not matter. Then it is SRF_FROM_DATA. In the unit
  // of the scans. Since 0.2.
  double max_hole_length;
  // Whether scans said where nothing is. Without them openings are closed by their shape alone. 1 or 0. Since 0.2.
  uint64_t has_sight;
  // Openings closed. Since 0.2.
  uint64_t closed;
  // Openings left open as none was to be closed. Since 0.2.
  uint64_t left_not_asked;
  // Openings left open as their boundaries are longer than the longest hole. Since 0.2.
  uint64_t left_too_long;
  // Openings left open as they may be rims. Since 0.2.
  uint64_t left_not_enclosed;
  // Openings left open as a scan saw through where they would be closed. Since 0.2.
  uint64_t left_seen_through;
  // Openings left open as each fill would cross the surface. Since 0.2.
  uint64_t left_crossing;
  // Openings left open as the flat base cuts their fills. Since 0.2.
  uint64_t left_base;
  // Openings left open as their fills would turn the surface inside out. Since 0.2.
  uint64_t left_inside_out;
  // Length of the longest boundary of an opening that was closed. In the unit of the scans. Since 0.2.
  double largest_opening;
  // Vertices that were added. Since 0.2.
  uint64_t added_vertices;
  // Triangles that were added. Since 0.2.
  uint64_t added_triangles;
  // Area of the triangles that were added, in the square of the unit of the surface. Since 0.2.
  double filled_area;
  // Share of the result's area that was filled. Since 0.2.
  double filled_share;
  // Triangles that were filled where a scan saw through, as was asked for. Since 0.2.
  uint64_t forced_triangles;
  // Edges that are left open. Since 0.2.
  uint64_t open_edges;
  // Whether the result is a closed manifold. 1 or 0. Since 0.2.
  uint64_t is_closed;
} srf_close_report;

// How a mesh is checked before it is printed. Lengths are in its unit. Starts with its size. Set to the defaults by
// srf_check_print_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Thinnest wall that the printer makes: 0.8 mm for most. > 0. SRF_FROM_DATA, the default: none, walls are measured
  // only.
  double min_wall;
  // Walls are measured up to this thickness, and at least up to the thinnest wall that the printer makes. Thicker ones
  // count as so thick. > 0. SRF_FROM_DATA, the default: a tenth of the diagonal of the mesh's box.
  double max_wall;
  // Faces that look down and lean from the vertical by more than this need supports. Radians, 0 to pi/2, default pi/4.
  double overhang;
  // Direction away from the plate that is printed on. A value of srf_print_up, default SRF_PRINT_UP_Z.
  uint64_t print_up;
  // Width of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
  double printer_width;
  // Depth of the space that the printer fills. The print may also be turned by a quarter. > 0. SRF_FROM_DATA, the
  // default: any.
  double printer_depth;
  // Height of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
  double printer_height;
  // Weight of a unit of volume: 0.00124 for PLA, in grams and millimetres. > 0. SRF_FROM_DATA, the default: none, no
  // weight is computed.
  double density;
} srf_check_print_params;

// The figures of the checks for printing. Starts with its size. Prepared by srf_check_print_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Whether the mesh is an oriented manifold without openings. 1 or 0. Since 0.2.
  uint64_t is_closed;
  // Whether it is an oriented manifold, with or without openings. 1 or 0. Since 0.2.
  uint64_t is_manifold;
  // Openings: groups of open edges that hang together. Since 0.2.
  uint64_t openings;
  // Edges of one face. Since 0.2.
  uint64_t open_edges;
  // Edges of more than two faces. Since 0.2.
  uint64_t non_manifold_edges;
  // Vertices at which more than one fan of faces meets. Since 0.2.
  uint64_t non_manifold_vertices;
  // Edges whose two faces are turned against each other. Since 0.2.
  uint64_t misoriented_edges;
  // Pairs of faces that cross. This is exact. Since 0.2.
  uint64_t crossing_pairs;
  // Faces that cross another. Since 0.2.
  uint64_t crossing_faces;
  // Bodies: faces joined over edges. A cavity is a body, too. Since 0.2.
  uint64_t bodies;
  // Size along x. In the unit of the scans. Since 0.2.
  double size_x;
  // Size along y. In the unit of the scans. Since 0.2.
  double size_y;
  // Size along z. In the unit of the scans. Since 0.2.
  double size_z;
  // Whether it fits into the printer, as it is or turned by a quarter about the vertical. 1 or 0. Since 0.2.
  uint64_t is_fitting;
  // Volume of all bodies together, in the cube of the unit of the mesh. There is none unless the mesh is closed. Then it
  // is SRF_FROM_DATA. Since 0.2.
  double volume;
  // Volume times density. There is none without either. Then it is SRF_FROM_DATA. Since 0.2.
  double weight;
  // Thickness up to which walls are measured. In the unit of the scans. Since 0.2.
  double wall_limit;
  // Thickness of the thinnest wall. There is none if no wall is thinner than they are measured. Then it is
  // SRF_FROM_DATA. In the unit of the scans. Since 0.2.
  double thinnest_wall;
  // Number of the face in front of the thinnest wall, counted from 0. There is none without such a wall. Then it is
  // UINT64_MAX. Since 0.2.
  uint64_t thinnest_face;
  // Faces whose walls are thinner than the thinnest wall that the printer makes, by more than the error of measuring, 2
  // %. Since 0.2.
  uint64_t thin_faces;
  // Largest distance of a corner from the centre of its face. Walls are measured at centres. Where faces are larger than
  // walls are thick, a wall may be thinner between them. In the unit of the scans. Since 0.2.
  double wall_spacing;
  // Faces that hang over and do not lie on the ground. Since 0.2.
  uint64_t overhang_faces;
  // Area of the faces that hang over, in the square of the unit of the mesh. Since 0.2.
  double overhang_area;
} srf_check_print_report;

// How a closed mesh is made ready for printing. Each step is left out unless its parameter is given. Lengths are in the
// unit of the result: if the mesh is scaled, in that of the scaled one. Meshes of scans are in metres. Starts with its
// size. Set to the defaults by srf_prepare_print_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Length of the side of the result: 0.1 for a print of 10 cm, if the unit is a metre. All sides are scaled alike. > 0,
  // at most 1e30. SRF_FROM_DATA, the default: the size stays.
  double scale_to;
  // The side that gets this length. A value of srf_scale_side, default SRF_SCALE_SIDE_LONGEST.
  uint64_t scale_side;
  // Stands the mesh on a flat face: the part below the height of the base is cut off. Off: nothing is cut off. 1 or 0,
  // default 0.
  uint64_t flat_base;
  // Height of the base above the lowest point. > 0. SRF_FROM_DATA, the default: 0 if the mesh stands on a face, else at
  // most a 50th of its height.
  double base_height;
  // Thinnest wall that the printer makes. Thinner ones are made as thick, where there is room. > 0. SRF_FROM_DATA, the
  // default: no wall is moved.
  double min_wall;
  // Thickness of the walls around a cavity. Larger ones make smaller cavities. > 0. SRF_FROM_DATA, the default: nothing
  // is hollowed out.
  double hollow;
  // Size of the cells in which the cavity is made, at most a third of the walls. Smaller ones take more memory and time.
  // > 0. SRF_FROM_DATA, the default: a 256th of the longest side, but from a quarter to a third of the walls.
  double hollow_cell;
  // Diameter of a hole that leads from the base into the cavity, so that resin or powder runs out. It needs a base and a
  // cavity. > 0. SRF_FROM_DATA, the default: the cavity stays shut.
  double drain;
  // Sides of the hole, which is a prism. 3 to 1024, default 32.
  uint64_t drain_sides;
  // Size across up of the space that the printer fills: along x, or along y if up is along x. Larger meshes are cut into
  // parts. > 0. SRF_FROM_DATA, the default: any.
  double printer_width;
  // Size across up of the space that the printer fills: along y, or along z if up is not along z. > 0. SRF_FROM_DATA,
  // the default: any.
  double printer_depth;
  // Size along up of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
  double printer_height;
  // Direction away from the plate that is printed on. A value of srf_print_up, default SRF_PRINT_UP_Z.
  uint64_t print_up;
} srf_prepare_print_params;

// The figures of preparing a print. Lengths are in the unit of the result. Starts with its size. Prepared by
// srf_prepare_print_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Factor by which the mesh was scaled. 1 if it was not. Since 0.2.
  double scale;
  // Size along x. In the unit of the scans. Since 0.2.
  double size_x;
  // Size along y. In the unit of the scans. Since 0.2.
  double size_y;
  // Size along z. In the unit of the scans. Since 0.2.
  double size_z;
  // Volume before all steps, in the cube of the unit of the input. Since 0.2.
  double volume_before;
  // Volume of the result. Since 0.2.
  double volume;
  // Largest distance by which a vertex that was kept moved, but for scaling. In the unit of the scans. Since 0.2.
  double deviation;
  // Faces that were added. The attribute added marks them. Since 0.2.
  uint64_t added_faces;
  // Height of the base above the lowest point. There is none if no base was asked for. Then it is SRF_FROM_DATA. In the
  // unit of the scans. Since 0.2.
  double base_height;
  // Faces of the base. Since 0.2.
  uint64_t base_faces;
  // Area of the base without a hole in it, in the square of the unit. Since 0.2.
  double base_area;
  // Thickness of the thinnest wall before walls were thickened, measured behind the centres of faces. There is none if
  // that was not asked for, or no wall is thinner than twice that. Then it is SRF_FROM_DATA. In the unit of the scans.
  // Since 0.2.
  double wall_before;
  // Thickness of the thinnest wall after that. Faces beside a wall tilt when its sides move apart. So a wall at a sharp
  // edge may be thinner than the thinnest before. Then it is SRF_FROM_DATA. In the unit of the scans. Since 0.2.
  double wall_after;
  // Faces that moved when walls were thickened. Since 0.2.
  uint64_t moved_faces;
  // Faces of the result whose walls are thinner than asked for. The attribute thin marks them. Since 0.2.
  uint64_t thin_faces;
  // Cell in which the cavity was made. The walls are as thick as asked for within one. Then it is SRF_FROM_DATA. In the
  // unit of the scans. Since 0.2.
  double hollow_cell;
  // Least distance of the cavity from the surface. It is measured at the vertices and the centres of the faces of the
  // cavity. There is none without a cavity. Then it is SRF_FROM_DATA. In the unit of the scans. Since 0.2.
  double thinnest_wall;
  // Largest distance of the cavity from the surface, measured likewise. Then it is SRF_FROM_DATA. In the unit of the
  // scans. Since 0.2.
  double thickest_wall;
  // Cavities that no hole leads into. Since 0.2.
  uint64_t shut_cavities;
  // Diameter of the largest hole that would find room. There is none if no drain was asked for. Then it is
  // SRF_FROM_DATA. In the unit of the scans. Since 0.2.
  double drain_room;
  // Whether a hole was made. 1 or 0. Since 0.2.
  uint64_t is_drained;
  // Parts that it was cut into. 1 if it was not cut. Since 0.2.
  uint64_t parts;
} srf_prepare_print_report;

// How a mesh gets its texture coordinates. Starts with its size. Set to the defaults by srf_unwrap_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Tiles to fill, as densely as they hold the charts. 1 to 100. 0, the default: one.
  uint64_t tiles;
  // Texels per unit of length on the surface, in as many tiles as that takes. > 0. SRF_FROM_DATA, the default: as many
  // as fit the tiles.
  double texels_per_unit;
  // Columns and rows of a tile, in texels. 16 to 16384, default 2048.
  uint64_t size;
  // Texels that stay free around each chart, twice as many between two. Mipmaps of level n need 2^n. 0 to 256, default
  // 4.
  uint64_t padding;
  // Largest angle between the normal of a triangle and the mean normal of its chart. Smaller angles make flatter charts
  // and more of them. Radians, 0.017453292519943295 to 1.5533430342749532, default 1.2217304763960306.
  double cone;
  // Largest factor by which the area of a triangle in the texture may differ from its share of the chart, either way.
  // Charts that exceed it are split. 1.1 to 1000, default 4.
  double max_stretch;
} srf_unwrap_params;

// The figures of unwrapping. Starts with its size. Prepared by srf_unwrap_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Charts. Since 0.2.
  uint64_t charts;
  // Charts before small ones were joined to their neighbours. Since 0.2.
  uint64_t charts_before;
  // Tiles. Since 0.2.
  uint64_t tiles;
  // Share of the tiles that triangles cover. Since 0.2.
  double used;
  // Texels per unit of length: the root of the texels that triangles cover over their area on the surface. Since 0.2.
  double texels_per_unit;
  // Mean stretch over the surface. The stretch of a triangle is the larger of its longest stretched length and the
  // inverse of its shortest one, as a multiple of the texels per unit. 1 is none. Since 0.2.
  double stretch;
  // Nineteen twentieths of the surface are stretched less. Since 0.2.
  double stretch_p95;
  // Triangles that have no area in the texture: degenerate ones, and those too thin for single precision. Since 0.2.
  uint64_t collapsed;
  // Their share of the surface. Since 0.2.
  double collapsed_area;
  // Vertices that were moved as single precision turned one of their triangles. Since 0.2.
  uint64_t moved;
} srf_unwrap_report;

// How a mesh gets its textures. Starts with its size. Set to the defaults by srf_texture_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Columns and rows of a tile, in texels. 16 to 16384, default 2048.
  uint64_t size;
  // Poses of the cameras are moved a little until the photos agree with each other on the surface. Off: cameras stay
  // where they are. 1 or 0, default 1.
  uint64_t refine_cameras;
  // Photos are made equally bright, channel by channel: exposure and white balance differ from photo to photo. Off:
  // colours are taken as they are. 1 or 0, default 1.
  uint64_t match_exposure;
  // Of three photos and more that see a place the brightest is left out where it is brighter than the others:
  // reflections of lamps only add light. Off: highlights are averaged with the rest. 1 or 0, default 1.
  uint64_t drop_highlights;
  // A normal map is made, in the tangent space of MikkTSpace, y up. Off: none is made. 1 or 0, default 0.
  uint64_t normal_map;
  // A map of the height of the detailed surface over the mesh is made. Off: none is made. 1 or 0, default 0.
  uint64_t height_map;
  // Rays per place of the map of ambient occlusion. 16 suffice for most. 0: none is made. 0 to 4096, default 0.
  uint64_t occlusion_rays;
} srf_texture_params;

// A photo, and how it was used. Starts with its size. Prepared by srf_textured_photo_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Texels that it sees. Since 0.2.
  uint64_t texels;
  // Factors of its light: red, green, blue. Since 0.2.
  double gain[3];
  // Distance by which its camera was moved: pixels, in the root mean square over the surface. Since 0.2.
  double moved;
} srf_textured_photo;

// The figures of texturing. Starts with its size. Prepared by srf_texture_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Tiles. Since 0.2.
  uint64_t tiles;
  // Texels that triangles cover. Since 0.2.
  uint64_t texels;
  // Texels that a photo sees. Since 0.2.
  uint64_t seen;
  // Number of photos. The photos, in the order in which they were given. Since 0.2.
  uint64_t photos_count;
  // Grey by which the photos differed before cameras were moved. There is none if no camera could be moved. Then it is
  // SRF_FROM_DATA. Since 0.2.
  double difference_before;
  // Grey by which the photos differ after that. There is none if no camera could be moved. Then it is SRF_FROM_DATA.
  // Since 0.2.
  double difference_after;
  // Height that 0 of the height map stands for. There is none without a height map. Then it is SRF_FROM_DATA. In the
  // unit of the scans. Since 0.2.
  double lowest;
  // Height that 65,535 of the height map stands for. There is none without a height map. Then it is SRF_FROM_DATA. In
  // the unit of the scans. Since 0.2.
  double highest;
} srf_texture_report;

// Errors that a virtual scanner adds to the truth. The defaults add nothing. Starts with its size. Set to the defaults by
// srf_scan_params_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
  // number.
  uint32_t threads;
  // Standard deviation of the Gaussian noise along each ray. >= 0, default 0.
  double noise;
  // Growth of the noise where the surface is seen at a grazing angle: it is multiplied by 1 + growth * (1 / cos - 1),
  // with the cosine between ray and normal, at least 0.05. 0 to 100, default 0.
  double noise_grazing;
  // Values are rounded to multiples of this step. 0: they stay as they are. >= 0, default 0.
  double quantum;
  // Share of the pixels that give no value, whatever they see. 0 to 1, default 0.
  double dropout;
  // Share of further pixels that give no value where the ray grazes the surface. It falls with (1 - cos)^4 to 0 where
  // the ray is perpendicular to the surface. 0 to 1, default 0.
  double dropout_grazing;
  // Largest distance from the sensor at which a surface is seen. Orthographic sensors are infinitely far away and take
  // none. > 0. SRF_FROM_DATA, the default: none, everything in sight is seen.
  double max_range;
  // Triangles seen from behind give values too. Off: they hide what is behind them and give none. 1 or 0, default 0.
  uint64_t backfaces;
  // Standard deviation, along each axis, of the error of the reported position: how badly the scans are registered. >=
  // 0, default 0.
  double pose_shift;
  // Standard deviation of the angle of the error of the reported orientation, about the centre of what was seen.
  // Radians, 0 to pi, default 0.
  double pose_turn;
  // Number all randomness follows from. Give each scan its own. 0 to 9007199254740992, default 0.
  uint64_t seed;
} srf_scan_params;

// Distances of points, or of a surface, from another surface. All figures but `bias` are of absolute values. Starts with
// its size. Prepared by srf_distance_report_init().
typedef struct {
  // Bytes of this struct.
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Distances that were measured: of the points, or of the surface's vertices.
  uint64_t count;
  // Their mean. In the unit of the scans.
  double mean;
  // Root of their mean square. In the unit of the scans.
  double rms;
  // The smallest value that at least 95 % of them do not exceed. In the unit of the scans.
  double p95;
  // The largest of them. In the unit of the scans.
  double max;
  // Their mean with signs. Without signs it is the mean. In the unit of the scans.
  double bias;
  // Index of the largest, the first of several. There is none where nothing was measured. Then it is UINT64_MAX.
  uint64_t worst;
  // Largest distance that was found on a surface, between its vertices too. There is none for points. Then it is
  // SRF_FROM_DATA. In the unit of the scans.
  double reached;
  // No point of the surface is farther. It is within 1 % of `reached`, or above it by a millionth of the extent of the
  // other surface, unless that takes more than 8 measurements for each vertex and 100,000. There is none for points.
  // Then it is SRF_FROM_DATA. In the unit of the scans.
  double bound;
} srf_distance_report;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// ==== 1. The library: errors, threads, memory, progress ====================================================
// A call that failed says why. Threads, memory and the log are set for the process, or for a context.
//
//     /* Ends a program whose call failed. */
//     static void must(srf_status status)
//     {
//         if (status == SRF_OK) return;
//         fprintf(stderr, "%s\n", srf_last_error_message());
//         exit(1);
//     }
//
//     /* Whether the library that was loaded does what the program was built for. */
//     static int fits(void)
//     {
//         printf("surfrecon %s\n", srf_version());
//         return srf_abi_version() == SRF_ABI_VERSION && srf_version_number() >= SRF_VERSION;
//     }
//
//     /* Prints a message of the log, behind the name that the log was set with. */
//     static void print_message(int32_t level, const char *text, void *user)
//     {
//         fprintf(stderr, "%s: %s%s\n", (const char *)user, level == SRF_LOG_LEVEL_WARNING ? "warning: " : "", text);
//     }
//
//     /* Sets up a program: 4 threads, 8 GB, and a log. */
//     static void set_up(char *name)
//     {
//         must(srf_set_threads(4));
//         must(srf_set_memory_limit(8000000000u));
//         must(srf_set_log(print_message, name));
//         printf("%u threads, %g bytes\n", srf_threads(), (double)srf_memory_limit());
//     }
//
//     /* Merges with settings of its own, as one of several plugins of a program does. */
//     static srf_status merge_apart(const srf_merger *merger, char *name, srf_mesh **out_mesh)
//     {
//         srf_context *context, *former;
//         uint32_t threads;
//         uint64_t held;
//         srf_status status;
//         must(srf_context_create(&context));
//         must(srf_context_set_threads(context, 2));
//         must(srf_context_set_memory_limit(context, 2000000000u));
//         must(srf_context_set_log(context, print_message, name));
//         must(srf_context_use(context, &former));
//         status = srf_merger_run(merger, NULL, NULL, out_mesh, NULL);
//         must(srf_context_use(former, NULL));
//         must(srf_context_threads(context, &threads));
//         must(srf_context_memory(context, NULL, &held));
//         printf("%u threads; what was made holds %g bytes\n", threads, (double)held);
//         must(srf_context_free(context));
//         return status;
//     }
//
//     /* Shows the progress of a call, which goes on. */
//     static int32_t show_progress(const char *stage, double fraction, const char *message, void *user)
//     {
//         (void)stage, (void)fraction, (void)user;
//         fprintf(stderr, "\r%s", message);
//         return 0;
//     }
//
//     /* Merges with progress, until what is handed to a button for stopping is set. */
//     static srf_status merge_until_stopped(const srf_merger *merger, void (*set_button)(srf_cancel *),
//                                           srf_mesh **out_mesh)
//     {
//         srf_progress progress;
//         srf_cancel *cancel;
//         srf_status status;
//         must(srf_cancel_create(&cancel));
//         set_button(cancel);
//         progress.report = show_progress;
//         progress.user = NULL;
//         progress.cancel = cancel;
//         status = srf_merger_run(merger, NULL, &progress, out_mesh, NULL);
//         set_button(NULL);
//         must(srf_cancel_free(cancel));
//         return status;
//     }
//
//     /* Stops calls on whatever thread, and lets later ones run once it is pressed again. */
//     static void press_button(srf_cancel *cancel)
//     {
//         uint32_t is_set;
//         must(srf_cancel_is_set(cancel, &is_set));
//         must(is_set ? srf_cancel_reset(cancel) : srf_cancel_set(cancel));
//     }
//
//     /* Fails as a function of the program's does that the library calls: with a text. */
//     static int32_t fail(void)
//     {
//         const char *text;
//         must(srf_status_text(SRF_ERR_IO, &text));
//         fprintf(stderr, "%s\n", text);
//         must(srf_set_last_error("the camera is not plugged in"));
//         return SRF_ERR_IO;
//     }
//
//     /* Has the library's memory come from functions of the program's, before any other call. */
//     static void use_memory_of(srf_allocate_fn allocate, srf_deallocate_fn deallocate)
//     {
//         const srf_allocator allocator = {allocate, NULL, deallocate, NULL};
//         must(srf_set_allocator(&allocator));
//     }

// Version of the loaded library, for example "0.2.0". Static text, never NULL. Since 0.1.
const char *srf_version(void);

// Version of the loaded library as a number that compares, for example with SRF_VERSION of the header. Since 0.2.
uint32_t srf_version_number(void);

// Number of the binary interface of the loaded library. It must equal SRF_ABI_VERSION of the header the program was built with. Since 0.1.
uint32_t srf_abi_version(void);

// Text of the last error of this thread: what is wrong and, where there is one, the remedy. Empty if no call has failed, never NULL. Valid
// until the next call that fails on this thread. UTF-8. Since 0.1.
const char *srf_last_error_message(void);

// Says what went wrong in a function that the library calls (srf_image_source): becomes the text of the last error of this thread.
// text       UTF-8. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT for text that is not UTF-8, SRF_ERR_NULL. Since 0.2.
srf_status srf_set_last_error(const char *text);

// Short text of a status, for example "cancelled".
// out_text   receives a static text on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER if there is no such status, SRF_ERR_NULL. Since 0.1.
srf_status srf_status_text(int32_t status, const char **out_text);

// Worker threads of calls whose parameters say 0, unless made under a context with a number of its own. Results are the same for any
// number.
// threads    at most 1024. 0, the default, for one per core
// returns    SRF_OK, SRF_ERR_PARAMETER. Since 0.1.
srf_status srf_set_threads(uint32_t threads);

// Number set by srf_set_threads. Since 0.1.
uint32_t srf_threads(void);

// Most memory that calls may take, unless made under a context with a limit of its own. It is for all together, if several run at a time
// under the same context or under none. It limits calls, not what they leave. Meshes, images and the like that were handed out before do
// not count, however much they are, unless another call was running all the time since. A call that is foreseen to need more, or more than
// is free, is refused with SRF_ERR_OUT_OF_MEMORY before it begins. A call that turns out to need more ends with it then, and leaves
// nothing behind.
// bytes      0, the default, for all that is free
// returns    SRF_OK. Since 0.1.
srf_status srf_set_memory_limit(uint64_t bytes);

// Number set by srf_set_memory_limit. Since 0.1.
uint64_t srf_memory_limit(void);

// Sets who gets the messages of the log from now on, unless of calls under a context with a log of its own.
// log        NULL for nobody, the default
// user       handed to log as it is. Must stay usable until another log is set and calls on other threads have returned
// returns    SRF_OK. Since 0.1.
srf_status srf_set_log(srf_log_fn log,
                       void *user);

// Makes a context. Its worker threads are its own, started when they are first needed.
// out_context  receives a new handle on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY where there are 1023 already. Things made under one count as it until they are
//              freed, too. Since 0.2.
srf_status srf_context_create(srf_context **out_context);

// Releases a context. Calls that began under it end under it, and threads that use it go on with it until they use another one. But
// nothing is told to a log any more under it. Things made under it stay.
// context    NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
srf_status srf_context_free(srf_context *context);

// Calls that this thread makes from now on are made under this context. Other threads are not concerned. A function of yours that is
// called by the library on one of its own threads is under the context of the call that it serves. If it uses another one, it must put
// back the former one at its end. That works as well if that one was freed meanwhile.
// context      NULL for none: the settings of the process
// out_former   receives what this thread used before, NULL for none, which may have been freed since. NULL if not wanted
// returns      SRF_OK, SRF_ERR_HANDLE: all is as it was. Since 0.2.
srf_status srf_context_use(srf_context *context,
                           srf_context **out_former);

// Worker threads of calls under a context whose parameters say 0. Results are the same for any number.
// context    not NULL
// threads    at most 1024. 0, the default, for the number of srf_set_threads()
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_context_set_threads(srf_context *context, uint32_t threads);

// Number set by srf_context_set_threads().
// context      not NULL
// out_threads  receives the number on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_context_threads(const srf_context *context, uint32_t *out_threads);

// Most memory that calls under a context may take. It is for all together, if several run at a time. Memory of others, under another
// context or under none, does not count, nor does their limit concern this one. It limits calls, not what they leave. Meshes, images and
// the like that were handed out before do not count, however much they are, unless another call of the context was running all the time
// since. srf_context_memory() says how much that is. Memory that is given back, by whatever thread, is no longer taken.
// context    not NULL
// bytes      0, the default, for as much as srf_set_memory_limit() says
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_context_set_memory_limit(srf_context *context,
                                        uint64_t bytes);

// Memory of a context.
// context    not NULL
// out_limit  receives the number set by srf_context_set_memory_limit(). NULL if not wanted
// out_held   receives the bytes that its calls, and what was made under it, hold now. NULL if not wanted
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_context_memory(const srf_context *context, uint64_t *out_limit, uint64_t *out_held);

// Sets who gets the messages of calls under a context from now on.
// context    not NULL
// log        NULL, the default, for who gets those of the process (srf_set_log()). A function that does nothing, for nobody
// user       handed to log as it is. Must stay usable until another log is set or the context freed, and calls under it that were running
//            then have returned
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_context_set_log(srf_context *context,
                               srf_log_fn log,
                               void *user);

// Takes the library's memory from functions of the program's, for the whole process and once. Call it before any other function of this
// library, but for those that tell its version or the last error, and while no other thread is in one. If it is refused it may be called
// again. The memory is counted and limited as the system's is. Memory that they refuse is SRF_ERR_OUT_OF_MEMORY. Not taken from them:
// stacks of worker threads, what the system's own functions take, and a few small blocks in want of memory.
// allocator  not NULL
// returns    SRF_OK, SRF_ERR_INPUT if the library holds memory already, SRF_ERR_NULL. Since 0.2.
srf_status srf_set_allocator(const srf_allocator *allocator);

// Makes a switch that cancels calls. It is not set.
// out_cancel  receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_NULL. Since 0.2.
srf_status srf_cancel_create(srf_cancel **out_cancel);

// Releases it. A call that has it goes on, and can no longer be cancelled by it.
// cancel     NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
srf_status srf_cancel_free(srf_cancel *cancel);

// Cancels all calls that have it, and those that begin with it from now on: they return SRF_ERR_CANCELLED within a tenth of a second.
// Async-signal-safe: it looks at atomics and stores one, takes no lock and no memory, and changes neither errno nor the text of the last
// error, also where it fails. So a handler of SIGINT may call it.
// cancel     not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cancel_set(srf_cancel *cancel);

// Takes that back for calls that begin from now on. One that is running and has not yet noticed may go on as well.
// cancel     not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cancel_reset(srf_cancel *cancel);

// Whether it is set.
// cancel      not NULL
// out_is_set  receives 1 or 0 on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cancel_is_set(const srf_cancel *cancel, uint32_t *out_is_set);

// ==== 2. Range images ======================================================================================
// A range image is made of samples, of how its pixels see and of where its sensor stood.
//
//     /* Makes a range image of depths in metres, row after row. */
//     static srf_status from_depths(const double *depths, size_t rows, size_t cols, srf_image **out_image)
//     {
//         const srf_array samples = {depths, rows * cols, 0, SRF_TYPE_F64, 1};
//         srf_projection camera;
//         const srf_status status = srf_projection_pinhole(525, 525, 319.5, 239.5, 0, &camera);
//         if (status != SRF_OK) return status;
//         return srf_image_create(rows, cols, &camera, &samples, NULL, "first", out_image);
//     }
//
//     /* How the others see: heights half a unit apart, a scanner that turns by a milliradian, points of a grid. */
//     static srf_status other_projections(srf_projection projections[4])
//     {
//         static const double down[3] = {0, 0, -1}, eye[3] = {0, 0, 1.6};
//         srf_status status = srf_projection_orthographic(0, 0, 0.5, -0.5, &projections[0]);
//         if (status == SRF_OK) status = srf_projection_spherical(0, 0.7, 0.001, -0.001, &projections[1]);
//         if (status == SRF_OK) status = srf_projection_grid_parallel(down, &projections[2]);
//         if (status == SRF_OK) status = srf_projection_grid_from(eye, &projections[3]);
//         return status;
//     }
//
//     /* Makes a range image of a frame of a phone: 192 x 256 depths in millimetres, and a photo of 1440 x 1920 pixels. */
//     static srf_status from_phone(const uint16_t *depths, const uint8_t *photo, srf_image **out_image)
//     {
//         const srf_array samples = {depths, 192 * 256, 0, SRF_TYPE_U16, 1};
//         const srf_array colours = {photo, 1440 * 1920, 0, SRF_TYPE_U8, 3};
//         srf_left_out_report left_out;
//         srf_frame frame;
//         srf_status status;
//         srf_left_out_report_init(&left_out);
//         srf_frame_init(&frame);
//         frame.rows = 192;
//         frame.cols = 256;
//         frame.intrinsics[0] = frame.intrinsics[1] = 212;
//         frame.intrinsics[2] = 127.5;
//         frame.intrinsics[3] = 95.5;
//         frame.scale = 0.001;
//         frame.reach = 5;
//         frame.colour_rows = 1440;
//         frame.colour_cols = 1920;
//         status = srf_image_from_frame(&frame, &samples, &colours, NULL, NULL, "first", NULL, out_image, &left_out);
//         if (status == SRF_OK) printf("%g samples are too far\n", (double)left_out.out_of_reach);
//         return status;
//     }
//
//     /* Names an image, places its sensor, and gives its pixels colours. */
//     static srf_status name_and_place(srf_image *image, const srf_pose *world_from_sensor, const uint8_t *colours)
//     {
//         size_t rows = 0, cols = 0;
//         srf_status status = srf_image_set_name(image, "front");
//         if (status == SRF_OK) status = srf_image_set_pose(image, world_from_sensor);
//         if (status == SRF_OK) status = srf_image_size(image, &rows, &cols, NULL);
//         if (status == SRF_OK) {
//             const srf_array of_pixels = {colours, rows * cols, 0, SRF_TYPE_U8, 4};
//             status = srf_image_set_attributes(image, &of_pixels, NULL, NULL);
//         }
//         return status;
//     }
//
//     /* Prints what an image is, and where the ray of its first pixel leads. */
//     static srf_status print_image(const srf_image *image)
//     {
//         double sensor[3], origin[3], direction[3];
//         srf_array samples, colours;
//         srf_projection projection;
//         const char *name;
//         srf_status status = srf_image_name(image, &name);
//         if (status == SRF_OK) status = srf_image_camera(image, &projection, NULL);
//         if (status == SRF_OK) status = srf_image_samples(image, &samples);
//         if (status == SRF_OK) status = srf_image_attributes(image, &colours, NULL, NULL);
//         if (status == SRF_OK) status = srf_image_sensor(image, sensor);
//         if (status == SRF_OK) status = srf_image_ray(image, 0, 0, origin, direction);
//         if (status != SRF_OK) return status;
//         printf("%s: %u numbers a pixel of kind %u\n", name, samples.components, projection.kind);
//         puts(colours.count > 0 ? "with colours" : "without colours");
//         if (sensor[0] == sensor[0]) printf("seen from %g %g %g in the world\n", sensor[0], sensor[1], sensor[2]);
//         printf("its first pixel looks along %g %g %g\n", direction[0], direction[1], direction[2]);
//         return SRF_OK;
//     }
//
//     /* Copies the measured points of an image, in the world; free() releases them. */
//     static srf_status copy_points(const srf_image *image, double **out_points)
//     {
//         size_t rows = 0, cols = 0;
//         srf_status status = srf_image_size(image, &rows, &cols, NULL);
//         if (status != SRF_OK) return status;
//         *out_points = (double *)malloc(3 * rows * cols * sizeof(double));
//         if (*out_points == NULL) return SRF_ERR_OUT_OF_MEMORY;
//         return srf_image_world_points(image, *out_points, 3 * rows * cols, NULL);
//     }
//
//     /* Makes a mesh and points of an image, the mesh without what is seen at a grazing angle, and releases the image. */
//     static srf_status mesh_and_points(srf_image *image, srf_mesh **out_mesh, srf_cloud **out_cloud)
//     {
//         srf_triangulate_params params;
//         srf_status status;
//         srf_triangulate_params_init(&params);
//         params.grazing_limit = 1.4;
//         status = srf_image_triangulate(image, &params, NULL, out_mesh);
//         if (status == SRF_OK) {
//             status = srf_image_to_cloud(image, NULL, out_cloud);
//             if (status != SRF_OK) srf_mesh_free(*out_mesh);
//         }
//         srf_image_free(image);
//         return status;
//     }

// Sets the defaults. Call srf_triangulate_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_triangulate_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_triangulate_params_init_sized(srf_triangulate_params *params, size_t size);
#define srf_triangulate_params_init(params) srf_triangulate_params_init_sized((params), sizeof(srf_triangulate_params))

// Says how a depth camera sees, which looks along z with x to the right and y down.
// fx, fy          focal lengths in pixels, across and down. Not 0
// cx, cy          column and row of the principal point. Pixel centres lie at whole numbers
// along_ray       0 if the values of an image are depths along z, 1 if they are distances along the rays
// out_projection  receives it on SRF_OK only. Not NULL
// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
srf_status srf_projection_pinhole(double fx,
                                  double fy,
                                  double cx,
                                  double cy,
                                  uint32_t along_ray,
                                  srf_projection *out_projection);

// Says that an image is a height map: rays along -z, its values are z.
// first_x, first_y  place of pixel (0, 0)
// step_x            x from column to column. Not 0
// step_y            y from row to row. Below 0 where row 0 is at the top. Not 0
// out_projection    receives it on SRF_OK only. Not NULL
// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
srf_status srf_projection_orthographic(double first_x,
                                       double first_y,
                                       double step_x,
                                       double step_y,
                                       srf_projection *out_projection);

// Says how a terrestrial scanner sees: its values are distances along the rays. Angles are in radians. Azimuths turn from +x toward +y,
// elevations from the horizon toward +z.
// azimuth         of column 0
// elevation       of row 0
// azimuth_step    from column to column. Not 0
// elevation_step  from row to row. Below 0 where row 0 is the highest. Not 0
// out_projection  receives it on SRF_OK only. Not NULL
// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
srf_status srf_projection_spherical(double azimuth,
                                    double elevation,
                                    double azimuth_step,
                                    double elevation_step,
                                    srf_projection *out_projection);

// Says that an image has a point per pixel, seen along parallel rays.
// direction       3 numbers of any length but 0: where the rays lead, toward the scene, in the sensor's frame. Not NULL
// out_projection  receives it on SRF_OK only. Not NULL
// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
srf_status srf_projection_grid_parallel(const double *direction,
                                        srf_projection *out_projection);

// Says that an image has a point per pixel, seen from one place.
// origin          3 numbers: the place in the sensor's frame. Not NULL
// out_projection  receives it on SRF_OK only. Not NULL
// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
srf_status srf_projection_grid_from(const double *origin, srf_projection *out_projection);

// Makes a range image.
// rows, cols         size of the image
// projection         how pixels see. Not NULL
// samples            rows * cols elements, row after row: for a grid 3 SRF_TYPE_F32 or SRF_TYPE_F64 (kept in single precision), for the
//                    other kinds one SRF_TYPE_F64 or SRF_TYPE_F32. A number that is not finite makes its pixel invalid. Not NULL
// world_from_sensor  a rotation and a translation. NULL for the identity
// name               for messages and as what ties are broken by when merging, UTF-8. NULL for none
// out_image          receives a new handle on SRF_OK only. Not NULL
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_image_create(size_t rows,
                            size_t cols,
                            const srf_projection *projection,
                            const srf_array *samples,
                            const srf_pose *world_from_sensor,
                            const char *name,
                            srf_image **out_image);

// Releases an image. Views of it are gone.
// image      NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_image_free(srf_image *image);

// Size of an image.
// image      not NULL
// out_rows   NULL if not wanted
// out_cols   NULL if not wanted
// out_valid  receives the number of valid pixels. NULL if not wanted
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_size(const srf_image *image, size_t *out_rows, size_t *out_cols, size_t *out_valid);

// Name of an image.
// image      not NULL
// out_name   receives a text that stays until the image is freed or changed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_name(const srf_image *image, const char **out_name);

// Projection of an image's pixels, and the place of its sensor.
// image           not NULL
// out_projection  NULL if not wanted
// out_pose        receives world_from_sensor. NULL if not wanted
// returns         SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_camera(const srf_image *image, srf_projection *out_projection, srf_pose *out_pose);

// A view of the samples, row after row: 3 SRF_TYPE_F32 per pixel for a grid, else one SRF_TYPE_F64. NaN: an invalid pixel.
// image        not NULL
// out_samples  receives the view on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_samples(const srf_image *image,
                             srf_array *out_samples);

// Copies the measured points in the world, 3 doubles per pixel, row after row. NaN for an invalid pixel.
// image        not NULL
// out_points   room for 3 * rows * cols doubles. Not NULL
// capacity     that room, in doubles
// progress     NULL for none
// returns      SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_world_points(const srf_image *image,
                                  double *out_points,
                                  size_t capacity,
                                  const srf_progress *progress);

// The viewing ray of a pixel in the sensor's frame: a point on it and its unit direction toward the scene. NaN for an invalid pixel of a
// grid.
// image          not NULL
// row, col       a pixel of the image
// out_origin     room for 3 doubles. Not NULL
// out_direction  room for 3 doubles. Not NULL
// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_ray(const srf_image *image,
                         size_t row,
                         size_t col,
                         double *out_origin,
                         double *out_direction);

// Places the sensor in the world. Views of the image are gone.
// image              not NULL
// world_from_sensor  a rotation and a translation. NULL for the identity
// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_set_pose(srf_image *image, const srf_pose *world_from_sensor);

// Names an image: for messages, as what ties are broken by when merging, and for the files of srf_images_write_conf().
// Views of the image are gone.
// image      not NULL
// name       UTF-8. NULL for none
// returns    SRF_OK, SRF_ERR_INPUT for text that is not UTF-8, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_set_name(srf_image *image,
                              const char *name);

// Sets what pixels have besides their samples, in place of what was there. NULL removes it. Views of the image are gone.
// image        not NULL
// colours      4 SRF_TYPE_U8 per pixel, sRGB with straight alpha
// intensities  one SRF_TYPE_F32 or SRF_TYPE_F64 per pixel, in the sensor's own unit
// confidences  one SRF_TYPE_F32 or SRF_TYPE_F64 per pixel, >= 0. Without them they follow from the geometry
// returns      SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the pixel, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_image_set_attributes(srf_image *image,
                                    const srf_array *colours,
                                    const srf_array *intensities,
                                    const srf_array *confidences);

// Views of attributes of pixels besides their samples. Those that an image does not have are empty.
// image            not NULL
// out_colours      4 SRF_TYPE_U8 per pixel. NULL if not wanted
// out_intensities  one SRF_TYPE_F32 per pixel. NULL if not wanted
// out_confidences  one SRF_TYPE_F32 per pixel. NULL if not wanted
// returns          SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_attributes(const srf_image *image,
                                srf_array *out_colours,
                                srf_array *out_intensities,
                                srf_array *out_confidences);

// Triangulates the pixels of an image, leaving out jumps, in the sensor's frame. The mesh has the vertex attributes
// range_row, range_col, colour and intensity where the image has them, and confidence. SRF_ERR_INPUT where it would have no
// triangle. O(pixels).
// image      not NULL
// params     NULL for the defaults
// progress   NULL for none
// out_mesh   receives a new handle on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
//            Since 0.1.
srf_status srf_image_triangulate(const srf_image *image,
                                 const srf_triangulate_params *params,
                                 const srf_progress *progress,
                                 srf_mesh **out_mesh);

// The place in the world where the rays of an image start.
// image       not NULL
// out_sensor  room for 3 doubles: the place, or three NaN where rays are parallel. Not NULL
// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_image_sensor(const srf_image *image, double *out_sensor);

// The valid pixels of an image as points, with normals, the image's colours and place in the world, and where its rays start. O(pixels).
// image      not NULL
// progress   NULL for none
// out_cloud  receives a new handle on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_image_to_cloud(const srf_image *image,
                              const srf_progress *progress,
                              srf_cloud **out_cloud);

// Prepares a struct of figures. Call srf_left_out_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_left_out_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_left_out_report_init_sized(srf_left_out_report *report,
                                          size_t size);
#define srf_left_out_report_init(report) srf_left_out_report_init_sized((report), sizeof(srf_left_out_report))

// Prepares a struct for srf_image_from_frame(). Call srf_frame_init(frame), which adds the size that this header knows.
// frame    not NULL
// size     sizeof(srf_frame): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_frame_init_sized(srf_frame *frame,
                                size_t size);
#define srf_frame_init(frame) srf_frame_init_sized((frame), sizeof(srf_frame))

// Makes a range image of a frame, with what of it can be trusted. Depth is never resampled: each sample takes its colour through
// its point, with alpha 0 where the colour camera does not see it, since it lies outside of its image or behind a nearer sample.
// Nothing was measured where a depth is 0, negative or not finite, nor where one of SRF_TYPE_U16 is 65535. O(pixels).
// frame              how the images were taken, initialized by srf_frame_init(). Not NULL
// depths             one SRF_TYPE_U16, SRF_TYPE_F32 or SRF_TYPE_F64 a pixel of the depth image, row after row. Not NULL
// colours            3 or 4 SRF_TYPE_U8 a pixel of the colour image, sRGB, of 4 the last is passed over. NULL for none
// confidences        one SRF_TYPE_U8 a pixel of the confidence image, in the sensor's own levels. NULL for none
// world_from_sensor  places the depth camera, a rotation and a translation. NULL for the identity
// name               for messages and as what ties are broken by when merging, UTF-8. NULL for none
// progress           NULL for none
// out_image          receives a new handle on SRF_OK only. Not NULL
// out_left_out       initialized by srf_left_out_report_init(). NULL if not wanted
// returns            SRF_OK, SRF_ERR_PARAMETER naming the field, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
//                    SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
srf_status srf_image_from_frame(const srf_frame *frame,
                                const srf_array *depths,
                                const srf_array *colours,
                                const srf_array *confidences,
                                const srf_pose *world_from_sensor,
                                const char *name,
                                const srf_progress *progress,
                                srf_image **out_image,
                                srf_left_out_report *out_left_out);

// ==== 3. Point clouds and meshes ===========================================================================
// Both hand out views that copy nothing, and are made of arrays of any stride.
//
//     /* Prints the vertices of a mesh. */
//     static srf_status print_vertices(const srf_mesh *mesh)
//     {
//         srf_array view;
//         size_t i;
//         const srf_status status = srf_mesh_positions(mesh, &view);
//         if (status != SRF_OK) return status;
//         for (i = 0; i < view.count; ++i) {
//             const double *at = (const double *)view.data + 3 * i;
//             printf("%g %g %g\n", at[0], at[1], at[2]);
//         }
//         return SRF_OK;
//     }
//
//     /* Makes a mesh of arrays in single precision, with a colour a vertex. */
//     static srf_status from_arrays(const float *positions, const uint8_t *colours, size_t vertices,
//                                   const uint32_t *corners, size_t triangles, srf_mesh **out_mesh)
//     {
//         const srf_array of_positions = {positions, vertices, 0, SRF_TYPE_F32, 3};
//         const srf_array of_colours = {colours, vertices, 0, SRF_TYPE_U8, 4};
//         const srf_array of_corners = {corners, triangles, 0, SRF_TYPE_U32, 3};
//         srf_status status = srf_mesh_create(&of_positions, &of_corners, out_mesh);
//         if (status != SRF_OK) return status;
//         status = srf_mesh_set_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "colour", &of_colours);
//         if (status != SRF_OK) srf_mesh_free(*out_mesh);
//         return status;
//     }
//
//     /* Prints what the vertices of a mesh have, and whether it is closed. */
//     static srf_status print_mesh(const srf_mesh *mesh)
//     {
//         srf_check_report report;
//         size_t i, count = 0;
//         srf_status status = srf_mesh_attribute_count(mesh, SRF_DOMAIN_VERTICES, &count);
//         for (i = 0; status == SRF_OK && i < count; ++i) {
//             const char *name;
//             srf_array view;
//             status = srf_mesh_attribute_name(mesh, SRF_DOMAIN_VERTICES, i, &name);
//             if (status == SRF_OK) status = srf_mesh_attribute(mesh, SRF_DOMAIN_VERTICES, name, &view);
//             if (status == SRF_OK) printf("%s: %u numbers a vertex\n", name, view.components);
//         }
//         srf_check_report_init(&report);
//         if (status == SRF_OK) status = srf_mesh_check(mesh, 0, NULL, &report);
//         if (status == SRF_OK) puts(report.is_closed ? "closed" : "open");
//         return status;
//     }
//
//     /* Copies a mesh for a graphics card, about the middle of its box; free() releases the vertices. */
//     static srf_status for_graphics(const srf_mesh *mesh, float **out_vertices, srf_array *out_triangles)
//     {
//         double low[3], high[3], middle[3];
//         size_t axis, count = 0;
//         srf_status status = srf_mesh_size(mesh, &count, NULL);
//         if (status == SRF_OK) status = srf_mesh_bounds(mesh, NULL, low, high);
//         if (status != SRF_OK) return status;
//         for (axis = 0; axis < 3; ++axis) middle[axis] = (low[axis] + high[axis]) / 2;
//         *out_vertices = (float *)malloc(3 * count * sizeof(float));
//         if (*out_vertices == NULL) return SRF_ERR_OUT_OF_MEMORY;
//         status = srf_mesh_positions_f32(mesh, middle, *out_vertices, 3 * count, NULL);
//         if (status == SRF_OK) status = srf_mesh_triangles(mesh, out_triangles);
//         return status;
//     }
//
//     /* Copies the points of a cloud for a graphics card; prints whether it has normals, and its place and sensor. */
//     static srf_status cloud_for_graphics(const srf_cloud *cloud, float **out_points)
//     {
//         double sensor[3];
//         srf_array normals;
//         srf_pose place;
//         size_t count = 0;
//         srf_status status = srf_cloud_size(cloud, &count);
//         if (status == SRF_OK) status = srf_cloud_arrays(cloud, NULL, &normals, NULL, NULL);
//         if (status == SRF_OK) status = srf_cloud_pose(cloud, &place);
//         if (status == SRF_OK) status = srf_cloud_sensor(cloud, sensor);
//         if (status != SRF_OK) return status;
//         puts(normals.count > 0 ? "with normals" : "without normals");
//         printf("stands at %g %g %g\n", place.matrix[12], place.matrix[13], place.matrix[14]);
//         printf("was seen from %g %g %g in its frame\n", sensor[0], sensor[1], sensor[2]);
//         *out_points = (float *)malloc(3 * count * sizeof(float));
//         if (*out_points == NULL) return SRF_ERR_OUT_OF_MEMORY;
//         return srf_cloud_positions_f32(cloud, NULL, *out_points, 3 * count, NULL);
//     }
//
//     /* Whether points lie in the box around an image, in the world. */
//     static srf_status lie_in_box(const double *points, size_t count, const srf_image *image, int *out_lie_in)
//     {
//         const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
//         double low[2][3], high[2][3];
//         srf_cloud *cloud = NULL;
//         size_t axis;
//         srf_status status = srf_cloud_create(&positions, NULL, NULL, NULL, NULL, &cloud);
//         if (status == SRF_OK) status = srf_cloud_bounds(cloud, NULL, low[0], high[0]);
//         if (status == SRF_OK) status = srf_image_bounds(image, NULL, low[1], high[1]);
//         if (status == SRF_OK) {
//             *out_lie_in = 1;
//             for (axis = 0; axis < 3; ++axis)
//                 if (low[0][axis] < low[1][axis] || high[0][axis] > high[1][axis]) *out_lie_in = 0;
//         }
//         srf_cloud_free(cloud);
//         return status;
//     }
//
//     /* The data that a host keeps of a range image: vertices, which it takes times 1000, and the camera of them. */
//     static srf_status to_host(const srf_image *image, srf_mesh **out_mesh, srf_grid_camera *out_camera)
//     {
//         srf_status status;
//         srf_grid_camera_init(out_camera);
//         status = srf_image_grid_camera(image, NULL, out_camera);
//         if (status == SRF_OK) status = srf_grid_camera_scale(out_camera, 1000);
//         if (status == SRF_OK) status = srf_image_to_mesh(image, 1, NULL, out_mesh);
//         return status;
//     }
//
//     /* Makes the range image again of where the host's user has moved the vertices. */
//     static srf_status from_host(const srf_grid_camera *camera, const int32_t *rows, const int32_t *cols,
//                                 const float *positions, size_t count, srf_image **out_image)
//     {
//         const srf_array of_rows = {rows, count, 0, SRF_TYPE_I32, 1};
//         const srf_array of_cols = {cols, count, 0, SRF_TYPE_I32, 1};
//         const srf_array at = {positions, count, 0, SRF_TYPE_F32, 3};
//         return srf_image_from_vertices(camera, &of_rows, &of_cols, &at, NULL, NULL, NULL, NULL, NULL, NULL, out_image);
//     }

// Makes a cloud.
// positions         3 SRF_TYPE_F64 or SRF_TYPE_F32 per point. Those that are not finite are left out of surfaces and counted. Not NULL
// normals           3 SRF_TYPE_F32 or SRF_TYPE_F64 per point, of unit length. NULL for none
// colours           4 SRF_TYPE_U8 per point, sRGB with straight alpha. NULL for none
// intensities       one SRF_TYPE_F32 or SRF_TYPE_F64 per point, in the sensor's own unit. NULL for none
// world_from_cloud  NULL for the identity
// out_cloud         receives a new handle on SRF_OK only. Not NULL
// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the element, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_cloud_create(const srf_array *positions,
                            const srf_array *normals,
                            const srf_array *colours,
                            const srf_array *intensities,
                            const srf_pose *world_from_cloud,
                            srf_cloud **out_cloud);

// Releases a cloud. Views of it are gone.
// cloud      NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_cloud_free(srf_cloud *cloud);

// Views of a cloud's arrays. Those it does not have are empty.
// cloud            not NULL
// out_positions    3 SRF_TYPE_F64 per point. NULL if not wanted
// out_normals      3 SRF_TYPE_F32 per point. NULL if not wanted
// out_colours      4 SRF_TYPE_U8 per point. NULL if not wanted
// out_intensities  one SRF_TYPE_F32 per point. NULL if not wanted
// returns          SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_cloud_arrays(const srf_cloud *cloud,
                            srf_array *out_positions,
                            srf_array *out_normals,
                            srf_array *out_colours,
                            srf_array *out_intensities);

// The place that all points of a cloud were seen from, in its own frame. It is known of clouds of range images whose rays start at one
// place, and from files that say it. A VIEWPOINT of a PCD file at the origin says nothing, since it stands there if nobody set it.
// srf_reconstructor_create() heeds it.
// cloud       not NULL
// out_sensor  room for 3 doubles: the place, or three NaN where it is not known. Not NULL
// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_sensor(const srf_cloud *cloud,
                            double *out_sensor);

// The pose of a cloud in the world.
// cloud      not NULL
// out_pose   receives world_from_cloud on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_cloud_pose(const srf_cloud *cloud, srf_pose *out_pose);

// Prepares a struct of figures. Call srf_check_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_check_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_check_report_init_sized(srf_check_report *report,
                                       size_t size);
#define srf_check_report_init(report) srf_check_report_init_sized((report), sizeof(srf_check_report))

// Makes a mesh.
// positions  3 SRF_TYPE_F64 or SRF_TYPE_F32 per vertex, finite, in any unit. Not NULL
// triangles  3 SRF_TYPE_U32 or SRF_TYPE_I32 per triangle, each less than the number of vertices. NULL for a mesh of points alone
// out_mesh   receives a new handle on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the element, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_mesh_create(const srf_array *positions,
                           const srf_array *triangles,
                           srf_mesh **out_mesh);

// Releases a mesh. Views of it are gone. A call that works with it on another thread goes on.
// mesh       NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_mesh_free(srf_mesh *mesh);

// A view of the coordinates: 3 SRF_TYPE_F64 per vertex.
// mesh           not NULL
// out_positions  receives the view on SRF_OK only. Not NULL
// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_positions(const srf_mesh *mesh, srf_array *out_positions);

// A view of the triangles: 3 SRF_TYPE_U32 per triangle.
// mesh           not NULL
// out_triangles  receives the view on SRF_OK only. Not NULL
// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_triangles(const srf_mesh *mesh, srf_array *out_triangles);

// Number of attributes.
// mesh       not NULL
// domain     a value of srf_domain
// out_count  receives the number on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_attribute_count(const srf_mesh *mesh, uint32_t domain, size_t *out_count);

// Name of an attribute. Names in use: colour, confidence, intensity, error (in the mesh's unit), range_row, range_col,
// source_scan, interpolated (vertices that lie on no scan), hole_fill (triangles), s and t (texture coordinates, to the right and upwards).
// mesh       not NULL
// domain     a value of srf_domain
// index      less than srf_mesh_attribute_count()
// out_name   receives a text that stays until the mesh is freed or changed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_attribute_name(const srf_mesh *mesh,
                                   uint32_t domain,
                                   size_t index,
                                   const char **out_name);

// A view of an attribute: one SRF_TYPE_F32, SRF_TYPE_I32 or SRF_TYPE_U8 (a flag) or four SRF_TYPE_U8 (a colour, sRGB with straight alpha)
// an entry.
// mesh       not NULL
// domain     a value of srf_domain
// name       not NULL
// out_data   receives the view on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT if there is none of that name, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_attribute(const srf_mesh *mesh,
                              uint32_t domain,
                              const char *name,
                              srf_array *out_data);

// Sets an attribute, in place of one of the same name if there is one. Views of the mesh are gone.
// mesh       not NULL
// domain     a value of srf_domain
// name       not NULL, not empty
// data       one entry per vertex or triangle of one of the types of srf_mesh_attribute(), copied. NULL removes the attribute
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_mesh_set_attribute(srf_mesh *mesh,
                                  uint32_t domain,
                                  const char *name,
                                  const srf_array *data);

// Checks whether a mesh is what a surface must be, and finds its topology. Shares no code with what makes meshes.
// mesh        not NULL
// welded      0: vertices are the same if they have the same index. 1: also if they are at the same place in single precision
// progress    NULL for none
// out_report  initialized by srf_check_report_init(). Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
//             Since 0.1.
srf_status srf_mesh_check(const srf_mesh *mesh,
                          uint32_t welded,
                          const srf_progress *progress,
                          srf_check_report *out_report);

// Numbers of vertices and triangles of a mesh.
// mesh           not NULL
// out_vertices   NULL if not wanted
// out_triangles  NULL if not wanted
// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_size(const srf_mesh *mesh, size_t *out_vertices, size_t *out_triangles);

// Number of points of a cloud.
// cloud        not NULL
// out_points   receives the number on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_size(const srf_cloud *cloud, size_t *out_points);

// The box around the vertices of a mesh, whether a triangle uses them or not. O(vertices).
// mesh       not NULL
// progress   NULL for none
// out_min    room for 3 doubles, the smallest coordinates. Not NULL
// out_max    room for 3 doubles, the largest ones. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT if there is no vertex, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_bounds(const srf_mesh *mesh,
                           const srf_progress *progress,
                           double *out_min,
                           double *out_max);

// The box around the points of a cloud in the world. Those that are not finite are passed over. O(points).
// cloud      not NULL
// progress   NULL for none
// out_min    room for 3 doubles, the smallest coordinates. Not NULL
// out_max    room for 3 doubles, the largest ones. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT if there is no point, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_bounds(const srf_cloud *cloud,
                            const srf_progress *progress,
                            double *out_min,
                            double *out_max);

// The box around the samples of an image in the world. O(pixels).
// image      not NULL
// progress   NULL for none
// out_min    room for 3 doubles, the smallest coordinates. Not NULL
// out_max    room for 3 doubles, the largest ones. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT if no pixel is valid, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_image_bounds(const srf_image *image,
                            const srf_progress *progress,
                            double *out_min,
                            double *out_max);

// Copies the positions of a mesh in single precision, as vertices of graphics have them: 3 floats per vertex, relative to an origin. So
// coordinates far from 0 keep their digits.
// mesh           not NULL
// origin         3 doubles that are taken off before rounding, for example the middle of srf_mesh_bounds(). NULL for 0 0 0
// out_positions  room for 3 floats per vertex. Not NULL
// capacity       that room, in floats
// progress       NULL for none
// returns        SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_INPUT naming a vertex that lies too far off,
//                SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_positions_f32(const srf_mesh *mesh,
                                  const double *origin,
                                  float *out_positions,
                                  size_t capacity,
                                  const srf_progress *progress);

// srf_mesh_positions_f32() for the points of a cloud, in its own frame. Those that are not finite stay so.
// cloud          not NULL
// origin         3 doubles that are taken off before rounding. NULL for 0 0 0
// out_positions  room for 3 floats per point. Not NULL
// capacity       that room, in floats
// progress       NULL for none
// returns        SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_INPUT naming a point that lies too far off,
//                SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_positions_f32(const srf_cloud *cloud,
                                   const double *origin,
                                   float *out_positions,
                                   size_t capacity,
                                   const srf_progress *progress);

// Prepares a struct for srf_image_grid_camera(), or to be filled in. Call srf_grid_camera_init(camera), which adds the size that
// this header knows.
// camera   not NULL
// size     sizeof(srf_grid_camera): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_grid_camera_init_sized(srf_grid_camera *camera,
                                      size_t size);
#define srf_grid_camera_init(camera) srf_grid_camera_init_sized((camera), sizeof(srf_grid_camera))

// The camera that a host keeps beside the vertices of srf_image_to_mesh(). O(pixels).
// image       not NULL
// progress    NULL for none
// out_camera  initialized by srf_grid_camera_init(), filled on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_image_grid_camera(const srf_image *image,
                                 const srf_progress *progress,
                                 srf_grid_camera *out_camera);

// For vertices whose coordinates are multiplied, where the host's unit of length is another.
// camera   what is changed, on SRF_OK only. Not NULL
// scale    what coordinates are multiplied with, > 0
// returns  SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_grid_camera_scale(srf_grid_camera *camera, double scale);

// The valid pixels of an image as the vertices of a mesh, row after row, in the sensor's frame: how a host keeps a range image. With
// the vertex attributes range_row, range_col and, where the image has them, colour, intensity and confidence. O(pixels).
// image     not NULL
// faces     1: also the triangles that srf_image_triangulate() makes with its defaults, over the same vertices. 0: none
// progress  NULL for none
// out_mesh  receives a new handle on SRF_OK only. Not NULL
// returns   SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY.
//           Since 0.2.
srf_status srf_image_to_mesh(const srf_image *image,
                             uint32_t faces,
                             const srf_progress *progress,
                             srf_mesh **out_mesh);

// The range image that a host's vertices are, however its user moved them. Pixels without a vertex are invalid. If all were moved, turned,
// scaled and mirrored alike, within single precision, and each lies on its pixel's ray, the projection stays of its kind, with numbers
// scaled and mirrored. If they were stretched, or edited one by one, it becomes a grid of points, seen from where it was. Samples lie in
// the world where the vertices do. O(pixels).
// camera           what srf_image_grid_camera() filled. Not NULL
// row              one SRF_TYPE_I32 or SRF_TYPE_U32 per vertex, its pixel's row. Not NULL
// col              one SRF_TYPE_I32 or SRF_TYPE_U32 per vertex, its pixel's column. Not NULL
// positions        3 SRF_TYPE_F64 or SRF_TYPE_F32 per vertex, in the host's frame. Not NULL
// colours          4 SRF_TYPE_U8 per vertex, sRGB with straight alpha. NULL for none
// intensities      one SRF_TYPE_F32 or SRF_TYPE_F64 per vertex. NULL for none
// confidences      one SRF_TYPE_F32 or SRF_TYPE_F64 per vertex, >= 0. NULL for none
// world_from_host  any affine matrix that does not flatten. NULL for the identity
// name             as of srf_image_create(). NULL for none
// progress         NULL for none
// out_image        receives a new handle on SRF_OK only. Not NULL
// returns          SRF_OK, SRF_ERR_INPUT for a pixel outside of the grid or there twice, positions that are not finite, arrays of
//                  different lengths, vertices scaled by 0, or a grid far too large for its vertices. SRF_ERR_PARAMETER,
//                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
srf_status srf_image_from_vertices(const srf_grid_camera *camera,
                                   const srf_array *row,
                                   const srf_array *col,
                                   const srf_array *positions,
                                   const srf_array *colours,
                                   const srf_array *intensities,
                                   const srf_array *confidences,
                                   const srf_pose *world_from_host,
                                   const char *name,
                                   const srf_progress *progress,
                                   srf_image **out_image);

// ==== 4. Reading files =====================================================================================
// Files are opened as a set of scans. Their samples stay on the disk until a scan is read, merged or aligned.
//
//     /* Opens a list of scans, a recording's folder or a single scan, and prints what is in it. */
//     static srf_status list_scans(const char *path, srf_scans **out_scans)
//     {
//         size_t i, count = 0;
//         srf_status status = srf_scans_open(&path, 1, NULL, NULL, out_scans);
//         if (status == SRF_OK) status = srf_scans_count(*out_scans, &count, NULL);
//         for (i = 0; status == SRF_OK && i < count; ++i) {
//             const char *name;
//             status = srf_scans_describe(*out_scans, i, &name, NULL);
//             if (status == SRF_OK) puts(name);
//         }
//         return status;
//     }
//
//     /* Prints the endings of the names of files with scans. */
//     static srf_status list_endings(void)
//     {
//         size_t i, count = 0;
//         srf_status status = srf_format_count(&count);
//         for (i = 0; status == SRF_OK && i < count; ++i) {
//             const char *name, *endings;
//             uint32_t is_side_file;
//             status = srf_format(i, &name, &endings, &is_side_file);
//             if (status == SRF_OK && !is_side_file) printf("%s: %s\n", name, endings);
//         }
//         return status;
//     }
//
//     /* Opens depth images of a camera; prints how their files were understood. */
//     static srf_status open_depths(const char *const *paths, size_t count, srf_scans **out_scans)
//     {
//         srf_read_options options;
//         size_t i, notes = 0;
//         srf_status status;
//         srf_read_options_init(&options);
//         options.intrinsics[0] = options.intrinsics[1] = 525;
//         options.intrinsics[2] = 319.5;
//         options.intrinsics[3] = 239.5;
//         status = srf_scans_open(paths, count, &options, NULL, out_scans);
//         if (status != SRF_OK) return status;
//         status = srf_scans_count(*out_scans, NULL, &notes);
//         for (i = 0; status == SRF_OK && i < notes; ++i) {
//             const char *note;
//             status = srf_scans_note(*out_scans, i, &note);
//             if (status == SRF_OK) puts(note);
//         }
//         if (status != SRF_OK) srf_scans_free(*out_scans);
//         return status;
//     }
//
//     /* Counts the scans of a set that are frames of a recording, which nobody wants to see in a list. */
//     static srf_status count_frames(const srf_scans *scans, size_t *out_frames)
//     {
//         size_t i, count = 0;
//         srf_status status = srf_scans_count(scans, &count, NULL);
//         for (i = *out_frames = 0; status == SRF_OK && i < count; ++i) {
//             uint32_t is_frame = 0;
//             status = srf_scans_is_frame(scans, i, &is_frame);
//             *out_frames += is_frame;
//         }
//         return status;
//     }
//
//     /* Reads a range image, placed where it is said to be; *out_image is NULL for a scan that is a mesh or a cloud. */
//     static srf_status read_image(srf_scans *scans, size_t index, const srf_pose *world_from_sensor,
//                                  srf_image **out_image)
//     {
//         uint32_t content;
//         srf_mesh *mesh = NULL;
//         srf_cloud *cloud = NULL;
//         srf_status status = srf_scans_set_pose(scans, index, world_from_sensor);
//         if (status == SRF_OK) status = srf_scans_read(scans, index, NULL, &content, out_image, &mesh, &cloud);
//         srf_mesh_free(mesh);
//         srf_cloud_free(cloud);
//         return status;
//     }
//
//     /* Opens a scan that came as bytes, for example over a network. The set keeps what it needs of the folder. */
//     static srf_status open_bytes(const void *bytes, size_t count, srf_scans **out_scans)
//     {
//         const char *path;
//         srf_folder *folder;
//         srf_status status = srf_folder_create(NULL, &folder);
//         if (status != SRF_OK) return status;
//         status = srf_folder_put(folder, "scan.ply", bytes, count);
//         if (status == SRF_OK) status = srf_folder_path(folder, "scan.ply", &path);
//         if (status == SRF_OK) status = srf_scans_open(&path, 1, NULL, NULL, out_scans);
//         srf_folder_free(folder);
//         return status;
//     }
//
//     /* Sends what was written into a folder, file after file, and takes it out. */
//     static srf_status send_all(const srf_folder *folder,
//                                void (*send)(const char *name, const void *bytes, size_t count))
//     {
//         size_t files = 0;
//         srf_status status = srf_folder_count(folder, &files);
//         for (; status == SRF_OK && files > 0; --files) {
//             const char *name;
//             const void *bytes;
//             size_t count;
//             status = srf_folder_name(folder, 0, &name);
//             if (status == SRF_OK) status = srf_folder_bytes(folder, name, &bytes, &count);
//             if (status != SRF_OK) break;
//             send(name, bytes, count);
//             status = srf_folder_remove(folder, name, NULL);
//         }
//         return status;
//     }
//
//     /* Reads a part of an open file, for put_file(). */
//     static int32_t read_part(void *user, uint64_t at, void *buffer, size_t count, size_t *out_count)
//     {
//         FILE *file = (FILE *)user;
//         if (fseek(file, (long)at, SEEK_SET) != 0) return SRF_ERR_IO;
//         *out_count = fread(buffer, 1, count, file);
//         return *out_count > 0 ? SRF_OK : SRF_ERR_IO;
//     }
//
//     /* Puts a file into a folder whose bytes are read from where they are once they are asked for. */
//     static srf_status put_file(const srf_folder *folder, const char *name, FILE *file, uint64_t length)
//     {
//         srf_file_source source;
//         source.length = length;
//         source.read = read_part;
//         source.release = NULL;
//         source.user = file;
//         return srf_folder_put_source(folder, name, &source);
//     }

// Number of formats that srf_scans_open() knows.
// out_count  not NULL
// returns    SRF_OK, SRF_ERR_NULL. Since 0.1.
srf_status srf_format_count(size_t *out_count);

// A format that srf_scans_open() knows. Files are recognized by their content. Their endings serve the filters of file dialogues.
// index             less than the number of formats
// out_name          receives its name for people, static text. Not NULL
// out_endings       receives the usual endings of names, in lower case, without the dot, a blank between two, static text. NULL if not
//                   wanted
// out_is_side_file  receives 0 for files that hold scans. 1 for those that list, place or describe scans of other files. NULL if not
//                   wanted
// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.1.
srf_status srf_format(size_t index,
                      const char **out_name,
                      const char **out_endings,
                      uint32_t *out_is_side_file);

// Creates an empty folder.
// sink        where what is written into it goes. NULL: the folder keeps it. On SRF_OK only, its user is released once the folder is freed
//             and nothing is being written into it
// out_folder  receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_NULL also for a sink without write. Since 0.2.
srf_status srf_folder_create(const srf_file_sink *sink,
                             srf_folder **out_folder);

// Releases a folder, and its files once no scan needs them.
// folder     NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
srf_status srf_folder_free(srf_folder *folder);

// The path of a file in a folder, whether it is there or not, for every function that takes a path.
// folder     not NULL
// name       of the file, UTF-8, with / between folders: "scan.ply", "depth/00001.png". NULL for the folder itself
// out_path   receives a text that stays until the folder is freed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT for a name that is no file's within the folder, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_folder_path(const srf_folder *folder,
                           const char *name,
                           const char **out_path);

// Puts a file into a folder, in place of one of that name. The bytes are copied.
// folder     not NULL
// name       of the file, as in srf_folder_path(). Not NULL
// bytes      not NULL unless count is 0
// count      number of bytes
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
srf_status srf_folder_put(const srf_folder *folder, const char *name, const void *bytes, size_t count);

// Puts a file into a folder whose bytes are asked for when they are read, in place of one of that name.
// folder     not NULL
// name       of the file, as in srf_folder_path(). Not NULL
// source     where its bytes come from. Its user is released once the file is replaced or removed or the folder has gone, and nobody reads
//            it. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL also for a source without read. On errors nothing is released. Since 0.2.
srf_status srf_folder_put_source(const srf_folder *folder,
                                 const char *name,
                                 const srf_file_source *source);

// Takes a file out of a folder. Who reads it just then reads on.
// folder       not NULL
// name         of the file. Not NULL
// out_removed  receives 1 if it was there, else 0. NULL if not wanted
// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_INPUT. Since 0.2.
srf_status srf_folder_remove(const srf_folder *folder, const char *name, uint32_t *out_removed);

// Number of files in a folder, those in folders within it too.
// folder     not NULL
// out_count  not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_folder_count(const srf_folder *folder, size_t *out_count);

// Name of a file in a folder, in the order of names.
// folder     not NULL
// index      less than the number of files
// out_name   receives a text that stays until the folder is freed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_folder_name(const srf_folder *folder, size_t index, const char **out_name);

// The bytes that were written or put into a file.
// folder     not NULL
// name       of the file. Not NULL
// out_bytes  receives where they are, until this function or srf_folder_remove() is called for the file again or the folder is freed,
//            whatever is written meanwhile. On SRF_OK only. Not NULL
// out_count  receives how many. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT if there is no such file or its bytes lie behind a function, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_folder_bytes(const srf_folder *folder,
                            const char *name,
                            const void **out_bytes,
                            size_t *out_count);

// Sets the defaults. Call srf_read_options_init(options), which adds the size that this header knows.
// options  not NULL
// size     sizeof(srf_read_options): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_read_options_init_sized(srf_read_options *options, size_t size);
#define srf_read_options_init(options) srf_read_options_init_sized((options), sizeof(srf_read_options))

// Opens files of scans: single scans, lists that place several, or folders. Formats are recognized by content. Scans are read as PLY
// (range grids, meshes and points), PTX, E57, PCD, LAS and LAZ, points in text, OBJ, STL, 3MF and glTF. Height maps and depth images are read
// as PNG, PGM, PFM, OpenEXR, TIFF, NumPy arrays, SRTM tiles and ESRI grids. Lists are read as .conf, .mlp and .aln. Folders, zip archives,
// .r3d and .sens of recordings of depth cameras and phones give their frames as images with colours. Of the files, a camera makes the
// images depth images, a trajectory places them. How the files were understood goes to the log too. It reads headers. Of a .conf whose
// quaternions could mean two things it also reads a few thousand points per scan, to find out which. Damage further on in a file is told
// when its scan is read.
// paths       UTF-8. Not NULL, nor is any of them
// count       number of paths, at least 1
// options     what the files do not say themselves. NULL for the defaults
// progress    NULL for none
// out_scans   receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_FORMAT naming the place, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//             SRF_ERR_STRUCT_SIZE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_open(const char *const *paths,
                          size_t count,
                          const srf_read_options *options,
                          const srf_progress *progress,
                          srf_scans **out_scans);

// Releases a set of scans.
// scans      NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_scans_free(srf_scans *scans);

// Number of scans, and of notes on how the files were understood.
// scans      not NULL
// out_scans  NULL if not wanted
// out_notes  NULL if not wanted
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_count(const srf_scans *scans, size_t *out_scans, size_t *out_notes);

// A note on how the files were understood.
// scans      not NULL
// index      less than the number of notes
// out_note   receives a text that stays until the set is freed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_note(const srf_scans *scans, size_t index, const char **out_note);

// Name and place of a scan.
// scans      not NULL
// index      less than the number of scans
// out_name   receives a text that stays until the set is freed. NULL if not wanted
// out_pose   receives world_from_sensor. NULL if not wanted
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_describe(const srf_scans *scans,
                              size_t index,
                              const char **out_name,
                              srf_pose *out_pose);

// Places a scan of a set, whatever its file says: where an alignment found it, for example. The file is neither read nor changed. A scan
// that was added to a merge or an alignment before stays there as it was.
// scans              not NULL
// index              less than the number of scans
// world_from_sensor  a rotation and a translation. NULL for the identity
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_scans_set_pose(srf_scans *scans,
                              size_t index,
                              const srf_pose *world_from_sensor);

// Whether a scan is a frame of a recording, of which there may be thousands.
// scans         not NULL
// index         less than the number of scans
// out_is_frame  receives 1 if it is, else 0. Not NULL
// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_scans_is_frame(const srf_scans *scans, size_t index, uint32_t *out_is_frame);

// Reads a scan. A range image comes placed in the world. A mesh and a cloud come in their own frame, which srf_scans_describe() places.
// scans        not NULL
// index        less than the number of scans
// progress     counts the bytes of the file. NULL for none
// out_content  receives a value of srf_content: which of the three handles was made. Not NULL
// out_image    receives a new handle or NULL. Not NULL
// out_mesh     receives a new handle or NULL. Not NULL
// out_cloud    receives a new handle or NULL. Not NULL
// returns      SRF_OK, SRF_ERR_IO, SRF_ERR_FORMAT naming the place, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//              SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_scans_read(const srf_scans *scans,
                          size_t index,
                          const srf_progress *progress,
                          uint32_t *out_content,
                          srf_image **out_image,
                          srf_mesh **out_mesh,
                          srf_cloud **out_cloud);

// ==== 5. Writing files =====================================================================================
// Take srf_mesh_write() for a mesh: the ending of the name chooses the format. srf_mesh_write_from() does the
// same, and the file says where it is from. srf_mesh_write_ply() and those for GLB, OBJ and STL write one
// format whatever the name is. srf_merger_write() merges into a file what memory does not hold.
//
//     /* Writes a mesh of millimetres whose z points up, for viewers of glTF. */
//     static srf_status write_for_viewers(const srf_mesh *mesh, const char *path)
//     {
//         srf_write_options options;
//         srf_write_options_init(&options);
//         options.metres_per_unit = 0.001;
//         options.up = SRF_UP_Z;
//         return srf_mesh_write(mesh, path, &options, NULL);
//     }
//
//     /* Merges into a file that says where it is from, unless its name is none that can be written. */
//     static srf_status merge_into(const srf_merger *merger, const char *path)
//     {
//         srf_mesh *mesh = NULL;
//         srf_status status = srf_check_mesh_file(path, NULL);
//         if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, &mesh, NULL);
//         if (status == SRF_OK) status = srf_mesh_write_from(mesh, path, NULL, "{\"found in\": \"trench 4\"}", NULL);
//         srf_mesh_free(mesh);
//         return status;
//     }
//
//     /* The provenance in a file. free() releases the text. */
//     static srf_status provenance_of(const char *path, char **out_text)
//     {
//         size_t length = 0;
//         srf_status status = srf_file_provenance(path, NULL, 0, &length);
//         if (status != SRF_OK) return status;
//         *out_text = (char *)malloc(length + 1);
//         if (*out_text == NULL) return SRF_ERR_OUT_OF_MEMORY;
//         return srf_file_provenance(path, *out_text, length + 1, &length);
//     }
//
//     /* Writes a mesh of millimetres in each format, and a cloud. */
//     static srf_status write_each(const srf_mesh *mesh, const srf_cloud *cloud)
//     {
//         srf_status status = srf_mesh_write_ply(mesh, "mesh.ply", SRF_ENCODING_BINARY, NULL);
//         if (status == SRF_OK) status = srf_mesh_write_glb(mesh, "mesh.glb", "part 7", 0.001, 1, NULL);
//         if (status == SRF_OK) status = srf_mesh_write_obj(mesh, "mesh.obj", NULL);
//         if (status == SRF_OK) status = srf_mesh_write_stl(mesh, "mesh.stl", NULL);
//         if (status == SRF_OK) status = srf_cloud_write_ply(cloud, "cloud.ply", SRF_ENCODING_BINARY, NULL);
//         return status;
//     }
//
//     /* Writes a mesh with a coarser one, which viewers show from afar. */
//     static srf_status write_levels(const srf_mesh *fine, const srf_mesh *coarse, const char *path)
//     {
//         const srf_mesh *levels[2];
//         levels[0] = fine;
//         levels[1] = coarse;
//         return srf_meshes_write_glb_levels(levels, 2, path, NULL, 0.001, 1, NULL);
//     }
//
//     /* Writes images with their poses: as files that open as one set, and as those of surveyors. */
//     static srf_status write_images(const srf_image *const *images, size_t count)
//     {
//         srf_status status = srf_images_write_conf(images, count, "scans.conf", SRF_ENCODING_BINARY, NULL);
//         if (status == SRF_OK) status = srf_images_write_ptx(images, count, "scans.ptx", NULL);
//         if (status == SRF_OK) status = srf_images_write_e57(images, count, "scans.e57", NULL);
//         if (status == SRF_OK) status = srf_images_write_e57_from(images, count, "mill.e57", "{\"at\": \"mill\"}", NULL);
//         return status;
//     }
//
//     /* Says which coordinate reference system everything lies in. */
//     static srf_status set_systems(srf_scans *scans, srf_image *image, srf_cloud *cloud, srf_mesh *mesh,
//                                   const char *system)
//     {
//         srf_status status = srf_scans_set_crs(scans, SIZE_MAX, system);
//         if (status == SRF_OK) status = srf_image_set_crs(image, system);
//         if (status == SRF_OK) status = srf_cloud_set_crs(cloud, system);
//         if (status == SRF_OK) status = srf_mesh_set_crs(mesh, system);
//         return status;
//     }
//
//     /* Prints which one a mesh lies in, and how long the texts of the others are. */
//     static srf_status print_systems(const srf_scans *scans, const srf_image *image, const srf_cloud *cloud,
//                                     const srf_mesh *mesh)
//     {
//         char text[4096];
//         size_t of_scans = 0, of_image = 0, of_cloud = 0, length = 0;
//         srf_status status = srf_scans_crs(scans, SIZE_MAX, NULL, 0, &of_scans);
//         if (status == SRF_OK) status = srf_image_crs(image, NULL, 0, &of_image);
//         if (status == SRF_OK) status = srf_cloud_crs(cloud, NULL, 0, &of_cloud);
//         if (status == SRF_OK) status = srf_mesh_crs(mesh, text, sizeof(text), &length);
//         if (status != SRF_OK) return status;
//         printf("%s; %u, %u, %u\n", text, (unsigned)of_scans, (unsigned)of_image, (unsigned)of_cloud);
//         return SRF_OK;
//     }

// Sets the defaults. Call srf_write_options_init(options), which adds the size that this header knows.
// options  not NULL
// size     sizeof(srf_write_options): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_write_options_init_sized(srf_write_options *options, size_t size);
#define srf_write_options_init(options) srf_write_options_init_sized((options), sizeof(srf_write_options))

// Writes a mesh by the ending of the file's name, the writer to take unless another is needed. .ply has all attributes. .glb (binary glTF)
// has those of vertices, and its node is named as the file without the ending. .obj has colours. .stl has none. .3mf has the unit
// and colours, for slicers. A file of that name is replaced once all is written, or stays as it is.
// mesh       not NULL
// path       UTF-8. Not NULL
// options    NULL for the defaults
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for another ending, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//            SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_mesh_write(const srf_mesh *mesh,
                          const char *path,
                          const srf_write_options *options,
                          const srf_progress *progress);

// Checks, before the work that a mesh takes, that srf_mesh_write() knows the ending of a file's name and has what options ask for. No
// file is looked at.
// file       its name, UTF-8. Not NULL
// options    NULL for the defaults
// returns    SRF_OK, SRF_ERR_INPUT for another ending, and for an encoding that its format does not have, SRF_ERR_PARAMETER,
//            SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_check_mesh_file(const char *file,
                               const srf_write_options *options);

// Writes a mesh with all its attributes as PLY, whatever the file's name ends with. A file of that name is replaced once all is written,
// or stays as it is.
// mesh       not NULL
// path       UTF-8. Not NULL
// encoding   a value of srf_encoding
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_write_ply(const srf_mesh *mesh,
                              const char *path,
                              uint32_t encoding,
                              const srf_progress *progress);

// Writes a mesh with its attributes of vertices as binary glTF, whatever the file's name ends with. A file of that name is replaced once
// all is written, or stays.
// mesh             not NULL
// path             UTF-8. Not NULL
// name             of the node, UTF-8. NULL for "mesh"
// metres_per_unit  of the mesh's coordinates, > 0: 0.001 for millimetres
// z_up             1 if z points up in the mesh's coordinates, 0 if y does, as glTF has it
// progress         NULL for none
// returns          SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_write_glb(const srf_mesh *mesh,
                              const char *path,
                              const char *name,
                              double metres_per_unit,
                              uint32_t z_up,
                              const srf_progress *progress);

// Writes a mesh and coarser ones of the same surface as binary glTF with levels of detail (MSFT_lod). Viewers that know the extension show
// the coarser ones when the object is small on the screen, others the finest. A file of that name is replaced once all is written, or
// stays.
// meshes           finest first, each with no more triangles than the one before, none of them NULL. Not NULL
// count            number of meshes, at least 1
// path             UTF-8. Not NULL
// name             of the node, UTF-8. NULL for "mesh"
// metres_per_unit  of the meshes' coordinates, > 0: 0.001 for millimetres
// z_up             1 if z points up in the meshes' coordinates, 0 if y does, as glTF has it
// progress         NULL for none
// returns          SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_meshes_write_glb_levels(const srf_mesh *const *meshes,
                                       size_t count,
                                       const char *path,
                                       const char *name,
                                       double metres_per_unit,
                                       uint32_t z_up,
                                       const srf_progress *progress);

// Writes a mesh as Wavefront OBJ, whatever the file's name ends with, with the colours of its vertices. Coordinates keep double precision.
// A file of that name is replaced once all is written, or stays.
// mesh       not NULL
// path       UTF-8. Not NULL
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_write_obj(const srf_mesh *mesh,
                              const char *path,
                              const srf_progress *progress);

// Writes a mesh as binary STL, whatever the file's name ends with, in single precision and without attributes. A file of that name is
// replaced once all is written, or stays.
// mesh       not NULL. SRF_ERR_INPUT if it lies so far from the origin that single precision would lose its detail
// path       UTF-8. Not NULL
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_write_stl(const srf_mesh *mesh,
                              const char *path,
                              const srf_progress *progress);

// Writes a cloud with its normals, colours and intensities as PLY, in its own frame: its pose is not written. A file of that
// name is replaced once all is written, or stays.
// cloud      not NULL
// path       UTF-8. Not NULL
// encoding   a value of srf_encoding
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_cloud_write_ply(const srf_cloud *cloud,
                               const char *path,
                               uint32_t encoding,
                               const srf_progress *progress);

// Writes images so that they open as one set. Each becomes a Stanford range grid (PLY) named like it, in the folder of path. The list
// (.conf) places them. Files of these names are replaced one by one, the list last.
// images     none of them NULL. Names must differ and be those of files. Rays within half a sphere. Not NULL
// count      number of images, at least 1
// path       of the list, UTF-8, ending in .conf. Not NULL
// encoding   of the grids, a value of srf_encoding. Coordinates are in single precision in any
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_images_write_conf(const srf_image *const *images,
                                 size_t count,
                                 const char *path,
                                 uint32_t encoding,
                                 const srf_progress *progress);

// Writes images with their poses as one PTX file, for images seen from a point. Points are in single precision. Confidences have no place
// in the format. A file of that name is replaced once all is written, or stays.
// images     none of them NULL. Not NULL
// count      number of images, at least 1
// path       UTF-8. Not NULL
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_images_write_ptx(const srf_image *const *images,
                                size_t count,
                                const char *path,
                                const srf_progress *progress);

// Writes images with their poses and names as structured scans of one E57 file, for images seen from a point. Points are in single
// precision. Confidences have no place in the format. A file of that name is replaced once all is written, or stays.
// images     none of them NULL. Not NULL
// count      number of images, at least 1
// path       UTF-8. Not NULL
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_images_write_e57(const srf_image *const *images,
                                size_t count,
                                const char *path,
                                const srf_progress *progress);

// The coordinate reference system that scans of files lie in, as their files name it: well-known text, or a code as EPSG:25832.
// Nothing is transformed: scans of different systems, or in degrees, are not merged or aligned, and results keep the text.
// scans       not NULL
// index       less than the number of scans. SIZE_MAX for what all that name one agree on
// out_text    receives the text with its zero byte, an empty one for none. NULL if not wanted
// capacity    room there, in bytes
// out_length  receives the length of the text without its zero byte. Not NULL
// returns     SRF_OK, SRF_ERR_INPUT where scans disagree or are in degrees, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_IO,
//             SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_scans_crs(const srf_scans *scans,
                         size_t index,
                         char *out_text,
                         size_t capacity,
                         size_t *out_length);

// Says which coordinate reference system scans lie in, whatever their files name.
// scans      not NULL
// index      less than the number of scans. SIZE_MAX for all of them
// text       UTF-8. NULL or empty for none
// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_scans_set_crs(srf_scans *scans,
                             size_t index,
                             const char *text);

// The coordinate reference system of the world that an image lies in, which its pose places it in.
// image       not NULL
// out_text    as for srf_scans_crs()
// capacity    room there, in bytes
// out_length  receives the length of the text without its zero byte. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_image_crs(const srf_image *image, char *out_text, size_t capacity, size_t *out_length);

// Says which coordinate reference system the world of an image is in. Views of the image are gone.
// image      not NULL
// text       UTF-8. NULL or empty for none
// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_image_set_crs(srf_image *image, const char *text);

// The coordinate reference system of the world that a cloud lies in, which its pose places it in.
// cloud       not NULL
// out_text    as for srf_scans_crs()
// capacity    room there, in bytes
// out_length  receives the length of the text without its zero byte. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_crs(const srf_cloud *cloud, char *out_text, size_t capacity, size_t *out_length);

// Says which coordinate reference system the world of a cloud is in. Views of the cloud are gone.
// cloud      not NULL
// text       UTF-8. NULL or empty for none
// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_cloud_set_crs(srf_cloud *cloud, const char *text);

// The coordinate reference system that the coordinates of a mesh are in. Results have that of the scans they were made of, unless they are
// in the frame of one whose pose moves it. Meshes that are transformed have none any more. srf_mesh_write() puts it into .ply, .glb and
// .obj. A system that can't be said goes to the log.
// mesh        not NULL
// out_text    as for srf_scans_crs()
// capacity    room there, in bytes
// out_length  receives the length of the text without its zero byte. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_crs(const srf_mesh *mesh,
                        char *out_text,
                        size_t capacity,
                        size_t *out_length);

// Says which coordinate reference system the coordinates of a mesh are in. Views of the mesh are gone.
// mesh       not NULL
// text       UTF-8. NULL or empty for none
// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_set_crs(srf_mesh *mesh, const char *text);

// Writes a mesh as srf_mesh_write() does, and says in the file where it is from.
// mesh        not NULL
// path        UTF-8. Not NULL
// options     NULL for the defaults
// provenance  an object in JSON, as program, parameters and hashes of what was read: .ply and .obj have it as comments, .glb in
//             asset.extras.surfrecon, .stl and .3mf have no place for it. NULL for none
// progress    NULL for none
// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for another ending and for what is no such object, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED,
//             SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_write_from(const srf_mesh *mesh,
                               const char *path,
                               const srf_write_options *options,
                               const char *provenance,
                               const srf_progress *progress);

// Writes images as srf_images_write_e57() does, and says in the file where it is from. That is the text provenance of its root, in a
// namespace of its own, which readers that do not know it pass over.
// images      none of them NULL. Not NULL
// count       number of images, at least 1
// path        UTF-8. Not NULL
// provenance  an object in JSON. NULL for none
// progress    NULL for none
// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for what is no such object and for images of different systems, SRF_ERR_PARAMETER,
//             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_images_write_e57_from(const srf_image *const *images,
                                     size_t count,
                                     const char *path,
                                     const char *provenance,
                                     const srf_progress *progress);

// The provenance that a file of this library says: .ply, .obj, .glb, .e57.
// path        UTF-8. Not NULL
// out_text    receives an object in JSON with its zero byte, an empty text where the file says nothing. NULL if not wanted
// capacity    room there, in bytes
// out_length  receives the length of the text without its zero byte. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_NULL. Since 0.2.
srf_status srf_file_provenance(const char *path,
                               char *out_text,
                               size_t capacity,
                               size_t *out_length);

// ==== 6. Aligning ==========================================================================================
// Scans without poses come into one frame. srf_scans_set_pose() places the scans of a set by it, which then
// merge from the disk.
//
//     /* Aligns the scans of a set and adds those that found a place to a merge, without keeping one of them in memory. */
//     static srf_status align_and_add(srf_scans *scans, size_t count, srf_merger *merger)
//     {
//         srf_aligner *aligner = NULL;
//         srf_alignment *alignment = NULL;
//         size_t i;
//         srf_status status = srf_aligner_create(&aligner);
//         if (status == SRF_OK) status = srf_aligner_add_scans(aligner, scans);
//         if (status == SRF_OK) status = srf_aligner_run(aligner, NULL, NULL, &alignment);
//         for (i = 0; status == SRF_OK && i < count; ++i) {
//             srf_aligned_scan found;
//             srf_aligned_scan_init(&found);
//             status = srf_alignment_scan(alignment, i, &found);
//             if (found.state != SRF_SCAN_STATE_PLACED && found.state != SRF_SCAN_STATE_KEPT) continue;
//             if (status == SRF_OK) status = srf_scans_set_pose(scans, i, &found.world_from_scan);
//             if (status == SRF_OK) status = srf_merger_add_scan(merger, scans, i);
//         }
//         srf_alignment_free(alignment);
//         srf_aligner_free(aligner);
//         return status;
//     }
//
//     /* Aligns an image and points, which lie at most 20 off, to a mesh that stays. */
//     static srf_status align_to_mesh(const srf_mesh *mesh, const srf_image *image, const srf_cloud *cloud,
//                                     srf_alignment **out_alignment)
//     {
//         srf_align_params params;
//         srf_aligner *aligner;
//         srf_status status = srf_aligner_create(&aligner);
//         if (status != SRF_OK) return status;
//         srf_align_params_init(&params);
//         params.start = SRF_START_ROUGH;
//         params.reach = 20;
//         status = srf_aligner_add_mesh(aligner, mesh, NULL, "model");
//         if (status == SRF_OK) status = srf_aligner_add_image(aligner, image);
//         if (status == SRF_OK) status = srf_aligner_add_cloud(aligner, cloud, "points");
//         if (status == SRF_OK) status = srf_aligner_fix(aligner, 0);
//         if (status == SRF_OK) status = srf_aligner_run(aligner, &params, NULL, out_alignment);
//         srf_aligner_free(aligner);
//         return status;
//     }
//
//     /* Says what a person sees: a point that scans 0 and 1 show, that 1 and 2 touch, and that 0 and 2 do not. */
//     static srf_status say_what_is_known(srf_aligner *aligner, const double in_first[3], const double in_second[3])
//     {
//         srf_pick pick;
//         size_t axis;
//         srf_status status;
//         srf_pick_init(&pick);
//         pick.scans[0] = 0;
//         pick.scans[1] = 1;
//         for (axis = 0; axis < 3; ++axis) {
//             pick.points[0][axis] = in_first[axis];
//             pick.points[1][axis] = in_second[axis];
//         }
//         status = srf_aligner_pick(aligner, &pick);
//         if (status == SRF_OK) status = srf_aligner_trust(aligner, 1, 2);
//         if (status == SRF_OK) status = srf_aligner_reject(aligner, 0, 2);
//         return status;
//     }
//
//     /* Aligns scans of an object that stood on a turntable; prints by how much it was turned at each. */
//     static srf_status align_turned(srf_aligner *aligner, srf_alignment **out_alignment)
//     {
//         uint32_t found = 0;
//         srf_array angles;
//         size_t i, count = 0;
//         srf_status status = srf_aligner_turn(aligner, NULL, NULL, NULL, 0);
//         if (status == SRF_OK) status = srf_aligner_count(aligner, &count);
//         if (status == SRF_OK) status = srf_aligner_run(aligner, NULL, NULL, out_alignment);
//         if (status != SRF_OK) return status;
//         status = srf_alignment_turntable(*out_alignment, &found, NULL, NULL, &angles);
//         for (i = 0; status == SRF_OK && found && i < count; ++i) printf("%g\n", ((const double *)angles.data)[i]);
//         return status;
//     }
//
//     /* Prints what was found, line after line. */
//     static srf_status print_alignment(const srf_alignment *alignment)
//     {
//         srf_align_report report;
//         uint64_t i;
//         srf_status status;
//         srf_align_report_init(&report);
//         status = srf_alignment_report(alignment, &report);
//         for (i = 0; status == SRF_OK && i < 1 + report.scans_count + report.messages_count; ++i) {
//             const char *line;
//             status = srf_alignment_line(alignment, i, &line);
//             if (status == SRF_OK) puts(line);
//         }
//         return status;
//     }
//
//     /* Prints what is not well: messages, why scans have no place, and pairs that do not fit. */
//     static srf_status print_problems(const srf_alignment *alignment)
//     {
//         const char *text;
//         srf_align_report report;
//         uint64_t i;
//         srf_status status;
//         srf_align_report_init(&report);
//         status = srf_alignment_report(alignment, &report);
//         for (i = 0; status == SRF_OK && i < report.messages_count; ++i) {
//             status = srf_alignment_message(alignment, i, &text);
//             if (status == SRF_OK) puts(text);
//         }
//         for (i = 0; status == SRF_OK && i < report.scans_count; ++i) {
//             status = srf_alignment_reason(alignment, i, &text);
//             if (status == SRF_OK && *text != 0) printf("scan %u: %s\n", (unsigned)i, text);
//         }
//         for (i = 0; status == SRF_OK && i < report.pairs_count; ++i) {
//             srf_aligned_pair pair;
//             srf_aligned_pair_init(&pair);
//             status = srf_alignment_pair(alignment, i, &pair);
//             if (status != SRF_OK || pair.state != SRF_PAIR_STATE_MISFIT) continue;
//             printf("scans %u and %u lie %g apart\n", (unsigned)pair.scans[0], (unsigned)pair.scans[1], pair.residual);
//         }
//         return status;
//     }
//
//     /* Draws a scan that was dragged to the others; takes its pose only if it fits there. */
//     static srf_status drop_scan(const srf_aligner *aligner, size_t scan, srf_pose *poses, size_t count)
//     {
//         srf_snap_report snap;
//         srf_status status;
//         srf_snap_report_init(&snap);
//         status = srf_aligner_snap(aligner, scan, poses, count, NULL, NULL, &snap, NULL);
//         if (status == SRF_OK && snap.state == SRF_PAIR_STATE_FITS) poses[scan] = snap.world_from_scan;
//         return status;
//     }
//
//     /* How far points of a scan lie outside of the others: warp, or what has moved. */
//     static srf_status show_warp(const srf_aligner *aligner, size_t scan, const float *points, size_t count,
//                                 double *out_distances)
//     {
//         const srf_array of_scan = {points, count, 0, SRF_TYPE_F32, 3};
//         return srf_aligner_misfit(aligner, scan, NULL, 0, &of_scan, NULL, out_distances);
//     }
//
//     /* Makes the image of a scan whenever it is needed, of 480 x 640 depths in millimetres in a file. */
//     static int32_t load_depths(void *path, srf_image **out_image)
//     {
//         const size_t pixels = 480 * 640;
//         uint16_t *depths = (uint16_t *)malloc(pixels * sizeof(uint16_t));
//         FILE *file = fopen((const char *)path, "rb");
//         srf_status status = SRF_ERR_IO;
//         if (depths != NULL && file != NULL && fread(depths, sizeof(uint16_t), pixels, file) == pixels) {
//             const srf_array samples = {depths, pixels, 0, SRF_TYPE_U16, 1};
//             srf_frame frame;
//             srf_frame_init(&frame);
//             frame.rows = 480;
//             frame.cols = 640;
//             frame.intrinsics[0] = frame.intrinsics[1] = 525;
//             frame.intrinsics[2] = 319.5;
//             frame.intrinsics[3] = 239.5;
//             frame.scale = 0.001;
//             status = srf_image_from_frame(&frame, &samples, NULL, NULL, NULL, NULL, NULL, out_image, NULL);
//         }
//         if (file != NULL) fclose(file);
//         free(depths);
//         return status;
//     }
//
//     /* Adds such a scan, whose samples never all stay in memory. */
//     static srf_status add_depths(srf_aligner *aligner, char *path)
//     {
//         srf_image_source source;
//         source.make = load_depths;
//         source.user = path;
//         return srf_aligner_add_source(aligner, &source, NULL, path);
//     }

// Sets the defaults. Call srf_align_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_align_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_align_params_init_sized(srf_align_params *params, size_t size);
#define srf_align_params_init(params) srf_align_params_init_sized((params), sizeof(srf_align_params))

// Prepares a struct for srf_aligner_pick(): without normals, of weight 1. Call srf_pick_init(pick), which adds the size that this
// header knows.
// pick     not NULL
// size     sizeof(srf_pick): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_pick_init_sized(srf_pick *pick,
                               size_t size);
#define srf_pick_init(pick) srf_pick_init_sized((pick), sizeof(srf_pick))

// Begins an alignment without scans.
// out_aligner  receives a new handle on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_create(srf_aligner **out_aligner);

// Releases an alignment being put together. All that was added to it and that it found stays.
// aligner    NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_aligner_free(srf_aligner *aligner);

// Adds a range image as it is now. It may be freed or changed afterwards. Its own frame is its sensor's.
// aligner    not NULL
// image      not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_add_image(srf_aligner *aligner, const srf_image *image);

// Adds an oriented mesh as it is now.
// aligner          not NULL
// mesh             not NULL
// world_from_mesh  places it, rigid. NULL for the identity
// name             what texts call it and ties are broken by, UTF-8. Not NULL
// returns          SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_add_mesh(srf_aligner *aligner,
                                const srf_mesh *mesh,
                                const srf_pose *world_from_mesh,
                                const char *name);

// Adds points as they are now, by their normals. Their place is the cloud's.
// aligner    not NULL
// cloud      with normals, without which a run is refused. Not NULL
// name       what texts call it and ties are broken by, UTF-8. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_add_cloud(srf_aligner *aligner, const srf_cloud *cloud, const char *name);

// Adds all scans of a set. They are read once, when they are first needed, one per thread at a time, and their samples are not kept. What
// becomes of the files afterwards is not noticed until scans are added.
// aligner    not NULL
// scans      not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_add_scans(srf_aligner *aligner,
                                 const srf_scans *scans);

// Adds a scan whose range image a function makes: it is made when it is first needed, one per thread at a time, and its samples are not
// kept.
// aligner            not NULL
// source             makes it. The struct is copied. Not NULL
// world_from_sensor  places it, whatever pose its image has, a rotation and a translation. NULL for the identity
// name               what texts call it and ties are broken by, UTF-8. Not NULL
// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_aligner_add_source(srf_aligner *aligner,
                                  const srf_image_source *source,
                                  const srf_pose *world_from_sensor,
                                  const char *name);

// Number of scans that were added.
// aligner    not NULL
// out_scans  not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_count(const srf_aligner *aligner, size_t *out_scans);

// Says that a scan stays where it is. Where none is fixed the largest one stays.
// aligner    not NULL
// scan       number of a scan that was added
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_fix(srf_aligner *aligner, size_t scan);

// Says that two scans show the same point.
// aligner    not NULL
// pick       initialized by srf_pick_init(). Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_aligner_pick(srf_aligner *aligner, const srf_pick *pick);

// Says that two scans touch: what fits them best is used, even if it is not sure.
// aligner    not NULL
// a, b       numbers of two scans that were added
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_trust(srf_aligner *aligner, size_t a, size_t b);

// Says that two scans must not be compared.
// aligner    not NULL
// a, b       numbers of two scans that were added
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_reject(srf_aligner *aligner, size_t a, size_t b);

// Says how a table turned the object before a sensor that stood still: then only turns about its axis are looked for, whatever the
// parameter turntable says. Replaces what was said of it before.
// aligner    not NULL
// point      3 doubles: a point of the axis, in the frame that all scans were taken in. NULL where the axis is to be found
// direction  3 doubles: its direction, of any length but 0. NULL if point is
// angles     by how much it was turned when each scan was taken, in the order of adding, counter-clockwise where the axis points to the
//            viewer, either way round without an axis. NULL where that is not known
// count      scans that were added, 0 if angles is NULL
// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_turn(srf_aligner *aligner,
                            const double *point,
                            const double *direction,
                            const double *angles,
                            size_t count);

// Brings what was added to one frame: that of the fixed scans, or of the largest one. A scan is placed only where overlap, how it is held
// and uniqueness are sure. The others are told with the reason. Poses the scans have are used where they are fixed and where start says
// that they are rough. The same to the bit for any number of threads and any order of adding. Blocks.
// aligner        not NULL
// params         NULL for the defaults
// progress       NULL for none
// out_alignment  receives a new handle on SRF_OK only. Not NULL
// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, a pose that is not rigid, a pair that is both
//                trusted and rejected or angles for another number of scans, SRF_ERR_FORMAT, SRF_ERR_IO,
//                SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_aligner_run(const srf_aligner *aligner,
                           const srf_align_params *params,
                           const srf_progress *progress,
                           srf_alignment **out_alignment);

// Prepares a struct of figures. Call srf_aligned_scan_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_aligned_scan): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_aligned_scan_init_sized(srf_aligned_scan *report,
                                       size_t size);
#define srf_aligned_scan_init(report) srf_aligned_scan_init_sized((report), sizeof(srf_aligned_scan))

// Prepares a struct of figures. Call srf_aligned_pair_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_aligned_pair): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_aligned_pair_init_sized(srf_aligned_pair *report,
                                       size_t size);
#define srf_aligned_pair_init(report) srf_aligned_pair_init_sized((report), sizeof(srf_aligned_pair))

// Prepares a struct of figures. Call srf_align_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_align_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_align_report_init_sized(srf_align_report *report,
                                       size_t size);
#define srf_align_report_init(report) srf_align_report_init_sized((report), sizeof(srf_align_report))

// Releases what an alignment found, with its texts.
// alignment  NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_alignment_free(srf_alignment *alignment);

// The figures of an alignment. srf_alignment_line() gives as many lines as there are scans and messages, and one more.
// alignment   not NULL
// out_report  initialized by srf_align_report_init(). Not NULL
// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_alignment_report(const srf_alignment *alignment,
                                srf_align_report *out_report);

// The figures of a scan that was aligned.
// alignment  not NULL
// index      number of the scan, in the order of adding
// out_scan   initialized by srf_aligned_scan_init(). Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_alignment_scan(const srf_alignment *alignment, size_t index, srf_aligned_scan *out_scan);

// The figures of a pair of scans. Pairs that are not listed have nothing in common.
// alignment  not NULL
// index      less than pairs_count of the report. Pairs are listed by their scans' numbers
// out_pair   initialized by srf_aligned_pair_init(). Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_alignment_pair(const srf_alignment *alignment, size_t index, srf_aligned_pair *out_pair);

// The turntable that the object stood on.
// alignment      not NULL
// out_found      receives 1, or 0 where there was none or its axis was not found: then nothing else is written. Not NULL
// out_point      room for 3 doubles: a point of its axis, in the frame that the scans were taken in. NULL if not wanted
// out_direction  room for 3 doubles: the unit direction of its axis. NULL if not wanted
// out_angles     receives a view that stays until the alignment is freed, an SRF_TYPE_F64 a scan: by how much it was turned then, from 0 to
//                2 pi, counter-clockwise where the axis points to the viewer. 0 at the first scan that is placed, NaN at those that
//                are not. NULL if not wanted
// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_alignment_turntable(const srf_alignment *alignment,
                                   uint32_t *out_found,
                                   double *out_point,
                                   double *out_direction,
                                   srf_array *out_angles);

// Why a scan is not placed, and what to do.
// alignment   not NULL
// index       number of the scan, in the order of adding
// out_reason  receives a text that stays until the alignment is freed, empty for a scan that is placed. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_alignment_reason(const srf_alignment *alignment,
                                size_t index,
                                const char **out_reason);

// A sentence on the whole that a person should know.
// alignment    not NULL
// index        less than messages_count of the report
// out_message  receives a text that stays until the alignment is freed, on SRF_OK only. Not NULL
// returns      SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_alignment_message(const srf_alignment *alignment, size_t index, const char **out_message);

// A line for logs: first the whole, then the messages, then each scan.
// alignment  not NULL
// index      less than scans_count + messages_count + 1 of the report
// out_line   receives a text that stays until the alignment is freed, on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_alignment_line(const srf_alignment *alignment, size_t index, const char **out_line);

// Prepares a struct of figures. Call srf_snap_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_snap_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_snap_report_init_sized(srf_snap_report *report,
                                      size_t size);
#define srf_snap_report_init(report) srf_snap_report_init_sized((report), sizeof(srf_snap_report))

// Draws one scan, from a rough pose, to others, which stay: for placing by hand. What was said of the scans is not asked. The same to
// the bit for any number of threads. Some tens of milliseconds for any number of scans, once these were read: the first call does so.
// aligner          not NULL
// scan             number of a scan that was added
// world_from_scan  a pose a scan, in the order of adding, rigid: that of the scan itself is where it starts. All 0, as
//                  srf_alignment_scan() has it of scans without a group, for those that it is not drawn to. NULL for the poses that they were added with
// count            scans that were added, 0 if world_from_scan is NULL
// params           its reach, by default a tenth of the scan's size, is how far it is drawn, about. Its tolerance, min_overlap and
//                  threads count too. NULL for the defaults
// progress         NULL for none
// out_snap         initialized by srf_snap_report_init(). Not NULL
// out_touches      room for a byte a scan that was added: 1 if the scan touches that one, else 0. NULL if not wanted
// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, poses for another number of scans, one that is
//                  not rigid or none of the scan itself, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY,
//                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_aligner_snap(const srf_aligner *aligner,
                            size_t scan,
                            const srf_pose *world_from_scan,
                            size_t count,
                            const srf_align_params *params,
                            const srf_progress *progress,
                            srf_snap_report *out_snap,
                            uint8_t *out_touches);

// How far points of a scan lie outside of the surfaces of others, along normals: a mean over a few samples, so that warp and what
// moved shows. On as many threads as the scans were read with. The same to the bit for any number. O(points + scans).
// aligner          not NULL
// scan             number of a scan that was added
// world_from_scan  where the scans lie: a pose a scan, in the order of adding, rigid. All 0 for scans that are left out. NULL for the
//                  poses that they were added with
// count            scans that were added, 0 if world_from_scan is NULL
// points           3 SRF_TYPE_F64 or SRF_TYPE_F32 a point, in the scan's own frame. Not NULL
// progress         NULL for none
// out_distances    room for a double a point: negative inside, NaN where no other scan is near or the point is not finite. Not NULL
// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, poses for another number of scans, one that is
//                  not rigid or none of the scan itself, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY,
//                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_aligner_misfit(const srf_aligner *aligner,
                              size_t scan,
                              const srf_pose *world_from_scan,
                              size_t count,
                              const srf_array *points,
                              const srf_progress *progress,
                              double *out_distances);

// ==== 7. What to keep, true size and ground ================================================================
// Boxes, planes and masks keep or remove samples. Two picked points give the true size, a plane the ground.
//
//     /* Removes from all scans of a set what lies outside of a box of 2 x 2 x 2 about the origin, whenever they are read. */
//     static srf_status crop(srf_scans *scans)
//     {
//         const srf_pose cube = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
//         srf_region *region;
//         srf_status status = srf_region_box(&cube, &region);
//         if (status != SRF_OK) return status;
//         status = srf_scans_select(scans, SIZE_MAX, region, 1);
//         srf_region_free(region);
//         return status;
//     }
//
//     /* Removes the table that scans show, and lays it to height 0; they were added to the aligner where they lie. */
//     static srf_status without_table(const srf_aligner *aligner, srf_scans *scans)
//     {
//         srf_plane_params params;
//         srf_plane table;
//         srf_pose similarity;
//         srf_region *region = NULL;
//         srf_status status;
//         srf_plane_params_init(&params);
//         params.min_share = 0.2;
//         srf_plane_init(&table);
//         status = srf_dominant_plane(aligner, &params, NULL, &table);
//         if (status == SRF_OK) status = srf_region_below(&table, &region);
//         if (status == SRF_OK) status = srf_scans_select(scans, SIZE_MAX, region, 0);
//         if (status == SRF_OK) status = srf_ground(&table, NULL, &similarity);
//         if (status == SRF_OK) status = srf_scans_transform(scans, &similarity);
//         srf_region_free(region);
//         return status;
//     }
//
//     /* Removes what lies below three points that were picked, with the eye above, of an image, a cloud and a mesh. */
//     static srf_status cut_below(const double points[9], const double eye[3], srf_image *image, srf_cloud *cloud,
//                                 srf_mesh *mesh)
//     {
//         srf_plane plane;
//         srf_region *region = NULL;
//         srf_status status;
//         srf_plane_init(&plane);
//         status = srf_plane_through(points, eye, &plane);
//         if (status == SRF_OK) status = srf_region_below(&plane, &region);
//         if (status == SRF_OK) status = srf_image_select(image, region, 0, NULL, NULL);
//         if (status == SRF_OK) status = srf_cloud_select(cloud, region, 0, NULL, NULL);
//         if (status == SRF_OK) status = srf_mesh_select(mesh, NULL, region, 0, NULL, NULL);
//         srf_region_free(region);
//         return status;
//     }
//
//     /* Keeps the pixels of an image that are marked; prints how many went. */
//     static srf_status keep_marked(srf_image *image, const uint8_t *marks, size_t rows, size_t cols)
//     {
//         const srf_array of_pixels = {marks, rows * cols, 0, SRF_TYPE_U8, 1};
//         srf_region *region = NULL;
//         size_t removed = 0;
//         srf_status status = srf_region_mask(&of_pixels, rows, cols, &region);
//         if (status == SRF_OK) status = srf_image_select(image, region, 1, NULL, &removed);
//         if (status == SRF_OK) printf("%g samples went\n", (double)removed);
//         srf_region_free(region);
//         return status;
//     }
//
//     /* Scales an image, a cloud and a mesh so that two places lie half a metre apart. */
//     static srf_status true_size(const double a[3], const double b[3], srf_image *image, srf_cloud *cloud,
//                                 srf_mesh *mesh)
//     {
//         srf_pose similarity;
//         srf_status status = srf_true_size(a, b, 0.5, &similarity);
//         if (status == SRF_OK) status = srf_image_transform(image, &similarity);
//         if (status == SRF_OK) status = srf_cloud_transform(cloud, &similarity);
//         if (status == SRF_OK) status = srf_mesh_transform(mesh, &similarity);
//         return status;
//     }

// Sets the defaults. Call srf_plane_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_plane_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_plane_params_init_sized(srf_plane_params *params, size_t size);
#define srf_plane_params_init(params) srf_plane_params_init_sized((params), sizeof(srf_plane_params))

// Prepares a struct: the plane z = 0, above is +z, no margin. Call srf_plane_init(plane), which adds the size that this header knows.
// plane    not NULL
// size     sizeof(srf_plane): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_plane_init_sized(srf_plane *plane,
                                size_t size);
#define srf_plane_init(plane) srf_plane_init_sized((plane), sizeof(srf_plane))

// The plane through three points, without a margin.
// points     nine numbers: x, y, z of each. Not NULL
// above      x, y, z of a place that lies above, such as the eye. NULL: above is where the points turn counter-clockwise
// out_plane  prepared by srf_plane_init(). Not NULL
// returns    SRF_OK, SRF_ERR_INPUT for points on one line or a place on the plane, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_plane_through(const double *points,
                             const double *above,
                             srf_plane *out_plane);

// Finds the plane that most samples lie on: a table, a turntable, the ground. Above is the side that its samples were seen from. If that
// is not known, it is the side that most of the others lie on. The same for any order of the scans and any number of threads.
// aligner    one that scans were added to, one at least. They lie where they were when they were added. Clouds need no normals. Not NULL
// params     NULL for the defaults
// progress   NULL for none
// out_plane  prepared by srf_plane_init(). Its margin takes along what its samples scatter by. Not NULL
// returns    SRF_OK, SRF_ERR_INPUT where no plane stands out, with the remedy, SRF_ERR_PARAMETER, SRF_ERR_IO, SRF_ERR_FORMAT,
//            SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_dominant_plane(const srf_aligner *aligner,
                              const srf_plane_params *params,
                              const srf_progress *progress,
                              srf_plane *out_plane);

// A region of what lies in a box or on its sides.
// world_from_box  the box is what the cube from -1 to 1 along each axis becomes. Skewed and mirrored ones are fine. NULL for the identity
// out_region      receives a new handle on SRF_OK only. Not NULL
// returns         SRF_OK, SRF_ERR_INPUT for a flat box, SRF_ERR_NULL. Since 0.1.
srf_status srf_region_box(const srf_pose *world_from_box,
                          srf_region **out_region);

// A region of what lies below a plane, on it, or at most its margin above.
// plane       prepared by srf_plane_init(), srf_plane_through() or srf_dominant_plane(). Not NULL
// out_region  receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_INPUT for a normal of length 0, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_region_below(const srf_plane *plane, srf_region **out_region);

// A region of the marked samples of one scan.
// marks       one SRF_TYPE_U8 per sample, 0 for those that are not marked: pixels of an image row after row, vertices, or points. Not NULL
// rows, cols  size of the image. 0 and 0 for meshes and clouds
// out_region  receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for another number of marks than pixels, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY.
//             Since 0.1.
srf_status srf_region_mask(const srf_array *marks,
                           size_t rows,
                           size_t cols,
                           srf_region **out_region);

// Releases a region.
// region     NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_region_free(srf_region *region);

// The scale about the origin that makes two picked places lie as far apart as they truly do.
// a, b            x, y, z of each, in the world. Not NULL
// distance        how far apart they are, > 0, in the unit that the scans are to have
// out_similarity  for srf_scans_transform() and the like. Not NULL
// returns         SRF_OK, SRF_ERR_INPUT for places that are the same, SRF_ERR_PARAMETER for a distance not above 0, SRF_ERR_NULL.
//                 Since 0.1.
srf_status srf_true_size(const double *a,
                         const double *b,
                         double distance,
                         srf_pose *out_similarity);

// The least turn, and shift along `up`, that lay a plane to height 0, with what is above it above.
// plane           as for srf_region_below(). Not NULL
// up              x, y, z of a direction. NULL for z
// out_similarity  for srf_scans_transform() and the like. Not NULL
// returns         SRF_OK, SRF_ERR_INPUT for a direction or normal of length 0, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_ground(const srf_plane *plane,
                      const double *up,
                      srf_pose *out_similarity);

// Keeps or removes the samples of an image that lie in a region. Grid, projection and pose stay: what goes are invalid pixels, through
// which a merge does not see. Views of the image are gone.
// image        not NULL
// region       a mask of the image's size, a box or a plane. Not NULL
// keep         1: what the region holds stays, all else goes. 0: the other way round
// progress     NULL for none
// out_removed  receives the number of samples that went. NULL if not wanted
// returns      SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
//              SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_image_select(srf_image *image,
                            const srf_region *region,
                            uint32_t keep,
                            const srf_progress *progress,
                            size_t *out_removed);

// Keeps or removes the points of a cloud that lie in a region. Views of the cloud are gone.
// cloud        not NULL
// region       a mask of as many marks as points, a box or a plane. Not NULL
// keep         as for srf_image_select()
// progress     NULL for none
// out_removed  receives the number of points that went. NULL if not wanted
// returns      SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL.
//              Since 0.1.
srf_status srf_cloud_select(srf_cloud *cloud,
                            const srf_region *region,
                            uint32_t keep,
                            const srf_progress *progress,
                            size_t *out_removed);

// Keeps or removes the vertices of a mesh that lie in a region. Faces whose three vertices stay are kept. Order and attributes stay. Views
// of the mesh are gone.
// mesh             not NULL
// world_from_mesh  where the mesh lies. NULL for the identity
// region           a mask of as many marks as vertices, a box or a plane. Not NULL
// keep             as for srf_image_select()
// progress         NULL for none
// out_removed      receives the number of vertices that went. NULL if not wanted
// returns          SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//                  SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_select(srf_mesh *mesh,
                           const srf_pose *world_from_mesh,
                           const srf_region *region,
                           uint32_t keep,
                           const srf_progress *progress,
                           size_t *out_removed);

// Keeps or removes samples of scans of a set, whenever they are read, merged or aligned from now on: nothing is read now. Selections
// stay with the samples where scans are placed elsewhere later. A scan may end up without samples: merging passes over it.
// scans      not NULL
// index      less than the number of scans. SIZE_MAX for all of them
// region     a box, a plane, or a mask of the scan, whose size is checked when it is read. Not NULL
// keep       as for srf_image_select()
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_select(srf_scans *scans,
                            size_t index,
                            const srf_region *region,
                            uint32_t keep);

// Gives all scans of a set another size and place: poses now, samples whenever they are read. Poses stay rigid.
// scans       not NULL
// similarity  of srf_true_size(), srf_ground(), or their product: a scale, a rotation and a translation. Not NULL
// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_scans_transform(srf_scans *scans,
                               const srf_pose *similarity);

// Gives an image another size and place: samples are scaled, the pose stays rigid. Views of the image are gone.
// image       not NULL
// similarity  as for srf_scans_transform(). Not NULL
// returns     SRF_OK, SRF_ERR_INPUT for samples that become too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL,
//             SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_image_transform(srf_image *image,
                               const srf_pose *similarity);

// Gives a cloud another size and place: points are scaled, the rest goes into its place in the world. Views of the cloud are gone.
// cloud       not NULL
// similarity  as for srf_scans_transform(). Not NULL
// returns     SRF_OK, SRF_ERR_INPUT for what becomes too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_cloud_transform(srf_cloud *cloud,
                               const srf_pose *similarity);

// Scales, turns and shifts the vertices of a mesh, and scales its attributes that are lengths. Views of the mesh are gone.
// mesh        not NULL
// similarity  as for srf_scans_transform(). Not NULL
// returns     SRF_OK, SRF_ERR_INPUT for what becomes too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_mesh_transform(srf_mesh *mesh,
                              const srf_pose *similarity);

// ==== 8. Merging ===========================================================================================
// Registered scans become one surface. A merger takes scans of all kinds and is run as often as wanted.
//
//     /* Merges all scans of a set with cells of 2 units. */
//     static srf_status merge(const srf_scans *scans, srf_mesh **out_mesh)
//     {
//         srf_merge_params params;
//         srf_merger *merger;
//         srf_status status = srf_merger_create(&merger);
//         if (status != SRF_OK) return status;
//         srf_merge_params_init(&params);
//         params.voxel = 2;
//         status = srf_merger_add_scans(merger, scans);
//         if (status == SRF_OK) status = srf_merger_run(merger, &params, NULL, out_mesh, NULL);
//         srf_merger_free(merger);
//         return status;
//     }
//
//     /* Adds scans of all kinds: of a set, an image, a mesh, and one whose image a function makes when it is needed. */
//     static srf_status add_all(srf_merger *merger, const srf_scans *scans, const srf_image *image, const srf_mesh *mesh,
//                               const srf_image_source *source)
//     {
//         srf_status status = srf_merger_add_scan(merger, scans, 0);
//         if (status == SRF_OK) status = srf_merger_add_image(merger, image);
//         if (status == SRF_OK) status = srf_merger_add_mesh(merger, mesh, NULL, "model");
//         if (status == SRF_OK) status = srf_merger_add_source(merger, source, NULL, "made");
//         return status;
//     }
//
//     /* Merges twice, with another image in the place of the first scan: only what it has a part in is done anew. */
//     static srf_status preview(srf_merger *merger, const srf_image *image, srf_mesh **out_first, srf_mesh **out_second)
//     {
//         size_t renewed = 0, bricks = 0;
//         srf_status status = srf_merger_keep(merger, 1);
//         if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, out_first, NULL);
//         if (status == SRF_OK) status = srf_merger_replace_by_image(merger, 0, image);
//         if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, out_second, NULL);
//         if (status == SRF_OK) status = srf_merger_renewed(merger, &renewed, &bricks);
//         if (status == SRF_OK) printf("%g of %g bricks were new\n", (double)renewed, (double)bricks);
//         return status;
//     }
//
//     /* Puts others in the place of the first three scans, and removes the last. */
//     static srf_status exchange(srf_merger *merger, const srf_scans *scans, const srf_mesh *mesh,
//                                const srf_image_source *source)
//     {
//         size_t count = 0;
//         srf_status status = srf_merger_replace_by_scan(merger, 0, scans, 0);
//         if (status == SRF_OK) status = srf_merger_replace_by_mesh(merger, 1, mesh, NULL, "model");
//         if (status == SRF_OK) status = srf_merger_replace_by_source(merger, 2, source, NULL, "made");
//         if (status == SRF_OK) status = srf_merger_count(merger, &count);
//         if (status == SRF_OK) status = srf_merger_remove(merger, count - 1);
//         return status;
//     }
//
//     /* Merges with 4 GB: into a mesh if that fits, else straight into a file, with *out_mesh NULL. */
//     static srf_status merge_many(const srf_merger *merger, const char *path, const char *fast_disk, srf_mesh **out_mesh)
//     {
//         const uint64_t memory = 4000000000u;
//         srf_merge_report report;
//         srf_status status;
//         srf_merge_report_init(&report);
//         *out_mesh = NULL;
//         status = srf_merger_run_in_files(merger, NULL, 1, memory, fast_disk, NULL, out_mesh, &report);
//         if (status == SRF_ERR_OUT_OF_MEMORY)
//             status = srf_merger_write(merger, path, NULL, memory, fast_disk, NULL, NULL, NULL, &report);
//         if (status == SRF_OK) printf("cells of %g\n", report.voxel);
//         return status;
//     }

// Sets the defaults. Call srf_merge_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_merge_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_merge_params_init_sized(srf_merge_params *params, size_t size);
#define srf_merge_params_init(params) srf_merge_params_init_sized((params), sizeof(srf_merge_params))

// Prepares a struct of figures. Call srf_merge_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_merge_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_merge_report_init_sized(srf_merge_report *report,
                                       size_t size);
#define srf_merge_report_init(report) srf_merge_report_init_sized((report), sizeof(srf_merge_report))

// Begins a merge without scans.
// out_merger  receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_NULL. Since 0.1.
srf_status srf_merger_create(srf_merger **out_merger);

// Releases a merge. All that was added to it stays.
// merger     NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_merger_free(srf_merger *merger);

// Adds a range image as it is now. It may be freed or changed afterwards.
// merger     not NULL
// image      not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_merger_add_image(srf_merger *merger, const srf_image *image);

// Adds an oriented mesh as it is now. Its vertex attributes confidence and colour are used if there.
// merger           not NULL
// mesh             not NULL
// world_from_mesh  places it. NULL for the identity
// name             what ties are broken by, so that the order of adding does not matter, UTF-8. Not NULL
// returns          SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_merger_add_mesh(srf_merger *merger,
                               const srf_mesh *mesh,
                               const srf_pose *world_from_mesh,
                               const char *name);

// Adds all scans of a set. They are read when the merge runs, one per thread at a time, and not kept.
// merger     not NULL
// scans      not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_merger_add_scans(srf_merger *merger, const srf_scans *scans);

// Adds a scan of a set. It is read when the merge runs, and not kept.
// merger     not NULL
// scans      not NULL
// of_set     number of the scan in the set
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_add_scan(srf_merger *merger, const srf_scans *scans, size_t of_set);

// Adds a scan whose range image a function makes: it is made when the merge runs, one per thread at a time, and not kept.
// merger             not NULL
// source             makes it. The struct is copied. Not NULL
// world_from_sensor  places it, whatever pose its image has, a rotation and a translation. NULL for the identity
// name               what texts call it and ties are broken by, UTF-8. Not NULL
// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_add_source(srf_merger *merger,
                                 const srf_image_source *source,
                                 const srf_pose *world_from_sensor,
                                 const char *name);

// Number of scans. They are counted from 0 in the order of adding. Those after one that is removed move up.
// merger     not NULL
// out_scans  not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_count(const srf_merger *merger, size_t *out_scans);

// Removes a scan.
// merger     not NULL
// index      number of the scan
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_remove(srf_merger *merger, size_t index);

// Puts a range image as it is now in the place of a scan: another measurement, or the same at another pose.
// merger     not NULL
// index      number of the scan
// image      not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_replace_by_image(srf_merger *merger, size_t index, const srf_image *image);

// Puts an oriented mesh as it is now in the place of a scan. It is added as by srf_merger_add_mesh().
// merger           not NULL
// index            number of the scan
// mesh             not NULL
// world_from_mesh  places it. NULL for the identity
// name             UTF-8. Not NULL
// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_replace_by_mesh(srf_merger *merger,
                                      size_t index,
                                      const srf_mesh *mesh,
                                      const srf_pose *world_from_mesh,
                                      const char *name);

// Puts a scan of a set in the place of a scan. It is read when the merge runs.
// merger     not NULL
// index      number of the scan
// scans      not NULL
// of_set     number of the scan in the set
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_replace_by_scan(srf_merger *merger,
                                      size_t index,
                                      const srf_scans *scans,
                                      size_t of_set);

// Puts a scan whose range image a function makes in the place of a scan. It is added as by srf_merger_add_source().
// merger             not NULL
// index              number of the scan
// source             makes it. The struct is copied. Not NULL
// world_from_sensor  places it, a rotation and a translation. NULL for the identity
// name               UTF-8. Not NULL
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_replace_by_source(srf_merger *merger,
                                        size_t index,
                                        const srf_image_source *source,
                                        const srf_pose *world_from_sensor,
                                        const char *name);

// Says whether each run keeps what it found out for the next. That one then loads and counts only those scans that are new to it, and
// renews what these have a part in. The result is that of a first run, to the bit. It does not notice files that change on the disk, nor
// functions that would make another image: the scan has to be replaced, by itself if need be. A run keeps nothing for those under another
// context. If the measured cell or merge distance differs, since a scan has changed, all follows anew. Giving both as parameters makes
// that rarer. Of two runs at a time the second keeps nothing. Memory: about 125 bytes for each intersection of a scan with the grid, until
// srf_merger_free().
// merger     not NULL
// keep       1 to keep. 0, the default, gives back what is kept
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_keep(srf_merger *merger,
                           uint32_t keep);

// Amount that the last run that kept something had to renew: bricks of 32 cells a side that scans speak of. It is 0 of 0 without
// srf_merger_keep() and before the first run with it. Nothing is kept then, and each run finds out everything.
// merger       not NULL
// out_renewed  bricks labelled anew. NULL if not wanted
// out_bricks   all bricks. NULL if not wanted
// returns      SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_merger_renewed(const srf_merger *merger,
                              size_t *out_renewed,
                              size_t *out_bricks);

// Merges what was added into one surface, by Marching Intersections: a manifold mesh with boundary, the same to the bit for any number of
// threads and any order of adding. Vertex attributes: confidence, noise (standard deviation of a sample there, 0 where scans are clean),
// interpolated (on no scan exactly), source_scan (the scan of largest weight by the order of names, -1 where interpolated), colour if any
// scan has colours. Colours are averaged in linear light, and have alpha 0 and the nearest colour where no scan has one. Attribute of
// triangles: hole_fill. Blocks. Memory follows the intersections of scans and grid, 24 bytes each.
// merger      not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_merge_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED,
//             SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_merger_run(const srf_merger *merger,
                          const srf_merge_params *params,
                          const srf_progress *progress,
                          srf_mesh **out_mesh,
                          srf_merge_report *out_report);

// Merges what was added, of which there may be more than memory holds, into a surface that it does hold. The surface is the same to the
// bit as that of srf_merger_run() with memory enough. out_report says which way it went. Data that memory does not hold are in files of
// the workspace, up to 200 bytes for each intersection of scans and grid, which are removed at the end. A folder that is itself in memory,
// as some systems have it for temporary files, gains nothing. Scans of sets and of sources are read and made several times. Blocks.
// merger          not NULL
// params          NULL for the defaults
// only_if_needed  1 to begin in memory, with what srf_merger_keep() kept, and anew in files once it is foreseen, or found, that cells as
//                 large as given or measured do not fit. The kept memory is given back then. If files do not do either, cells that were
//                 not given are larger, as those of srf_merger_run(). 0 to work in files, and to keep nothing
// max_memory      most bytes that the merge takes, beside the scans that are being read, one per thread, and in files the surface. 0 for,
//                 and at most, what srf_set_memory_limit() or the context allow, else what is free
// workspace       a folder that exists, UTF-8. NULL for the system's for temporary files
// progress        NULL for none
// out_mesh        receives a new handle on SRF_OK only. Not NULL
// out_report      initialized by srf_merge_report_init(). NULL if not wanted
// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT also for a workspace that is no folder, SRF_ERR_FORMAT, SRF_ERR_IO also for a
//                 full disk, SRF_ERR_OUT_OF_MEMORY also where the surface does not fit, and in files for less than 12 MB,
//                 SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_merger_run_in_files(const srf_merger *merger,
                                   const srf_merge_params *params,
                                   uint32_t only_if_needed,
                                   uint64_t max_memory,
                                   const char *workspace,
                                   const srf_progress *progress,
                                   srf_mesh **out_mesh,
                                   srf_merge_report *out_report);

// Merges what was added, of which there may be more than memory holds, straight into a PLY file. Its bytes are those that srf_merger_run()
// and srf_mesh_write() make. Neither all scans nor the surface are in memory at once, but images and meshes that were added are. Scans of
// sets and of sources are read and made several times. Data that memory does not hold are in files of the workspace, up to 200 bytes for
// each intersection of scans and grid, which are removed at the end. A file of that name is replaced once all is written, or stays as it
// is. Nothing is kept for another run, whatever srf_merger_keep() said. Blocks.
// merger      not NULL
// path        UTF-8, ending in .ply. Not NULL
// params      NULL for the defaults
// max_memory  most bytes that the merge takes, beside the scans that are being read, one per thread. 0 for, and at most, what
//             srf_set_memory_limit() or the context allow, else what is free
// workspace   a folder that exists, UTF-8. NULL for that of the file
// options     how the file is written, not as text. NULL for the defaults
// provenance  an object in JSON that the file says of where it is from, as by srf_mesh_write_from(). NULL for none
// progress    NULL for none
// out_report  initialized by srf_merge_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT also for a workspace that is no folder, SRF_ERR_FORMAT, SRF_ERR_IO also for a full
//             disk, SRF_ERR_OUT_OF_MEMORY also for less than 12 MB per thread, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
//             SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_merger_write(const srf_merger *merger,
                            const char *path,
                            const srf_merge_params *params,
                            uint64_t max_memory,
                            const char *workspace,
                            const srf_write_options *options,
                            const char *provenance,
                            const srf_progress *progress,
                            srf_merge_report *out_report);

// ==== 9. Sculpting one scan ================================================================================
// One range image becomes few triangles within a tolerance, with a certificate of how far they lie from the
// samples.
//
//     /* The coarsest mesh within a tolerance; prints how far STL and GLB lie from the samples. */
//     static srf_status sculpt(const srf_image *image, double tolerance, srf_mesh **out_mesh)
//     {
//         srf_sculpt_report certificate;
//         srf_sculptor *sculptor;
//         srf_status status = srf_sculptor_create(image, NULL, NULL, &sculptor);
//         if (status != SRF_OK) return status;
//         srf_sculpt_report_init(&certificate);
//         status = srf_sculptor_refine(sculptor, tolerance, NULL, out_mesh, &certificate);
//         if (status == SRF_OK) printf("%g\n", certificate.max_error_single);
//         srf_sculptor_free(sculptor);
//         return status;
//     }
//
//     /* A mesh of at most so many triangles, as near as can be found; prints its tolerance. */
//     static srf_status sculpt_small(const srf_image *image, size_t triangles, srf_mesh **out_mesh)
//     {
//         srf_sculpt_params params;
//         srf_sculpt_report found;
//         srf_sculptor *sculptor;
//         srf_status status;
//         srf_sculpt_params_init(&params);
//         params.effort = 2;
//         status = srf_sculptor_create(image, &params, NULL, &sculptor);
//         if (status != SRF_OK) return status;
//         srf_sculpt_report_init(&found);
//         status = srf_sculptor_at_most(sculptor, triangles, NULL, out_mesh, &found);
//         if (status == SRF_OK) printf("%g\n", found.tolerance);
//         srf_sculptor_free(sculptor);
//         return status;
//     }

// Sets the defaults. Call srf_sculpt_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_sculpt_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_sculpt_params_init_sized(srf_sculpt_params *params, size_t size);
#define srf_sculpt_params_init(params) srf_sculpt_params_init_sized((params), sizeof(srf_sculpt_params))

// Prepares a struct of figures. Call srf_sculpt_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_sculpt_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_sculpt_report_init_sized(srf_sculpt_report *report,
                                        size_t size);
#define srf_sculpt_report_init(report) srf_sculpt_report_init_sized((report), sizeof(srf_sculpt_report))

// Makes an image ready to be sculpted: finds where the mesh may be, once for all tolerances. O(pixels). The image is kept as it is now. It
// may be freed or changed afterwards.
// image         not NULL
// params        NULL for the defaults
// progress      NULL for none
// out_sculptor  receives a new handle on SRF_OK only. Not NULL
// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
//               SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_sculptor_create(const srf_image *image,
                               const srf_sculpt_params *params,
                               const srf_progress *progress,
                               srf_sculptor **out_sculptor);

// Releases a sculptor.
// sculptor   NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_sculptor_free(srf_sculptor *sculptor);

// The mesh of few triangles within a tolerance, finer or coarser than any before. It does not depend on those. In the sensor's frame.
// srf_image_camera() places it. Every sample's ray meets the mesh within the tolerance, nothing covers an invalid pixel or bridges a jump,
// and seen from the sensor the mesh covers every place at most once. One exception: samples whose triangles all hide behind others, as
// seen along the rays, are not covered and have no bound. They count as isolated_pixels. Vertex attributes: range_row, range_col, error,
// and colour, intensity, confidence where the image has them. Attribute of triangles: error.
// sculptor         not NULL
// tolerance        in the unit of the samples, >= 0. SRF_FROM_DATA for that of the params of srf_sculptor_create()
// progress         NULL for none
// out_mesh         receives a new handle on SRF_OK only. Not NULL
// out_report       initialized by srf_sculpt_report_init(). NULL if not wanted
// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_sculptor_refine(const srf_sculptor *sculptor,
                               double tolerance,
                               const srf_progress *progress,
                               srf_mesh **out_mesh,
                               srf_sculpt_report *out_report);

// The mesh of the smallest tolerance found that has at most a number of triangles. It takes up to 24 times the work of
// srf_sculptor_refine(), and is the mesh that this makes with the tolerance in out_report.
// sculptor         not NULL
// max_triangles    what the mesh may have at most
// progress         NULL for none
// out_mesh         receives a new handle on SRF_OK only. Not NULL
// out_report       initialized by srf_sculpt_report_init(). NULL if not wanted
// returns          SRF_OK, SRF_ERR_INPUT if any mesh that covers the image has more, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//                  SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_sculptor_at_most(const srf_sculptor *sculptor,
                                size_t max_triangles,
                                const srf_progress *progress,
                                srf_mesh **out_mesh,
                                srf_sculpt_report *out_report);

// ==== 10. Quad grids and splines ===========================================================================
// One range image becomes a regular grid of quads, dense where the surface bends, and a smooth surface
// through it.
//
//     /* Writes an image as quads. */
//     static srf_status write_quads(const srf_image *image, const char *path)
//     {
//         srf_quads *quads;
//         srf_status status = srf_quads_create(image, NULL, NULL, &quads, NULL);
//         if (status != SRF_OK) return status;
//         status = srf_quads_write_obj(quads, path, NULL);
//         srf_quads_free(quads);
//         return status;
//     }
//
//     /* Makes quads that lie within an error of the samples, and hands out their vertices and corners. */
//     static srf_status quads_within(const srf_image *image, double error, srf_quads **out_quads,
//                                    srf_array *out_positions, srf_array *out_corners)
//     {
//         srf_quads_params params;
//         srf_quads_report report;
//         srf_status status;
//         srf_quads_params_init(&params);
//         srf_quads_report_init(&report);
//         params.max_error = error;
//         status = srf_quads_create(image, &params, NULL, out_quads, &report);
//         if (status != SRF_OK) return status;
//         printf("%g quads, at most %g off\n", (double)report.quads, report.max_error);
//         return srf_quads_faces(*out_quads, out_positions, NULL, out_corners, NULL);
//     }
//
//     /* The quads as triangles; prints the pixel of the grid's last vertex. */
//     static srf_status quads_as_triangles(const srf_quads *quads, srf_mesh **out_mesh)
//     {
//         srf_array pixels;
//         size_t rows = 0, cols = 0;
//         srf_status status = srf_quads_grid(quads, &rows, &cols, NULL, &pixels, NULL);
//         if (status != SRF_OK) return status;
//         printf("%u %u\n", ((const uint32_t *)pixels.data)[2 * (rows * cols - 1)],
//                ((const uint32_t *)pixels.data)[2 * (rows * cols - 1) + 1]);
//         return srf_quads_triangles(quads, out_mesh);
//     }
//
//     /* A smooth surface of 20 x 20 control points, as a mesh of 200 x 200 vertices. */
//     static srf_status smooth(const srf_quads *quads, srf_mesh **out_mesh)
//     {
//         srf_spline_params params;
//         srf_array control_points;
//         srf_spline *spline;
//         double middle[3];
//         size_t rows = 0, cols = 0;
//         srf_status status;
//         srf_spline_params_init(&params);
//         params.rows = params.columns = 20;
//         status = srf_spline_create(quads, &params, NULL, &spline, NULL, NULL);
//         if (status != SRF_OK) return status;
//         status = srf_spline_control(spline, &rows, &cols, &control_points);
//         if (status == SRF_OK) status = srf_spline_point(spline, 0.5, 0.5, middle);
//         if (status == SRF_OK) printf("its middle is at %g %g %g\n", middle[0], middle[1], middle[2]);
//         if (status == SRF_OK) status = srf_spline_sample(spline, 200, 200, out_mesh);
//         srf_spline_free(spline);
//         return status;
//     }

// Sets the defaults. Call srf_quads_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_quads_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_quads_params_init_sized(srf_quads_params *params, size_t size);
#define srf_quads_params_init(params) srf_quads_params_init_sized((params), sizeof(srf_quads_params))

// Prepares a struct of figures. Call srf_quads_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_quads_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_quads_report_init_sized(srf_quads_report *report,
                                       size_t size);
#define srf_quads_report_init(report) srf_quads_report_init_sized((report), sizeof(srf_quads_report))

// Makes a quad grid of an image. Every vertex lies on a pixel of its own. Seen on the pixels no quad folds over. The grid covers the whole
// image, and its mean error is at most that of the uniform grid of the same size. O(pixels).
// image       not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_quads   receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_quads_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
//             SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_quads_create(const srf_image *image,
                            const srf_quads_params *params,
                            const srf_progress *progress,
                            srf_quads **out_quads,
                            srf_quads_report *out_report);

// Releases a quad grid. Views of it are gone.
// quads      NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_quads_free(srf_quads *quads);

// All vertices of the grid, those on the background as well, row after row of rows * cols.
// quads           not NULL
// out_rows        rows of vertices. NULL if not wanted
// out_cols        columns of vertices. NULL if not wanted
// out_positions   3 SRF_TYPE_F64 per vertex, in the sensor's frame. On the background a continuation of the surface. NULL if not wanted
// out_pixels      2 SRF_TYPE_U32 per vertex: row and column of its pixel, rising strictly along both. NULL if not wanted
// out_background  one SRF_TYPE_U8 per vertex, 1 on pixels without a sample. NULL if not wanted
// returns         SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_quads_grid(const srf_quads *quads,
                          size_t *out_rows,
                          size_t *out_cols,
                          srf_array *out_positions,
                          srf_array *out_pixels,
                          srf_array *out_background);

// The quads that are not on the background, with the vertices they use.
// quads          not NULL
// out_positions  3 SRF_TYPE_F64 per vertex, in the sensor's frame. NULL if not wanted
// out_uvs        2 SRF_TYPE_F32 per vertex: image coordinates, 0 to 1 from the left and from the bottom. NULL if not wanted
// out_corners    4 SRF_TYPE_U32 per quad, counter-clockwise seen from the sensor. NULL if not wanted
// out_errors     one SRF_TYPE_F32 per quad: largest distance of the samples seen in it. NULL if not wanted
// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_quads_faces(const srf_quads *quads,
                           srf_array *out_positions,
                           srf_array *out_uvs,
                           srf_array *out_corners,
                           srf_array *out_errors);

// The quads as triangles, each cut along the diagonal that lies nearer to the samples: quad q is the triangles 2 q and 2 q + 1. Vertices
// are those of srf_quads_faces(), with the attributes range_row, range_col, grid_row, grid_col, and colour, intensity, confidence where
// the image has them. Attribute of triangles: error.
// quads      not NULL
// out_mesh   receives a new handle on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_quads_triangles(const srf_quads *quads,
                               srf_mesh **out_mesh);

// Writes the quads as OBJ, with colours. A file of that name is replaced once all is written, or stays.
// quads      not NULL
// path       UTF-8. Not NULL
// progress   NULL for none
// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_quads_write_obj(const srf_quads *quads, const char *path, const srf_progress *progress);

// Sets the defaults. Call srf_spline_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_spline_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_spline_params_init_sized(srf_spline_params *params, size_t size);
#define srf_spline_params_init(params) srf_spline_params_init_sized((params), sizeof(srf_spline_params))

// Fits a surface to all vertices of a quad grid, those on the background as well. O(vertices).
// quads             not NULL
// params            NULL for the defaults
// progress          NULL for none
// out_spline        receives a new handle on SRF_OK only. Not NULL
// out_max_residual  largest distance of a vertex from the surface at the vertex's parameters. NULL if not wanted
// out_rms_residual  root of the mean square of these distances. NULL if not wanted
// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
//                   Since 0.1.
srf_status srf_spline_create(const srf_quads *quads,
                             const srf_spline_params *params,
                             const srf_progress *progress,
                             srf_spline **out_spline,
                             double *out_max_residual,
                             double *out_rms_residual);

// Releases a surface. Views of it are gone.
// spline     NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_spline_free(srf_spline *spline);

// The control points, row after row of rows * cols. Knots are clamped and uniform: of n control points and order k, knot i is
// max(i - (k - 1), 0) / (n + 1 - k), at most 1.
// spline       not NULL
// out_rows     rows of control points. NULL if not wanted
// out_cols     columns of control points. NULL if not wanted
// out_points   3 SRF_TYPE_F64 per control point, in the sensor's frame. NULL if not wanted
// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_spline_control(const srf_spline *spline,
                              size_t *out_rows,
                              size_t *out_cols,
                              srf_array *out_points);

// The point of some parameters.
// spline     not NULL
// u, v       each taken into 0 to 1. Not NaN
// out_point  receives 3 numbers on SRF_OK only. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_spline_point(const srf_spline *spline, double u, double v, double *out_point);

// The surface at rows x cols evenly spread parameters, as triangles that look at the sensor: sample (i, j) is vertex
// i * cols + j.
// spline      not NULL
// rows, cols  at least 2
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
srf_status srf_spline_sample(const srf_spline *spline,
                             size_t rows,
                             size_t cols,
                             srf_mesh **out_mesh);

// ==== 11. Surfaces through points ==========================================================================
// Scattered points become a surface, closed or open. Their noise is measured and smoothed out.
//
//     /* The surface through points in double precision. */
//     static srf_status through(const double *points, size_t count, srf_mesh **out_mesh)
//     {
//         const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
//         srf_reconstructor *reconstructor = NULL;
//         srf_cloud *cloud = NULL;
//         srf_status status = srf_cloud_create(&positions, NULL, NULL, NULL, NULL, &cloud);
//         if (status == SRF_OK) status = srf_reconstructor_create(cloud, NULL, &reconstructor);
//         if (status == SRF_OK) status = srf_reconstructor_surface(reconstructor, NULL, NULL, out_mesh, NULL, NULL);
//         srf_reconstructor_free(reconstructor);
//         srf_cloud_free(cloud);
//         return status;
//     }
//
//     /* The open surface through points that one sensor saw; prints how many are not on it. */
//     static srf_status open_through(const srf_cloud *cloud, const double sensor[3], srf_mesh **out_mesh)
//     {
//         const srf_array seen_from = {sensor, 1, 0, SRF_TYPE_F64, 3};
//         srf_reconstruct_params params;
//         srf_reconstruct_report report;
//         srf_reconstructor *reconstructor;
//         srf_status status = srf_reconstructor_create(cloud, &seen_from, &reconstructor);
//         if (status != SRF_OK) return status;
//         srf_reconstruct_params_init(&params);
//         srf_reconstruct_report_init(&report);
//         params.closure = SRF_CLOSURE_OPEN;
//         status = srf_reconstructor_surface(reconstructor, &params, NULL, out_mesh, &report, NULL);
//         if (status == SRF_OK) printf("%g points are not on it\n", (double)(report.points - report.used));
//         srf_reconstructor_free(reconstructor);
//         return status;
//     }

// Sets the defaults. Call srf_reconstruct_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_reconstruct_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_reconstruct_params_init_sized(srf_reconstruct_params *params, size_t size);
#define srf_reconstruct_params_init(params) srf_reconstruct_params_init_sized((params), sizeof(srf_reconstruct_params))

// Prepares a struct of figures. Call srf_reconstruct_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_reconstruct_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_reconstruct_report_init_sized(srf_reconstruct_report *report,
                                             size_t size);
#define srf_reconstruct_report_init(report) srf_reconstruct_report_init_sized((report), sizeof(srf_reconstruct_report))

// Takes a cloud. It is kept as it is now and may be freed afterwards. O(1): the points are tetrahedralized for the first surface.
// cloud              not NULL. Its normals, if it has any, say which side of the surface is seen. Zero where unknown. If points carry
//                    noise they also tell the sides of thin walls apart, and what is inside
// sensors            3 SRF_TYPE_F64 or SRF_TYPE_F32 a place, one place or one per point: where the points were seen from, in the cloud's
//                    frame. Go before the normals. Open surfaces then span no jumps, over which sensors looked from one point past it at
//                    another, and no gaps and holes through which points were seen. What was seen from one side only is closed only if
//                    that is asked for. Three NaN where that is not known of a point, whose normal counts then. A jump is told only
//                    between points whose sensors are all known. NULL for what srf_cloud_sensor() says. With neither, closed surfaces are
//                    turned outwards, open ones up
// out_reconstructor  receives a new handle on SRF_OK only. Not NULL
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
srf_status srf_reconstructor_create(const srf_cloud *cloud,
                                    const srf_array *sensors,
                                    srf_reconstructor **out_reconstructor);

// Releases a reconstructor.
// reconstructor  NULL does nothing
// returns        SRF_OK, SRF_ERR_HANDLE. Since 0.1.
srf_status srf_reconstructor_free(srf_reconstructor *reconstructor);

// Makes a surface through the points: the first in O(n log n) in practice, others in a fraction of that. It does not depend on those. In
// the cloud's frame. Its vertices are the used points in their order. Vertex attributes: source_point, and colour, intensity, normal_x,
// normal_y, normal_z where the cloud has them.
// reconstructor  not NULL. Used by one call at a time, others are refused
// params         NULL for the defaults
// progress       NULL for none
// out_mesh       receives a new handle on SRF_OK only. Not NULL
// out_report     initialized by srf_reconstruct_report_init(). NULL if not wanted
// out_dropped    room for a byte per point, values of srf_dropped. NULL if not wanted
// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface, SRF_ERR_CANCELLED,
//                SRF_ERR_OUT_OF_MEMORY, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_reconstructor_surface(const srf_reconstructor *reconstructor,
                                     const srf_reconstruct_params *params,
                                     const srf_progress *progress,
                                     srf_mesh **out_mesh,
                                     srf_reconstruct_report *out_report,
                                     uint8_t *out_dropped);

// ==== 12. Coarse meshes ====================================================================================
// A dense mesh, or points, become a mesh of few well-shaped triangles.
//
//     /* A mesh of about so many vertices. */
//     static srf_status coarser(const srf_mesh *mesh, uint64_t vertices, srf_mesh **out_mesh)
//     {
//         srf_cluster_params params;
//         srf_cluster_params_init(&params);
//         params.vertices = vertices;
//         return srf_mesh_cluster(mesh, &params, NULL, out_mesh, NULL);
//     }
//
//     /* A mesh of even triangles through points; prints the mean of their smallest angles, in radians. */
//     static srf_status even_mesh(const srf_cloud *cloud, srf_mesh **out_mesh)
//     {
//         srf_cluster_report report;
//         srf_status status;
//         srf_cluster_report_init(&report);
//         status = srf_cloud_cluster(cloud, NULL, NULL, out_mesh, &report);
//         if (status == SRF_OK) printf("%g\n", report.after_mean_smallest_angle);
//         return status;
//     }
//
//     /* Three levels of detail of a mesh, and of points. */
//     static srf_status levels(const srf_mesh *mesh, const srf_cloud *cloud, srf_mesh *of_mesh[3], srf_mesh *of_cloud[3])
//     {
//         static const uint64_t vertices[3] = {10000, 1000, 100};
//         srf_status status = srf_mesh_cluster_levels(mesh, vertices, 3, NULL, NULL, of_mesh);
//         if (status == SRF_OK) status = srf_cloud_cluster_levels(cloud, vertices, 3, NULL, NULL, of_cloud);
//         return status;
//     }

// Sets the defaults. Call srf_cluster_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_cluster_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_cluster_params_init_sized(srf_cluster_params *params, size_t size);
#define srf_cluster_params_init(params) srf_cluster_params_init_sized((params), sizeof(srf_cluster_params))

// Prepares a struct of figures. Call srf_cluster_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_cluster_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_cluster_report_init_sized(srf_cluster_report *report,
                                         size_t size);
#define srf_cluster_report_init(report) srf_cluster_report_init_sized((report), sizeof(srf_cluster_report))

// Replaces a dense mesh by a coarse one of well-shaped triangles with the same components, boundaries and genus. Its vertices lie on the
// mesh, those of boundaries on its boundaries. Attributes of vertices ride along. Edges of more than two triangles, or of two that turn
// against each other, are cut.
// mesh        not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_cluster_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles or two of the sizes in params,
//             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_mesh_cluster(const srf_mesh *mesh,
                            const srf_cluster_params *params,
                            const srf_progress *progress,
                            srf_mesh **out_mesh,
                            srf_cluster_report *out_report);

// Makes a mesh of well-shaped triangles from points: the surface through them, as srf_reconstructor_surface() makes it with its default
// parameters, is clustered. In the cloud's frame. Colours, intensities and normals ride along.
// cloud       not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_cluster_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface or two of the sizes in params,
//             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_cloud_cluster(const srf_cloud *cloud,
                             const srf_cluster_params *params,
                             const srf_progress *progress,
                             srf_mesh **out_mesh,
                             srf_cluster_report *out_report);

// A chain of levels of detail from one run: finer levels go on splitting the patches of coarser ones.
// srf_meshes_write_glb_levels() writes them.
// mesh        not NULL
// vertices    vertices of each level, in any order. Not NULL
// count       number of levels
// params      NULL for the defaults. Its vertices, patches, max_error and triangles are not looked at
// progress    NULL for none
// out_meshes  room for count handles, which it receives in the order of vertices on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_mesh_cluster_levels(const srf_mesh *mesh,
                                   const uint64_t *vertices,
                                   size_t count,
                                   const srf_cluster_params *params,
                                   const srf_progress *progress,
                                   srf_mesh **out_meshes);

// A chain of levels of detail of points. See srf_cloud_cluster() and srf_mesh_cluster_levels().
// cloud       not NULL
// vertices    vertices of each level, in any order. Not NULL
// count       number of levels
// params      NULL for the defaults. Its vertices, patches, max_error and triangles are not looked at
// progress    NULL for none
// out_meshes  room for count handles, which it receives in the order of vertices on SRF_OK only. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_cloud_cluster_levels(const srf_cloud *cloud,
                                    const uint64_t *vertices,
                                    size_t count,
                                    const srf_cluster_params *params,
                                    const srf_progress *progress,
                                    srf_mesh **out_meshes);

// ==== 13. Closed surfaces ==================================================================================
// The openings of a surface are closed smoothly, and never where a scan saw that nothing is.
//
//     /* The surface of a merger's scans without openings, with a flat foot; prints what stays open. */
//     static srf_status watertight(const srf_mesh *surface, const srf_merger *merger, srf_mesh **out_mesh)
//     {
//         srf_close_params params;
//         srf_close_report report;
//         srf_status status;
//         srf_close_params_init(&params);
//         srf_close_report_init(&report);
//         params.flat_base = 1;
//         status = srf_mesh_close(surface, merger, &params, NULL, out_mesh, &report);
//         if (status == SRF_OK && !report.is_closed) printf("%u edges are open\n", (unsigned)report.open_edges);
//         return status;
//     }

// Sets the defaults. Call srf_close_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_close_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_close_params_init_sized(srf_close_params *params, size_t size);
#define srf_close_params_init(params) srf_close_params_init_sized((params), sizeof(srf_close_params))

// Prepares a struct of figures. Call srf_close_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_close_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_close_report_init_sized(srf_close_report *report,
                                       size_t size);
#define srf_close_report_init(report) srf_close_report_init_sized((report), sizeof(srf_close_report))

// Closes the openings of a surface with a smooth fill. Nothing is filled where a scan saw that nothing is. Vertices and triangles of the
// surface come first in the result, to the bit. The vertex attribute interpolated and the face attribute hole_fill mark the fill.
// mesh        an oriented manifold. Not NULL
// merger      holds the scans that the surface was merged of. NULL for a surface without scans, which is closed by its shape alone
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_close_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh that is no oriented manifold or scans of another world,
//             SRF_ERR_IO, SRF_ERR_FORMAT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_close(const srf_mesh *mesh,
                          const srf_merger *merger,
                          const srf_close_params *params,
                          const srf_progress *progress,
                          srf_mesh **out_mesh,
                          srf_close_report *out_report);

// ==== 14. Checks before printing ===========================================================================
// A mesh is judged before it is printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size.
// Nothing is repaired.
//
//     /* Whether a mesh in millimetres can be printed: 1 or 0. Prints what is in the way. */
//     static int is_printable(const srf_mesh *mesh)
//     {
//         srf_check_print_params params;
//         srf_check_print_report report;
//         srf_check_print_params_init(&params);
//         srf_check_print_report_init(&report);
//         params.min_wall = 0.8;
//         if (srf_mesh_check_print(mesh, &params, NULL, NULL, &report) != SRF_OK) return 0;
//         if (!report.is_closed) printf("openings: %u\n", (unsigned)report.openings);
//         if (report.crossing_pairs > 0) printf("pairs of faces that cross: %u\n", (unsigned)report.crossing_pairs);
//         if (report.thin_faces > 0) printf("a wall is %g mm thick\n", report.thinnest_wall);
//         return report.is_closed && report.crossing_pairs == 0 && report.thin_faces == 0;
//     }

// Sets the defaults. Call srf_check_print_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_check_print_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_check_print_params_init_sized(srf_check_print_params *params, size_t size);
#define srf_check_print_params_init(params) srf_check_print_params_init_sized((params), sizeof(srf_check_print_params))

// Prepares a struct of figures. Call srf_check_print_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_check_print_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_check_print_report_init_sized(srf_check_print_report *report,
                                             size_t size);
#define srf_check_print_report_init(report) srf_check_print_report_init_sized((report), sizeof(srf_check_print_report))

// Checks whether a mesh can be printed. The mesh that is given back is the same with three more attributes of its triangles: wall, the
// thickness behind the triangle, crossing, whether it crosses another, and overhang, whether it hangs over. Where a wall is
// thicker than is measured, or nothing lies behind a triangle, wall is wall_limit of the report.
// mesh        any mesh. Not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. NULL if not wanted
// out_report  initialized by srf_check_print_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a vertex that is not finite, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_check_print(const srf_mesh *mesh,
                                const srf_check_print_params *params,
                                const srf_progress *progress,
                                srf_mesh **out_mesh,
                                srf_check_print_report *out_report);

// ==== 15. Preparing a print ================================================================================
// A closed mesh is made ready for printing in 3D, by the steps that are asked for: its size, a flat base,
// thicker walls, a cavity with a drain, parts that the printer holds. Each result is closed, and no faces
// cross.
//
//     /* A statue of 120 mm that stands flat, hollow with walls of 2 mm, in parts for a printer of 100 mm. Prints how many there are. */
//     static srf_status for_printer(const srf_mesh *mesh, srf_mesh **out_mesh)
//     {
//         srf_prepare_print_params params;
//         srf_prepare_print_report report;
//         srf_status status;
//         srf_prepare_print_params_init(&params);
//         srf_prepare_print_report_init(&report);
//         params.scale_to = 120.0;
//         params.flat_base = 1;
//         params.hollow = 2.0;
//         params.printer_height = 100.0;
//         status = srf_mesh_prepare_print(mesh, &params, NULL, out_mesh, &report);
//         if (status == SRF_OK) printf("parts: %u\n", (unsigned)report.parts);
//         return status;
//     }
//
//     /* The first part of it, by itself. */
//     static srf_status first_part(const srf_mesh *prepared, srf_mesh **out_mesh)
//     {
//         return srf_mesh_part(prepared, 0, out_mesh);
//     }

// Sets the defaults. Call srf_prepare_print_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_prepare_print_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_prepare_print_params_init_sized(srf_prepare_print_params *params, size_t size);
#define srf_prepare_print_params_init(params) srf_prepare_print_params_init_sized((params), sizeof(srf_prepare_print_params))

// Prepares a struct of figures. Call srf_prepare_print_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_prepare_print_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_prepare_print_report_init_sized(srf_prepare_print_report *report,
                                               size_t size);
#define srf_prepare_print_report_init(report) srf_prepare_print_report_init_sized((report), sizeof(srf_prepare_print_report))

// Makes a closed mesh ready for printing, by the steps whose parameters are given. The attribute added of the triangles marks those that
// were made up. If the mesh was cut into parts, the attribute part has the number of the part of each triangle, counted from 0.
// mesh        closed, an oriented manifold, without crossings. Not NULL
// params      NULL for the defaults, which change nothing
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_prepare_print_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh that is not closed, crosses itself or is inside out,
//             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_prepare_print(const srf_mesh *mesh,
                                  const srf_prepare_print_params *params,
                                  const srf_progress *progress,
                                  srf_mesh **out_mesh,
                                  srf_prepare_print_report *out_report);

// The triangles of a mesh whose attribute part has a number, as a mesh with all attributes: a part that a printer holds.
// mesh      made by srf_mesh_prepare_print(). Not NULL
// number    of the part, counted from 0. The report has their count
// out_mesh  receives a new handle on SRF_OK only. Not NULL
// returns   SRF_OK, SRF_ERR_INPUT for a mesh that has no such part, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_mesh_part(const srf_mesh *mesh,
                         size_t number,
                         srf_mesh **out_mesh);

// ==== 16. Texture coordinates ==============================================================================
// A mesh gets texture coordinates: charts that are packed into one tile or several. No triangle is flipped
// and no two overlap.
//
//     /* A mesh with texture coordinates for images of 4096 texels. Prints how well they fill the image, and the first of them. */
//     static srf_status unwrapped(const srf_mesh *mesh, srf_mesh **out_mesh)
//     {
//         srf_unwrap_params params;
//         srf_unwrap_report report;
//         srf_array s, t;
//         srf_status status;
//         srf_unwrap_params_init(&params);
//         srf_unwrap_report_init(&report);
//         params.size = 4096;
//         status = srf_mesh_unwrap(mesh, &params, NULL, out_mesh, &report);
//         if (status != SRF_OK) return status;
//         printf("%u charts fill %.0f %% of the image\n", (unsigned)report.charts, 100 * report.used);
//         status = srf_mesh_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "s", &s);
//         if (status == SRF_OK) status = srf_mesh_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "t", &t);
//         if (status == SRF_OK) printf("the first vertex lies at (%g, %g)\n", *(const float *)s.data, *(const float *)t.data);
//         return status;
//     }

// Sets the defaults. Call srf_unwrap_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_unwrap_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_unwrap_params_init_sized(srf_unwrap_params *params, size_t size);
#define srf_unwrap_params_init(params) srf_unwrap_params_init_sized((params), sizeof(srf_unwrap_params))

// Prepares a struct of figures. Call srf_unwrap_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_unwrap_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_unwrap_report_init_sized(srf_unwrap_report *report,
                                        size_t size);
#define srf_unwrap_report_init(report) srf_unwrap_report_init_sized((report), sizeof(srf_unwrap_report))

// Gives a mesh texture coordinates. The result has the same triangles in the same order. Vertices on seams come once per chart. Attributes
// ride along. The attributes s and t of the vertices are the coordinates, to the right and upwards: the image of a tile fills a unit
// square, with its first row at the top. Tile k begins at (k % 10, k / 10). The attribute source_vertex is the vertex of the input that
// each vertex was. The attribute chart is the chart of each triangle, -1 for one without area in the texture.
// mesh        any mesh. Not NULL
// params      NULL for the defaults
// progress    NULL for none
// out_mesh    receives a new handle on SRF_OK only. Not NULL
// out_report  initialized by srf_unwrap_report_init(). NULL if not wanted
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles or charts that do not fit the tiles,
//             SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_unwrap(const srf_mesh *mesh,
                           const srf_unwrap_params *params,
                           const srf_progress *progress,
                           srf_mesh **out_mesh,
                           srf_unwrap_report *out_report);

// ==== 17. Textures from photos =============================================================================
// A mesh with texture coordinates gets images: colours from photos, normals, heights and occlusion from the
// detailed surface that it stands for.
//
//     /* A photo of 4000 x 3000 pixels of three bytes each, by a camera without distortion. */
//     static srf_status photographed(const char *name, const uint8_t *pixels, const srf_pose *world_from_camera, srf_photo **out_photo)
//     {
//         srf_projection camera;
//         srf_array colours;
//         srf_status status = srf_projection_pinhole(3100, 3100, 1999.5, 1499.5, 0, &camera);
//         if (status != SRF_OK) return status;
//         colours.data = pixels;
//         colours.count = (size_t)3000 * 4000;
//         colours.stride = 0;
//         colours.type = SRF_TYPE_U8;
//         colours.components = 3;
//         return srf_photo_create(3000, 4000, &camera, &colours, world_from_camera, name, 0, 0, NULL, out_photo);
//     }
//
//     /* Images of 2048 texels for a light mesh that stands for a detailed one. Takes hold of the colours of the first tile, and prints what was
//      * taken of each photo. */
//     static srf_status textured(const srf_mesh *light, const srf_mesh *detail, const srf_photo *const *photos, size_t count,
//                                srf_textures **out_textures, srf_array *colours)
//     {
//         srf_texture_params params;
//         srf_texture_report report;
//         srf_mesh *unwrapped = NULL;
//         srf_status status;
//         size_t i, size, tiles;
//         srf_texture_params_init(&params);
//         srf_texture_report_init(&report);
//         params.normal_map = 1;
//         status = srf_mesh_unwrap(light, NULL, NULL, &unwrapped, NULL);
//         if (status == SRF_OK) status = srf_mesh_texture(unwrapped, detail, photos, count, &params, NULL, out_textures, &report);
//         srf_mesh_free(unwrapped);
//         if (status != SRF_OK) return status;
//         printf("photos see %.0f %% of the texels\n", 100.0 * (double)report.seen / (double)report.texels);
//         for (i = 0; i < count && status == SRF_OK; ++i) {
//             srf_textured_photo photo;
//             srf_pose camera;
//             const char *reason = "";
//             srf_textured_photo_init(&photo);
//             status = srf_textures_photo(*out_textures, i, &photo);
//             if (status == SRF_OK) status = srf_textures_reason(*out_textures, i, &reason);
//             if (status == SRF_OK) status = srf_textures_pose(*out_textures, i, &camera);
//             if (status == SRF_OK) printf("photo %u: moved by %g pixels to %g %s\n", (unsigned)i, photo.moved, camera.matrix[12], reason);
//         }
//         if (status == SRF_OK) status = srf_textures_size(*out_textures, &size, &tiles);
//         if (status == SRF_OK) status = srf_textures_image(*out_textures, 0, SRF_TEXTURE_MAP_COLOUR, colours);
//         return status;
//     }
//
//     /* Releases both. */
//     static void release(srf_textures *textures, srf_photo *photo)
//     {
//         srf_textures_free(textures);
//         srf_photo_free(photo);
//     }

// Makes a photo of pixels in memory, which are copied.
// rows, cols         size of the photo
// projection         its camera, without distortion, of SRF_PROJECTION_PINHOLE_DEPTH: see srf_projection_pinhole(). Not NULL
// pixels             3 or 4 SRF_TYPE_U8 a pixel, sRGB, row after row from the upper left. Of 4 the last is passed over. Not NULL
// world_from_camera  places the camera, which looks along z, with x to the right and y down: a rotation and a translation. NULL for the
//                    identity
// name               for reports, UTF-8. Photos that are used together have different names. Not NULL
// depth_rows         rows of the depths. 0 without depths
// depth_cols         their columns. 0 without depths
// depths             one SRF_TYPE_F32 or SRF_TYPE_F64 a pixel of an image of the same view: what the camera measured along z, in the unit of
//                    the mesh. 0 or NaN where nothing was measured. NULL for none
// out_photo          receives a new handle on SRF_OK only. Not NULL
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
srf_status srf_photo_create(size_t rows,
                            size_t cols,
                            const srf_projection *projection,
                            const srf_array *pixels,
                            const srf_pose *world_from_camera,
                            const char *name,
                            size_t depth_rows,
                            size_t depth_cols,
                            const srf_array *depths,
                            srf_photo **out_photo);

// Releases a photo. A call that works with it on another thread goes on.
// photo      NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
srf_status srf_photo_free(srf_photo *photo);

// Sets the defaults. Call srf_texture_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_texture_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_texture_params_init_sized(srf_texture_params *params, size_t size);
#define srf_texture_params_init(params) srf_texture_params_init_sized((params), sizeof(srf_texture_params))

// Prepares a struct of figures. Call srf_textured_photo_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_textured_photo): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_textured_photo_init_sized(srf_textured_photo *report,
                                         size_t size);
#define srf_textured_photo_init(report) srf_textured_photo_init_sized((report), sizeof(srf_textured_photo))

// Prepares a struct of figures. Call srf_texture_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_texture_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_texture_report_init_sized(srf_texture_report *report,
                                         size_t size);
#define srf_texture_report_init(report) srf_texture_report_init_sized((report), sizeof(srf_texture_report))

// Makes the images of a mesh. A texel shows the place of the detailed surface behind it. Its colour is the mean, as light, of all photos
// that see this place. Places that no photo sees take the colour of the detailed surface's vertices, or else of the nearest place seen.
// The images are the same for any order of the photos.
// mesh          has texture coordinates, as srf_mesh_unwrap() gives them: attributes s and t of its vertices. Not NULL
// detail        the detailed surface that it stands for, in the same frame. Its attribute colour is used where no photo sees. May be the
//               mesh itself. Not NULL
// photos        count handles. NULL if count is 0
// count         number of photos. 0 takes all colours of the detailed surface's vertices
// params        NULL for the defaults
// progress      NULL for none
// out_textures  receives a new handle on SRF_OK only. Not NULL
// out_report    initialized by srf_texture_report_init(). NULL if not wanted
// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without texture coordinates, photos that can't be used, or neither photos
//               nor colours, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_mesh_texture(const srf_mesh *mesh,
                            const srf_mesh *detail,
                            const srf_photo *const *photos,
                            size_t count,
                            const srf_texture_params *params,
                            const srf_progress *progress,
                            srf_textures **out_textures,
                            srf_texture_report *out_report);

// Releases images. Views of them are gone.
// textures   NULL does nothing
// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
srf_status srf_textures_free(srf_textures *textures);

// The size of images.
// textures   not NULL
// out_size   receives columns and rows of a tile, which are the same. Not NULL
// out_tiles  receives the number of tiles. Not NULL
// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_textures_size(const srf_textures *textures, size_t *out_size, size_t *out_tiles);

// A view of an image of a tile, row after row. The first row is at the top, where t is largest. Tile k fills the unit square at
// (k % 10, k / 10).
// textures   not NULL
// tile       less than the number of tiles
// map        a value of srf_texture_map
// out_image  receives the view, which is empty for a map that was not asked for. Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_textures_image(const srf_textures *textures,
                              size_t tile,
                              uint32_t map,
                              srf_array *out_image);

// The pose of a photo's camera as it was used.
// textures  not NULL
// index     number of the photo, in the order in which they were given
// out_pose  receives world_from_camera on SRF_OK only. Not NULL
// returns   SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_textures_pose(const srf_textures *textures, size_t index, srf_pose *out_pose);

// The figures of a photo.
// textures   not NULL
// index      number of the photo, in the order in which they were given
// out_photo  initialized by srf_textured_photo_init(). Not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
srf_status srf_textures_photo(const srf_textures *textures, size_t index, srf_textured_photo *out_photo);

// Why nothing was taken of a photo.
// textures    not NULL
// index       number of the photo, in the order in which they were given
// out_reason  receives a text that stays until the images are freed, empty for a photo that was used. Not NULL
// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
srf_status srf_textures_reason(const srf_textures *textures,
                               size_t index,
                               const char **out_reason);

// ==== 18. The virtual scanner ==============================================================================
// Range images of any mesh, with the errors that a scanner makes: for tests that know the truth.
//
//     /* Scans a mesh from where the sensor stands. */
//     static srf_status scan(const srf_mesh *mesh, const srf_pose *world_from_sensor, srf_image **out_image)
//     {
//         srf_projection camera;
//         const srf_status status = srf_projection_pinhole(500, 500, 319.5, 239.5, 0, &camera);
//         if (status != SRF_OK) return status;
//         return srf_scan_mesh(mesh, 480, 640, &camera, world_from_sensor, NULL, NULL, out_image);
//     }
//
//     /* The same with noise of half a unit, and a pixel of a hundred that gives no value. */
//     static srf_status scan_badly(const srf_mesh *mesh, const srf_projection *camera, const srf_pose *world_from_sensor,
//                                  srf_image **out_image)
//     {
//         srf_scan_params params;
//         srf_scan_params_init(&params);
//         params.noise = 0.5;
//         params.dropout = 0.01;
//         return srf_scan_mesh(mesh, 480, 640, camera, world_from_sensor, &params, NULL, out_image);
//     }

// Sets the defaults. Call srf_scan_params_init(params), which adds the size that this header knows.
// params   not NULL
// size     sizeof(srf_scan_params): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_scan_params_init_sized(srf_scan_params *params, size_t size);
#define srf_scan_params_init(params) srf_scan_params_init_sized((params), sizeof(srf_scan_params))

// Scans a mesh: a value for every pixel whose ray meets it. The same image for any number of threads. If the mesh has the vertex attribute
// colour, the image has colours.
// mesh               not NULL
// rows, cols         size of the image
// projection         how pixels see, no grid. Not NULL
// world_from_sensor  where the sensor stands: a rotation and a translation. NULL for the identity
// params             NULL for the defaults
// progress           NULL for none
// out_image          receives a new handle on SRF_OK only. Not NULL
// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
//                    SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_scan_mesh(const srf_mesh *mesh,
                         size_t rows,
                         size_t cols,
                         const srf_projection *projection,
                         const srf_pose *world_from_sensor,
                         const srf_scan_params *params,
                         const srf_progress *progress,
                         srf_image **out_image);

// ==== 19. Measuring ========================================================================================
// How far points or a surface lie from a mesh.
//
//     /* Prints the largest distance of a surface from a reference. */
//     static srf_status compare(const srf_mesh *mesh, const srf_mesh *reference)
//     {
//         srf_distance_report figures;
//         srf_status status;
//         srf_distance_report_init(&figures);
//         status = srf_mesh_surface_distance(mesh, reference, 0, 0, NULL, NULL, &figures);
//         if (status == SRF_OK) printf("at most %g\n", figures.bound);
//         return status;
//     }
//
//     /* Prints how far points lie from a mesh: the mean, and what 95 of 100 do not exceed. */
//     static srf_status print_distances(const srf_mesh *mesh, const double *points, size_t count)
//     {
//         const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
//         srf_distance_report figures;
//         srf_status status;
//         srf_distance_report_init(&figures);
//         status = srf_mesh_distances(mesh, &positions, 0, 0, NULL, NULL, &figures);
//         if (status == SRF_OK) printf("%g, %g\n", figures.mean, figures.p95);
//         return status;
//     }

// Prepares a struct of figures. Call srf_distance_report_init(report), which adds the size that this header knows.
// report   not NULL
// size     sizeof(srf_distance_report): what of the struct this library does not know becomes 0
// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
srf_status srf_distance_report_init_sized(srf_distance_report *report,
                                          size_t size);
#define srf_distance_report_init(report) srf_distance_report_init_sized((report), sizeof(srf_distance_report))

// Exact distances of points to the nearest point of a mesh. Time O((n + m) log m) for n points and m triangles. The same for
// any number of threads.
// mesh           with at least one triangle. Not NULL
// points         3 SRF_TYPE_F64 or SRF_TYPE_F32 a point, finite. Not NULL
// is_signed      1: distances behind the surface are negative. 0: all are positive
// threads        at most 1024. 0 for the number of srf_set_threads()
// progress       NULL for none
// out_distances  room for a double a point. NULL if only the figures are wanted
// out_figures    initialized by srf_distance_report_init(). NULL if not wanted
// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
//                Since 0.1.
srf_status srf_mesh_distances(const srf_mesh *mesh,
                              const srf_array *points,
                              uint32_t is_signed,
                              uint32_t threads,
                              const srf_progress *progress,
                              double *out_distances,
                              srf_distance_report *out_figures);

// How far one surface lies from another: exact at its vertices, with a bound that holds for every point between them.
// mesh           the surface. Not NULL
// reference      with at least one triangle. Not NULL
// is_signed      1: distances behind the reference are negative. 0: all are positive
// threads        at most 1024. 0 for the number of srf_set_threads()
// progress       NULL for none
// out_distances  room for a double a vertex of mesh. NULL if only the figures are wanted
// out_figures    of the vertices, and how far the surface reaches between them. Initialized by srf_distance_report_init(). NULL if not wanted
// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
//                Since 0.1.
srf_status srf_mesh_surface_distance(const srf_mesh *mesh,
                                     const srf_mesh *reference,
                                     uint32_t is_signed,
                                     uint32_t threads,
                                     const srf_progress *progress,
                                     double *out_distances,
                                     srf_distance_report *out_figures);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SURFRECON_H */
