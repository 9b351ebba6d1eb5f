//! Cancelling, and eight threads at once.

use super::aligning::*;
use super::bounds::*;
use super::cancelling::*;
use super::contexts::*;
use super::files::*;
use super::frames::*;
use super::merging::*;
use super::objects::*;
use super::operations::*;
use super::refusals::*;
use super::rightly::*;
use super::vertices::*;
use super::*;

#[test]
fn cancelling_leaves_nothing_and_the_next_call_is_fine() {
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
    let (mut surface, mut report) = (Handle::NULL, MergeReport::ZERO);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merge_report_init_sized)(&mut report, size_of_val(&report)));
        let before = report;
        let long = params(0.002);
        api.refused((api.srf_merger_run)(merger, &long, &watch, &mut surface, &mut report), CANCELLED, "cancelled");
        assert!(asked >= 1 && surface == Handle::NULL && report == before);
        api.ok((api.srf_merger_run)(merger, &params(0.1), std::ptr::null(), &mut surface, &mut report));
        assert_eq!((report.size as usize, report.numbers[merge_report::SCANS]), (size_of::<MergeReport>(), 1));
        assert_eq!(report.f64(merge_report::VOXEL), 0.1);
        let points = [[0.0, 0.0, 4.0_f64], [3.0, 0.0, 4.0]];
        let (mut off, mut figures) = ([0.0; 2], DistanceReport::ZERO);
        api.ok((api.srf_distance_report_init_sized)(&mut figures, size_of_val(&figures)));
        let points = Array::of(&points, F64, 3);
        let none = std::ptr::null();
        api.ok((api.srf_mesh_distances)(surface, &points, 1, 0, none, off.as_mut_ptr(), &mut figures));
        assert!(off[0] < -0.5 && (off[1] - 2.0).abs() < 0.05 && figures.numbers[0] == 2, "{off:?}");
        let measure = api.srf_mesh_surface_distance;
        assert!(figures.f64(distance_report::BOUND) < 0.0, "points have none");
        let null = std::ptr::null_mut();
        api.ok(measure(surface, mesh, 0, 0, none, null, &mut figures));
        let [largest, reached, bound] =
            [distance_report::MAX, distance_report::REACHED, distance_report::BOUND].map(|place| figures.f64(place));
        assert!(largest > 0.0 && largest <= reached && reached <= bound, "{largest} {reached} {bound}");
        assert!(bound <= 1.02 * reached + 1e-4, "{reached} {bound}");
        let answer = measure(surface, mesh, 7, 0, none, null, &mut figures);
        api.refused(answer, PARAMETER, "is_signed must be 0 or 1, got 7");
        let answer = (api.srf_mesh_distances)(surface, &points, 2, 0, none, off.as_mut_ptr(), &mut figures);
        api.refused(answer, PARAMETER, "is_signed must be 0 or 1, got 2");
        for end in [(api.srf_mesh_free)(surface), (api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

mod thorough {
    use super::*;

    #[test]
    fn every_call_from_eight_threads_at_once() {
        let all: [fn(); 43] = [
            more_scans_than_memory_holds_are_merged_in_files,
            more_scans_than_memory_holds_go_into_a_file,
            zeros_are_refused_with_a_text_wherever_they_can_do_harm,
            handles_that_never_were_are_refused,
            handles_of_another_kind_and_freed_ones_are_refused,
            every_function_with_wrong_handles_and_sizes,
            a_mesh_and_its_attributes,
            arrays_that_lie_are_refused,
            strides_and_unaligned_data_are_fine,
            an_image_and_its_cloud,
            what_there_is_is_counted_and_has_bounds,
            far_positions_keep_their_digits_in_single_precision,
            vertices_of_an_image_and_back,
            what_is_no_range_image_is_refused,
            a_cloud_from_arrays,
            images_from_arrays,
            an_image_is_sculpted_to_one_tolerance_after_the_other,
            a_surface_through_scattered_points,
            an_image_becomes_a_quad_grid_and_a_surface,
            a_mesh_is_clustered_and_so_is_a_chain,
            a_mesh_gets_the_texture_coordinates_of_the_core,
            a_mesh_gets_the_images_of_the_core,
            what_is_said_of_scans_that_are_not_there_is_refused,
            poses_to_draw_a_scan_from_are_refused_where_they_can_not_be,
            what_is_not_placed_has_a_reason_and_a_cancelled_alignment_leaves_nothing,
            cancelling_leaves_nothing_and_the_next_call_is_fine,
            a_call_is_cancelled_by_another_thread_and_not_by_what_was_reset,
            one_that_was_freed_cancels_nothing_and_no_other,
            a_context_has_settings_of_its_own,
            a_limit_concerns_the_calls_of_its_context_alone,
            what_a_merge_keeps_is_on_the_account_of_its_last_run,
            a_context_is_freed_while_a_call_is_under_it,
            files_go_out_and_come_back,
            options_say_what_files_do_not,
            everything_is_written_and_comes_back,
            frames_from_arrays,
            both_axes_of_cameras,
            frames_that_can_not_be_are_refused,
            images_made_when_they_are_needed_merge_as_those_that_are_there,
            what_a_source_does_not_do_ends_the_run_with_its_reason,
            sources_are_aligned_and_cancelled,
            scans_are_replaced_and_removed_and_the_rest_is_kept,
            scans_that_are_not_there_are_not_replaced,
        ];
        std::thread::scope(|scope| {
            for first in 0..8 {
                scope.spawn(move || (0..all.len()).for_each(|i| all[(first + i) % all.len()]()));
            }
        });
    }
}

#[test]
fn eight_threads_at_once_draw_a_scan_of_one_aligner() {
    let api = api();
    let mesh = octahedron();
    let image = scan(mesh);
    let mut aligner = Handle::NULL;
    // SAFETY: as the header wants it.
    let found: Vec<(Snap, [u8; 8])> = unsafe {
        api.ok((api.srf_aligner_create)(&mut aligner));
        api.ok((api.srf_aligner_add_mesh)(aligner, mesh, std::ptr::null(), c"octahedron".as_ptr()));
        api.ok((api.srf_aligner_add_image)(aligner, image));
        let work = || {
            let mut snap = Snap::ZERO;
            api.ok((api.srf_snap_report_init_sized)(&mut snap, size_of_val(&snap)));
            let (none, out, mut distance) = (std::ptr::null(), std::ptr::null_mut(), 9.0);
            let null = std::ptr::null();
            let (points, poses) = ([[0.0, 0.0, 3.0_f64]], std::ptr::null());
            let points = Array::of(&points, F64, 3);
            for scan in 0..8 {
                // Calls on it meanwhile keep nobody from going on.
                api.ok((api.srf_aligner_fix)(aligner, scan % 2));
                api.ok((api.srf_aligner_snap)(aligner, 1, poses, 0, null, none, &mut snap, out));
                api.ok((api.srf_aligner_misfit)(aligner, 1, poses, 0, &points, none, &mut distance));
            }
            (snap, distance.to_ne_bytes())
        };
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(work)).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        })
    };
    assert!(found.iter().all(|each| *each == found[0]));
    // SAFETY: as the header wants it.
    unsafe {
        for end in [(api.srf_aligner_free)(aligner), (api.srf_image_free)(image), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

#[test]
fn eight_threads_at_once_get_the_same() {
    let shared = octahedron();
    let results: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let work = || {
            (0..5)
                .map(|_| {
                    let own = octahedron();
                    let image = scan(shared);
                    let merger = merger_of(own);
                    // SAFETY: as the header wants it.
                    unsafe {
                        api().ok((api().srf_merger_add_image)(merger, image));
                        api().ok((api().srf_mesh_free)(own));
                        api().ok((api().srf_image_free)(image));
                        let bytes = merged(merger, &params(0.05));
                        api().ok((api().srf_merger_free)(merger));
                        bytes
                    }
                })
                .next_back()
                .unwrap()
        };
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(results.iter().all(|bytes| *bytes == results[0]));
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_mesh_free)(shared) });
}
