//! The built C library, loaded as a stranger would, and every function the header declares.

use std::ffi::{CStr, c_char, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use libloading::Library;

use crate::arguments::Argument;
use crate::calls::kit::{Fault, Kit};
use crate::calls::right::Right;
pub use crate::types::*;

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The folder of the built library: `SURFRECON_BUILT`. Without it the library is built here, once: cargo builds none for a test that
/// only loads it.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        if let Some(built) = std::env::var_os("SURFRECON_BUILT") {
            return built.into();
        }
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder").to_owned();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--package", "surfrecon-capi", "--target-dir"])
            .arg(&target)
            .current_dir(root())
            .status();
        assert!(built.expect("cargo can be run").success(), "surfrecon-capi does not build");
        target.join("debug")
    })
}

macro_rules! functions {
    ($($name:ident($($argument:ident: $t:ty),*) -> $r:ty;)*) => {
        /// Every function of the header.
        #[derive(Clone, Copy)]
        pub struct Api {
            $(pub $name: unsafe extern "C" fn($($t),*) -> $r,)*
        }

        /// Their names.
        pub const NAMES: &[&str] = &[$(stringify!($name)),*];

        /// The functions as tests call them: what each returns is noted.
        mod noted {
            use super::*;
            $(
                pub unsafe extern "C" fn $name($($argument: $t),*) -> $r {
                    // SAFETY: the caller's contract is that of the function.
                    let answer = unsafe { (library().$name)($($argument),*) };
                    if let Some(status) = status_of(&answer) {
                        crate::returned::note(stringify!($name), status);
                    }
                    answer
                }
            )*
        }

        const NOTED: Api = Api { $($name: noted::$name),* };

        impl Api {
            fn load(library: &'static Library) -> Api {
                Api {$(
                    // SAFETY: the type is the one the header declares.
                    $name: *unsafe { library.get::<unsafe extern "C" fn($($t),*) -> $r>(stringify!($name).as_bytes()) }
                        .unwrap_or_else(|error| panic!("{error}")),
                )*}
            }

            /// Calls one function with what is right for its arguments, or wrong in the way that the kit has. Its status. Nothing where it
            /// answers with none, or no argument can be wrong in that way.
            pub fn call_rightly(&self, name: &str, kit: &Kit) -> Option<i32> {
                $(
                    if name == stringify!($name) {
                        $(let $argument = <$t as Right>::right(kit, kind_of(stringify!($argument)));)*
                        if ![Fault::None, Fault::Memory].contains(&kit.fault) && !kit.has_fault.get() {
                            return None;
                        }
                        // SAFETY: as the header wants it, or wrong in a way that is checked.
                        let answer = kit.call(|| unsafe { (self.$name)($($argument),*) });
                        return status_of(&answer);
                    }
                )*
                None
            }

            /// Calls every function that answers with a status with nothing but zeros. Name and status.
            pub fn call_with_zeros(&self) -> Vec<(&'static str, i32)> {
                let mut all = Vec::new();
                $(
                    // SAFETY: NULL is checked for.
                    let answer = unsafe { (self.$name)($(<$t>::zero()),*) };
                    if let Some(status) = status_of(&answer) {
                        all.push((stringify!($name), status));
                    }
                )*
                all
            }

            /// Calls every function that takes a handle with one that never was. Name and status.
            pub fn call_with_junk(&self) -> Vec<(&'static str, i32)> {
                let mut all = Vec::new();
                let mut scratch = [0_u64; 64];
                $(
                    if [$(<$t>::IS_HANDLE),*].contains(&true) {
                        scratch.fill(0);
                        let room: *mut c_void = scratch.as_mut_ptr().cast();
                        let _ = &room;
                        // SAFETY: results have room, everything else is checked.
                        let answer = unsafe { (self.$name)($(<$t>::junk(room)),*) };
                        if let Some(status) = status_of(&answer) {
                            all.push((stringify!($name), status));
                        }
                    }
                )*
                all
            }
        }
    };
}

/// The sort of an argument, by its name in the header: outputs are called as what they are, poses by what they place.
fn kind_of(name: &str) -> &str {
    match name {
        "world_from_scan" => "poses",
        name if name.starts_with("world_from_") => "pose",
        name => name.strip_prefix("out_").unwrap_or(name),
    }
}

/// Functions that answer with a status answer with an i32, and only they do.
fn status_of(answer: &dyn std::any::Any) -> Option<i32> {
    answer.downcast_ref::<i32>().copied()
}

functions! {
    srf_version() -> *const c_char;
    srf_version_number() -> u32;
    srf_abi_version() -> u32;
    srf_last_error_message() -> *const c_char;
    srf_set_last_error(text: *const c_char) -> i32;
    srf_status_text(status: i32, out_text: *mut *const c_char) -> i32;
    srf_set_threads(threads: u32) -> i32;
    srf_threads() -> u32;
    srf_set_memory_limit(bytes: u64) -> i32;
    srf_memory_limit() -> u64;
    srf_set_log(log: LogFn, user: *mut c_void) -> i32;
    srf_context_create(out_context: *mut Handle) -> i32;
    srf_context_free(context: Handle) -> i32;
    srf_context_use(context: Handle, out_former: *mut Handle) -> i32;
    srf_context_set_threads(context: Handle, threads: u32) -> i32;
    srf_context_threads(context: Handle, out_threads: *mut u32) -> i32;
    srf_context_set_memory_limit(context: Handle, bytes: u64) -> i32;
    srf_context_memory(context: Handle, out_limit: *mut u64, out_held: *mut u64) -> i32;
    srf_context_set_log(context: Handle, log: LogFn, user: *mut c_void) -> i32;
    srf_set_allocator(allocator: *const [usize; 4]) -> i32;
    srf_cancel_create(out_cancel: *mut Handle) -> i32;
    srf_cancel_free(cancel: Handle) -> i32;
    srf_cancel_set(cancel: Handle) -> i32;
    srf_cancel_reset(cancel: Handle) -> i32;
    srf_cancel_is_set(cancel: Handle, out_is_set: *mut u32) -> i32;
    srf_triangulate_params_init_sized(params: *mut TriangulateParams, size: usize) -> i32;
    srf_projection_pinhole(fx: f64, fy: f64, cx: f64, cy: f64, along_ray: u32, out_projection: *mut Projection) -> i32;
    srf_projection_orthographic(first_x: f64, first_y: f64, step_x: f64, step_y: f64, out_projection: *mut Projection) -> i32;
    srf_projection_spherical(azimuth: f64, elevation: f64, azimuth_step: f64, elevation_step: f64, out_projection: *mut Projection) -> i32;
    srf_projection_grid_parallel(direction: *const f64, out_projection: *mut Projection) -> i32;
    srf_projection_grid_from(origin: *const f64, out_projection: *mut Projection) -> i32;
    srf_image_create(rows: usize, cols: usize, projection: *const Projection, samples: *const Array, world_from_sensor: *const [f64; 16], name: *const c_char, out_image: *mut Handle) -> i32;
    srf_image_free(image: Handle) -> i32;
    srf_image_size(image: Handle, out_rows: *mut usize, out_cols: *mut usize, out_valid: *mut usize) -> i32;
    srf_image_name(image: Handle, out_name: *mut *const c_char) -> i32;
    srf_image_camera(image: Handle, out_projection: *mut Projection, out_pose: *mut [f64; 16]) -> i32;
    srf_image_samples(image: Handle, out_samples: *mut Array) -> i32;
    srf_image_world_points(image: Handle, out_points: *mut f64, capacity: usize, progress: *const Watch) -> i32;
    srf_image_ray(image: Handle, row: usize, col: usize, out_origin: *mut f64, out_direction: *mut f64) -> i32;
    srf_image_set_pose(image: Handle, world_from_sensor: *const [f64; 16]) -> i32;
    srf_image_set_name(image: Handle, name: *const c_char) -> i32;
    srf_image_set_attributes(image: Handle, colours: *const Array, intensities: *const Array, confidences: *const Array) -> i32;
    srf_image_attributes(image: Handle, out_colours: *mut Array, out_intensities: *mut Array, out_confidences: *mut Array) -> i32;
    srf_image_triangulate(image: Handle, params: *const TriangulateParams, progress: *const Watch, out_mesh: *mut Handle) -> i32;
    srf_image_sensor(image: Handle, out_sensor: *mut f64) -> i32;
    srf_image_to_cloud(image: Handle, progress: *const Watch, out_cloud: *mut Handle) -> i32;
    srf_left_out_report_init_sized(report: *mut LeftOutReport, size: usize) -> i32;
    srf_frame_init_sized(frame: *mut Frame, size: usize) -> i32;
    srf_image_from_frame(frame: *const Frame, depths: *const Array, colours: *const Array, confidences: *const Array, world_from_sensor: *const [f64; 16], name: *const c_char, progress: *const Watch, out_image: *mut Handle, out_left_out: *mut LeftOutReport) -> i32;
    srf_cloud_create(positions: *const Array, normals: *const Array, colours: *const Array, intensities: *const Array, world_from_cloud: *const [f64; 16], out_cloud: *mut Handle) -> i32;
    srf_cloud_free(cloud: Handle) -> i32;
    srf_cloud_arrays(cloud: Handle, out_positions: *mut Array, out_normals: *mut Array, out_colours: *mut Array, out_intensities: *mut Array) -> i32;
    srf_cloud_sensor(cloud: Handle, out_sensor: *mut f64) -> i32;
    srf_cloud_pose(cloud: Handle, out_pose: *mut [f64; 16]) -> i32;
    srf_check_report_init_sized(report: *mut CheckReport, size: usize) -> i32;
    srf_mesh_create(positions: *const Array, triangles: *const Array, out_mesh: *mut Handle) -> i32;
    srf_mesh_free(mesh: Handle) -> i32;
    srf_mesh_positions(mesh: Handle, out_positions: *mut Array) -> i32;
    srf_mesh_triangles(mesh: Handle, out_triangles: *mut Array) -> i32;
    srf_mesh_attribute_count(mesh: Handle, domain: u32, out_count: *mut usize) -> i32;
    srf_mesh_attribute_name(mesh: Handle, domain: u32, index: usize, out_name: *mut *const c_char) -> i32;
    srf_mesh_attribute(mesh: Handle, domain: u32, name: *const c_char, out_data: *mut Array) -> i32;
    srf_mesh_set_attribute(mesh: Handle, domain: u32, name: *const c_char, data: *const Array) -> i32;
    srf_mesh_check(mesh: Handle, welded: u32, progress: *const Watch, out_report: *mut CheckReport) -> i32;
    srf_mesh_size(mesh: Handle, out_vertices: *mut usize, out_triangles: *mut usize) -> i32;
    srf_cloud_size(cloud: Handle, out_points: *mut usize) -> i32;
    srf_mesh_bounds(mesh: Handle, progress: *const Watch, out_min: *mut f64, out_max: *mut f64) -> i32;
    srf_cloud_bounds(cloud: Handle, progress: *const Watch, out_min: *mut f64, out_max: *mut f64) -> i32;
    srf_image_bounds(image: Handle, progress: *const Watch, out_min: *mut f64, out_max: *mut f64) -> i32;
    srf_mesh_positions_f32(mesh: Handle, origin: *const f64, out_positions: *mut f32, capacity: usize, progress: *const Watch) -> i32;
    srf_cloud_positions_f32(cloud: Handle, origin: *const f64, out_positions: *mut f32, capacity: usize, progress: *const Watch) -> i32;
    srf_grid_camera_init_sized(camera: *mut GridCamera, size: usize) -> i32;
    srf_image_grid_camera(image: Handle, progress: *const Watch, out_camera: *mut GridCamera) -> i32;
    srf_grid_camera_scale(camera: *mut GridCamera, scale: f64) -> i32;
    srf_image_to_mesh(image: Handle, faces: u32, progress: *const Watch, out_mesh: *mut Handle) -> i32;
    srf_image_from_vertices(camera: *const GridCamera, row: *const Array, col: *const Array, positions: *const Array, colours: *const Array, intensities: *const Array, confidences: *const Array, world_from_host: *const [f64; 16], name: *const c_char, progress: *const Watch, out_image: *mut Handle) -> i32;
    srf_format_count(out_count: *mut usize) -> i32;
    srf_format(index: usize, out_name: *mut *const c_char, out_endings: *mut *const c_char, out_is_side_file: *mut u32) -> i32;
    srf_folder_create(sink: *const FileSink, out_folder: *mut Handle) -> i32;
    srf_folder_free(folder: Handle) -> i32;
    srf_folder_path(folder: Handle, name: *const c_char, out_path: *mut *const c_char) -> i32;
    srf_folder_put(folder: Handle, name: *const c_char, bytes: *const c_void, count: usize) -> i32;
    srf_folder_put_source(folder: Handle, name: *const c_char, source: *const FileSource) -> i32;
    srf_folder_remove(folder: Handle, name: *const c_char, out_removed: *mut u32) -> i32;
    srf_folder_count(folder: Handle, out_count: *mut usize) -> i32;
    srf_folder_name(folder: Handle, index: usize, out_name: *mut *const c_char) -> i32;
    srf_folder_bytes(folder: Handle, name: *const c_char, out_bytes: *mut *const c_void, out_count: *mut usize) -> i32;
    srf_read_options_init_sized(options: *mut ReadOptions, size: usize) -> i32;
    srf_scans_open(paths: *const *const c_char, count: usize, options: *const ReadOptions, progress: *const Watch, out_scans: *mut Handle) -> i32;
    srf_scans_free(scans: Handle) -> i32;
    srf_scans_count(scans: Handle, out_scans: *mut usize, out_notes: *mut usize) -> i32;
    srf_scans_note(scans: Handle, index: usize, out_note: *mut *const c_char) -> i32;
    srf_scans_describe(scans: Handle, index: usize, out_name: *mut *const c_char, out_pose: *mut [f64; 16]) -> i32;
    srf_scans_set_pose(scans: Handle, index: usize, world_from_sensor: *const [f64; 16]) -> i32;
    srf_scans_is_frame(scans: Handle, index: usize, out_is_frame: *mut u32) -> i32;
    srf_scans_read(scans: Handle, index: usize, progress: *const Watch, out_content: *mut u32, out_image: *mut Handle, out_mesh: *mut Handle, out_cloud: *mut Handle) -> i32;
    srf_write_options_init_sized(options: *mut WriteOptions, size: usize) -> i32;
    srf_mesh_write(mesh: Handle, path: *const c_char, options: *const WriteOptions, progress: *const Watch) -> i32;
    srf_check_mesh_file(file: *const c_char, options: *const WriteOptions) -> i32;
    srf_mesh_write_ply(mesh: Handle, path: *const c_char, encoding: u32, progress: *const Watch) -> i32;
    srf_mesh_write_glb(mesh: Handle, path: *const c_char, name: *const c_char, metres_per_unit: f64, z_up: u32, progress: *const Watch) -> i32;
    srf_meshes_write_glb_levels(meshes: *const Handle, count: usize, path: *const c_char, name: *const c_char, metres_per_unit: f64, z_up: u32, progress: *const Watch) -> i32;
    srf_mesh_write_obj(mesh: Handle, path: *const c_char, progress: *const Watch) -> i32;
    srf_mesh_write_stl(mesh: Handle, path: *const c_char, progress: *const Watch) -> i32;
    srf_cloud_write_ply(cloud: Handle, path: *const c_char, encoding: u32, progress: *const Watch) -> i32;
    srf_images_write_conf(images: *const Handle, count: usize, path: *const c_char, encoding: u32, progress: *const Watch) -> i32;
    srf_images_write_ptx(images: *const Handle, count: usize, path: *const c_char, progress: *const Watch) -> i32;
    srf_images_write_e57(images: *const Handle, count: usize, path: *const c_char, progress: *const Watch) -> i32;
    srf_scans_crs(scans: Handle, index: usize, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> i32;
    srf_scans_set_crs(scans: Handle, index: usize, text: *const c_char) -> i32;
    srf_image_crs(image: Handle, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> i32;
    srf_image_set_crs(image: Handle, text: *const c_char) -> i32;
    srf_cloud_crs(cloud: Handle, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> i32;
    srf_cloud_set_crs(cloud: Handle, text: *const c_char) -> i32;
    srf_mesh_crs(mesh: Handle, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> i32;
    srf_mesh_set_crs(mesh: Handle, text: *const c_char) -> i32;
    srf_mesh_write_from(mesh: Handle, path: *const c_char, options: *const WriteOptions, provenance: *const c_char, progress: *const Watch) -> i32;
    srf_images_write_e57_from(images: *const Handle, count: usize, path: *const c_char, provenance: *const c_char, progress: *const Watch) -> i32;
    srf_file_provenance(path: *const c_char, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> i32;
    srf_align_params_init_sized(params: *mut AlignParams, size: usize) -> i32;
    srf_pick_init_sized(pick: *mut Pick, size: usize) -> i32;
    srf_aligner_create(out_aligner: *mut Handle) -> i32;
    srf_aligner_free(aligner: Handle) -> i32;
    srf_aligner_add_image(aligner: Handle, image: Handle) -> i32;
    srf_aligner_add_mesh(aligner: Handle, mesh: Handle, world_from_mesh: *const [f64; 16], name: *const c_char) -> i32;
    srf_aligner_add_cloud(aligner: Handle, cloud: Handle, name: *const c_char) -> i32;
    srf_aligner_add_scans(aligner: Handle, scans: Handle) -> i32;
    srf_aligner_add_source(aligner: Handle, source: *const ImageSource, world_from_sensor: *const [f64; 16], name: *const c_char) -> i32;
    srf_aligner_count(aligner: Handle, out_scans: *mut usize) -> i32;
    srf_aligner_fix(aligner: Handle, scan: usize) -> i32;
    srf_aligner_pick(aligner: Handle, pick: *const Pick) -> i32;
    srf_aligner_trust(aligner: Handle, a: usize, b: usize) -> i32;
    srf_aligner_reject(aligner: Handle, a: usize, b: usize) -> i32;
    srf_aligner_turn(aligner: Handle, point: *const f64, direction: *const f64, angles: *const f64, count: usize) -> i32;
    srf_aligner_run(aligner: Handle, params: *const AlignParams, progress: *const Watch, out_alignment: *mut Handle) -> i32;
    srf_aligned_scan_init_sized(report: *mut AlignedScan, size: usize) -> i32;
    srf_aligned_pair_init_sized(report: *mut AlignedPair, size: usize) -> i32;
    srf_align_report_init_sized(report: *mut AlignReport, size: usize) -> i32;
    srf_alignment_free(alignment: Handle) -> i32;
    srf_alignment_report(alignment: Handle, out_report: *mut AlignReport) -> i32;
    srf_alignment_scan(alignment: Handle, index: usize, out_scan: *mut AlignedScan) -> i32;
    srf_alignment_pair(alignment: Handle, index: usize, out_pair: *mut AlignedPair) -> i32;
    srf_alignment_turntable(alignment: Handle, out_found: *mut u32, out_point: *mut f64, out_direction: *mut f64, out_angles: *mut Array) -> i32;
    srf_alignment_reason(alignment: Handle, index: usize, out_reason: *mut *const c_char) -> i32;
    srf_alignment_message(alignment: Handle, index: usize, out_message: *mut *const c_char) -> i32;
    srf_alignment_line(alignment: Handle, index: usize, out_line: *mut *const c_char) -> i32;
    srf_snap_report_init_sized(report: *mut Snap, size: usize) -> i32;
    srf_aligner_snap(aligner: Handle, scan: usize, world_from_scan: *const [f64; 16], count: usize, params: *const AlignParams, progress: *const Watch, out_snap: *mut Snap, out_touches: *mut u8) -> i32;
    srf_aligner_misfit(aligner: Handle, scan: usize, world_from_scan: *const [f64; 16], count: usize, points: *const Array, progress: *const Watch, out_distances: *mut f64) -> i32;
    srf_plane_params_init_sized(params: *mut PlaneParams, size: usize) -> i32;
    srf_plane_init_sized(plane: *mut Plane, size: usize) -> i32;
    srf_plane_through(points: *const f64, above: *const f64, out_plane: *mut Plane) -> i32;
    srf_dominant_plane(aligner: Handle, params: *const PlaneParams, progress: *const Watch, out_plane: *mut Plane) -> i32;
    srf_region_box(world_from_box: *const [f64; 16], out_region: *mut Handle) -> i32;
    srf_region_below(plane: *const Plane, out_region: *mut Handle) -> i32;
    srf_region_mask(marks: *const Array, rows: usize, cols: usize, out_region: *mut Handle) -> i32;
    srf_region_free(region: Handle) -> i32;
    srf_true_size(a: *const f64, b: *const f64, distance: f64, out_similarity: *mut [f64; 16]) -> i32;
    srf_ground(plane: *const Plane, up: *const f64, out_similarity: *mut [f64; 16]) -> i32;
    srf_image_select(image: Handle, region: Handle, keep: u32, progress: *const Watch, out_removed: *mut usize) -> i32;
    srf_cloud_select(cloud: Handle, region: Handle, keep: u32, progress: *const Watch, out_removed: *mut usize) -> i32;
    srf_mesh_select(mesh: Handle, world_from_mesh: *const [f64; 16], region: Handle, keep: u32, progress: *const Watch, out_removed: *mut usize) -> i32;
    srf_scans_select(scans: Handle, index: usize, region: Handle, keep: u32) -> i32;
    srf_scans_transform(scans: Handle, similarity: *const [f64; 16]) -> i32;
    srf_image_transform(image: Handle, similarity: *const [f64; 16]) -> i32;
    srf_cloud_transform(cloud: Handle, similarity: *const [f64; 16]) -> i32;
    srf_mesh_transform(mesh: Handle, similarity: *const [f64; 16]) -> i32;
    srf_merge_params_init_sized(params: *mut MergeParams, size: usize) -> i32;
    srf_merge_report_init_sized(report: *mut MergeReport, size: usize) -> i32;
    srf_merger_create(out_merger: *mut Handle) -> i32;
    srf_merger_free(merger: Handle) -> i32;
    srf_merger_add_image(merger: Handle, image: Handle) -> i32;
    srf_merger_add_mesh(merger: Handle, mesh: Handle, world_from_mesh: *const [f64; 16], name: *const c_char) -> i32;
    srf_merger_add_scans(merger: Handle, scans: Handle) -> i32;
    srf_merger_add_scan(merger: Handle, scans: Handle, of_set: usize) -> i32;
    srf_merger_add_source(merger: Handle, source: *const ImageSource, world_from_sensor: *const [f64; 16], name: *const c_char) -> i32;
    srf_merger_count(merger: Handle, out_scans: *mut usize) -> i32;
    srf_merger_remove(merger: Handle, index: usize) -> i32;
    srf_merger_replace_by_image(merger: Handle, index: usize, image: Handle) -> i32;
    srf_merger_replace_by_mesh(merger: Handle, index: usize, mesh: Handle, world_from_mesh: *const [f64; 16], name: *const c_char) -> i32;
    srf_merger_replace_by_scan(merger: Handle, index: usize, scans: Handle, of_set: usize) -> i32;
    srf_merger_replace_by_source(merger: Handle, index: usize, source: *const ImageSource, world_from_sensor: *const [f64; 16], name: *const c_char) -> i32;
    srf_merger_keep(merger: Handle, keep: u32) -> i32;
    srf_merger_renewed(merger: Handle, out_renewed: *mut usize, out_bricks: *mut usize) -> i32;
    srf_merger_run(merger: Handle, params: *const MergeParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut MergeReport) -> i32;
    srf_merger_run_in_files(merger: Handle, params: *const MergeParams, only_if_needed: u32, max_memory: u64, workspace: *const c_char, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut MergeReport) -> i32;
    srf_merger_write(merger: Handle, path: *const c_char, params: *const MergeParams, max_memory: u64, workspace: *const c_char, options: *const WriteOptions, provenance: *const c_char, progress: *const Watch, out_report: *mut MergeReport) -> i32;
    srf_sculpt_params_init_sized(params: *mut SculptParams, size: usize) -> i32;
    srf_sculpt_report_init_sized(report: *mut SculptReport, size: usize) -> i32;
    srf_sculptor_create(image: Handle, params: *const SculptParams, progress: *const Watch, out_sculptor: *mut Handle) -> i32;
    srf_sculptor_free(sculptor: Handle) -> i32;
    srf_sculptor_refine(sculptor: Handle, tolerance: f64, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut SculptReport) -> i32;
    srf_sculptor_at_most(sculptor: Handle, max_triangles: usize, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut SculptReport) -> i32;
    srf_quads_params_init_sized(params: *mut QuadsParams, size: usize) -> i32;
    srf_quads_report_init_sized(report: *mut QuadReport, size: usize) -> i32;
    srf_quads_create(image: Handle, params: *const QuadsParams, progress: *const Watch, out_quads: *mut Handle, out_report: *mut QuadReport) -> i32;
    srf_quads_free(quads: Handle) -> i32;
    srf_quads_grid(quads: Handle, out_rows: *mut usize, out_cols: *mut usize, out_positions: *mut Array, out_pixels: *mut Array, out_background: *mut Array) -> i32;
    srf_quads_faces(quads: Handle, out_positions: *mut Array, out_uvs: *mut Array, out_corners: *mut Array, out_errors: *mut Array) -> i32;
    srf_quads_triangles(quads: Handle, out_mesh: *mut Handle) -> i32;
    srf_quads_write_obj(quads: Handle, path: *const c_char, progress: *const Watch) -> i32;
    srf_spline_params_init_sized(params: *mut SplineParams, size: usize) -> i32;
    srf_spline_create(quads: Handle, params: *const SplineParams, progress: *const Watch, out_spline: *mut Handle, out_max_residual: *mut f64, out_rms_residual: *mut f64) -> i32;
    srf_spline_free(spline: Handle) -> i32;
    srf_spline_control(spline: Handle, out_rows: *mut usize, out_cols: *mut usize, out_points: *mut Array) -> i32;
    srf_spline_point(spline: Handle, u: f64, v: f64, out_point: *mut f64) -> i32;
    srf_spline_sample(spline: Handle, rows: usize, cols: usize, out_mesh: *mut Handle) -> i32;
    srf_reconstruct_params_init_sized(params: *mut ReconstructParams, size: usize) -> i32;
    srf_reconstruct_report_init_sized(report: *mut ReconstructReport, size: usize) -> i32;
    srf_reconstructor_create(cloud: Handle, sensors: *const Array, out_reconstructor: *mut Handle) -> i32;
    srf_reconstructor_free(reconstructor: Handle) -> i32;
    srf_reconstructor_surface(reconstructor: Handle, params: *const ReconstructParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut ReconstructReport, out_dropped: *mut u8) -> i32;
    srf_cluster_params_init_sized(params: *mut ClusterParams, size: usize) -> i32;
    srf_cluster_report_init_sized(report: *mut ClusterReport, size: usize) -> i32;
    srf_mesh_cluster(mesh: Handle, params: *const ClusterParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut ClusterReport) -> i32;
    srf_cloud_cluster(cloud: Handle, params: *const ClusterParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut ClusterReport) -> i32;
    srf_mesh_cluster_levels(mesh: Handle, vertices: *const u64, count: usize, params: *const ClusterParams, progress: *const Watch, out_meshes: *mut Handle) -> i32;
    srf_cloud_cluster_levels(cloud: Handle, vertices: *const u64, count: usize, params: *const ClusterParams, progress: *const Watch, out_meshes: *mut Handle) -> i32;
    srf_close_params_init_sized(params: *mut CloseParams, size: usize) -> i32;
    srf_close_report_init_sized(report: *mut CloseReport, size: usize) -> i32;
    srf_mesh_close(mesh: Handle, merger: Handle, params: *const CloseParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut CloseReport) -> i32;
    srf_check_print_params_init_sized(params: *mut CheckPrintParams, size: usize) -> i32;
    srf_check_print_report_init_sized(report: *mut PrintReport, size: usize) -> i32;
    srf_mesh_check_print(mesh: Handle, params: *const CheckPrintParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut PrintReport) -> i32;
    srf_prepare_print_params_init_sized(params: *mut PreparePrintParams, size: usize) -> i32;
    srf_prepare_print_report_init_sized(report: *mut PrepareReport, size: usize) -> i32;
    srf_mesh_prepare_print(mesh: Handle, params: *const PreparePrintParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut PrepareReport) -> i32;
    srf_mesh_part(mesh: Handle, number: usize, out_mesh: *mut Handle) -> i32;
    srf_unwrap_params_init_sized(params: *mut UnwrapParams, size: usize) -> i32;
    srf_unwrap_report_init_sized(report: *mut UnwrapReport, size: usize) -> i32;
    srf_mesh_unwrap(mesh: Handle, params: *const UnwrapParams, progress: *const Watch, out_mesh: *mut Handle, out_report: *mut UnwrapReport) -> i32;
    srf_photo_create(rows: usize, cols: usize, projection: *const Projection, pixels: *const Array, world_from_camera: *const [f64; 16], name: *const c_char, depth_rows: usize, depth_cols: usize, depths: *const Array, out_photo: *mut Handle) -> i32;
    srf_photo_free(photo: Handle) -> i32;
    srf_texture_params_init_sized(params: *mut TextureParams, size: usize) -> i32;
    srf_textured_photo_init_sized(report: *mut TexturedPhoto, size: usize) -> i32;
    srf_texture_report_init_sized(report: *mut TextureReport, size: usize) -> i32;
    srf_mesh_texture(mesh: Handle, detail: Handle, photos: *const Handle, count: usize, params: *const TextureParams, progress: *const Watch, out_textures: *mut Handle, out_report: *mut TextureReport) -> i32;
    srf_textures_free(textures: Handle) -> i32;
    srf_textures_size(textures: Handle, out_size: *mut usize, out_tiles: *mut usize) -> i32;
    srf_textures_image(textures: Handle, tile: usize, map: u32, out_image: *mut Array) -> i32;
    srf_textures_pose(textures: Handle, index: usize, out_pose: *mut [f64; 16]) -> i32;
    srf_textures_photo(textures: Handle, index: usize, out_photo: *mut TexturedPhoto) -> i32;
    srf_textures_reason(textures: Handle, index: usize, out_reason: *mut *const c_char) -> i32;
    srf_scan_params_init_sized(params: *mut ScanParams, size: usize) -> i32;
    srf_scan_mesh(mesh: Handle, rows: usize, cols: usize, projection: *const Projection, world_from_sensor: *const [f64; 16], params: *const ScanParams, progress: *const Watch, out_image: *mut Handle) -> i32;
    srf_distance_report_init_sized(report: *mut DistanceReport, size: usize) -> i32;
    srf_mesh_distances(mesh: Handle, points: *const Array, is_signed: u32, threads: u32, progress: *const Watch, out_distances: *mut f64, out_figures: *mut DistanceReport) -> i32;
    srf_mesh_surface_distance(mesh: Handle, reference: Handle, is_signed: u32, threads: u32, progress: *const Watch, out_distances: *mut f64, out_figures: *mut DistanceReport) -> i32;
}

/// The functions of the built library, which note what they return.
pub fn api() -> &'static Api {
    library();
    &NOTED
}

/// The functions of the built library.
fn library() -> &'static Api {
    static API: OnceLock<Api> = OnceLock::new();
    API.get_or_init(|| {
        let file = folder().join(libloading::library_filename("surfrecon"));
        // SAFETY: our own library; loading it runs no code of ours. It stays loaded to the end.
        let library = unsafe { Library::new(&file) }.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        Api::load(Box::leak(Box::new(library)))
    })
}

impl Api {
    /// Text of the last error of this thread.
    pub fn message(&self) -> String {
        // SAFETY: no arguments.
        text(unsafe { (self.srf_last_error_message)() })
    }

    /// Asserts that a call went well.
    #[track_caller]
    pub fn ok(&self, status: i32) {
        assert_eq!(status, 0, "{}", self.message());
    }

    /// Asserts that a call failed with `status` and a text that contains `part`.
    #[track_caller]
    pub fn refused(&self, answer: i32, status: i32, part: &str) {
        let message = self.message();
        assert_eq!(answer, status, "{message}");
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

/// A text of the library's.
pub fn text(pointer: *const c_char) -> String {
    assert!(!pointer.is_null());
    // SAFETY: the library answers with a text that ends with a zero byte and outlives this call.
    unsafe { CStr::from_ptr(pointer) }.to_str().expect("UTF-8").to_owned()
}
