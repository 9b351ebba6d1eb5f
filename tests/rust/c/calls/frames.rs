//! Frames from arrays, and scans whose images a function makes when they are needed.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::*;

const ROWS: usize = 24;
const COLS: usize = 32;

/// Places of the fields of srf_frame, among the numbers after its first eight bytes.
mod field {
    pub const ROWS: usize = 0;
    pub const COLS: usize = 1;
    pub const ROW_STRIDE: usize = 2;
    pub const FX: usize = 3;
    pub const SCALE: usize = 7;
    pub const REACH: usize = 8;
    pub const COLOUR_ROWS: usize = 9;
    pub const COLOUR_ROW_STRIDE: usize = 11;
    pub const COLOUR_FX: usize = 12;
    pub const COLOUR_FROM_DEPTH: usize = 16;
    pub const FLAGS: usize = 32;
    pub const CONFIDENCE_ROWS: usize = 33;
    pub const LEAST: usize = 36;
}

/// A camera whose image of millimetres has so many rows and columns.
pub(super) fn form(rows: usize, cols: usize) -> Frame {
    let mut frame = Frame::ZERO;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_frame_init_sized)(&mut frame, size_of_val(&frame)) });
    (frame.numbers[field::ROWS], frame.numbers[field::COLS]) = (rows as u64, cols as u64);
    let intrinsics = [30.0, 30.0, (cols as f64 - 1.0) / 2.0, (rows as f64 - 1.0) / 2.0];
    intrinsics.iter().enumerate().for_each(|(k, number)| frame.set_f64(field::FX + k, *number));
    frame.set_f64(field::SCALE, 1e-3);
    frame
}

struct Arrays<'a> {
    depths: Array,
    colours: Option<&'a Array>,
    confidences: Option<&'a Array>,
    pose: Option<&'a [f64; 16]>,
}

impl Arrays<'_> {
    fn of(depths: Array) -> Self {
        Arrays { depths, colours: None, confidences: None, pose: None }
    }

    /// Status, image and what was left out.
    fn image(&self, frame: &Frame) -> (i32, Handle, LeftOutReport) {
        let api = api();
        let (mut image, mut left_out) = (Handle::NULL, LeftOutReport::ZERO);
        let or_null = |array: Option<&Array>| array.map_or(std::ptr::null(), std::ptr::from_ref);
        // SAFETY: as the header wants it, or wrong in the ways it names.
        unsafe {
            api.ok((api.srf_left_out_report_init_sized)(&mut left_out, size_of_val(&left_out)));
            let status = (api.srf_image_from_frame)(
                frame,
                &self.depths,
                or_null(self.colours),
                or_null(self.confidences),
                self.pose.map_or(std::ptr::null(), std::ptr::from_ref),
                c"frame".as_ptr(),
                std::ptr::null(),
                &mut image,
                &mut left_out,
            );
            assert_eq!(status == OK, image != Handle::NULL, "written in spite of the error");
            (status, image, left_out)
        }
    }

    #[track_caller]
    fn refused(&self, frame: &Frame, status: i32, part: &str) {
        api().refused(self.image(frame).0, status, part);
    }
}

/// Samples and colours of an image, which is freed.
fn content(image: Handle) -> (Vec<f64>, Vec<[u8; 4]>) {
    let api = api();
    let (mut samples, mut colours) = (Array::EMPTY, Array::EMPTY);
    // SAFETY: as the header wants it.
    unsafe {
        let none = std::ptr::null_mut;
        api.ok((api.srf_image_samples)(image, &mut samples));
        api.ok((api.srf_image_attributes)(image, &mut colours, none(), none()));
        let samples = samples.bytes().as_chunks::<8>().0.iter().map(|b| f64::from_ne_bytes(*b)).collect();
        let colours = colours.bytes().as_chunks::<4>().0.to_vec();
        api.ok((api.srf_image_free)(image));
        (samples, colours)
    }
}

#[test]
pub(super) fn frames_from_arrays() {
    let mut frame = form(ROWS, COLS);
    // A wall two metres away, with all that marks that nothing was measured.
    let mut whole = vec![2000_u16; ROWS * COLS];
    (whole[0], whole[1], whole[40], whole[700]) = (0, u16::MAX, 5000, 1);
    let floats: Vec<f32> = (0..ROWS * COLS)
        .map(|i| match i {
            0 => -1.0,
            1 => f32::NAN,
            2 => f32::INFINITY,
            _ => f32::from(whole[i]),
        })
        .collect();
    let (status, image, left_out) = Arrays::of(Array::of(&whole, U16, 1)).image(&frame);
    api().ok(status);
    assert_eq!(left_out.numbers, [(ROWS * COLS - 2) as u64, 0, 0, 0, 0]);
    let (samples, colours) = content(image);
    assert!(samples[0].is_nan() && samples[1].is_nan() && colours.is_empty());
    assert_eq!((samples[2], samples[40], samples[700]), (2.0, 5.0, 0.001));
    let (status, image, _) = Arrays::of(Array::of(&floats, F32, 1)).image(&frame);
    api().ok(status);
    let of_floats = content(image).0;
    assert!(of_floats[..3].iter().all(|x| x.is_nan()));
    assert_eq!(of_floats[3..], samples[3..]);

    // Every second number of rows with a gap behind them.
    let padded: Vec<u16> = whole
        .chunks(COLS)
        .flat_map(|row| row.iter().flat_map(|&depth| [depth, 7]).chain([9; 5]))
        .take(ROWS * (2 * COLS + 5) - 6)
        .collect();
    frame.numbers[field::ROW_STRIDE] = 2 * (2 * COLS as u64 + 5);
    let padded = Array { data: padded.as_ptr().cast(), count: ROWS * COLS, stride: 4, kind: U16, components: 1 };
    let (status, image, _) = Arrays::of(padded).image(&frame);
    api().ok(status);
    let found = content(image).0;
    assert!(found.iter().zip(&samples).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));

    // Twice as many pixels of colour, which say where they are; a confidence for four pixels of depth.
    frame.numbers[field::COLOUR_ROWS] = 2 * ROWS as u64;
    frame.numbers[field::COLOUR_ROWS + 1] = 2 * COLS as u64;
    frame.numbers[field::CONFIDENCE_ROWS] = ROWS as u64 / 2;
    frame.numbers[field::CONFIDENCE_ROWS + 1] = COLS as u64 / 2;
    frame.numbers[field::LEAST] = 2;
    frame.set_f64(field::REACH, 4.0);
    frame.numbers[field::COLOUR_ROW_STRIDE] = 3 * 2 * COLS as u64 + 11;
    let rgb: Vec<u8> = (0..2 * ROWS)
        .flat_map(|row| (0..2 * COLS).flat_map(move |col| [(col / 2) as u8, (row / 2) as u8, 7]).chain([255; 11]))
        .collect();
    let rgb = Array { data: rgb.as_ptr().cast(), count: 4 * ROWS * COLS, stride: 0, kind: U8, components: 3 };
    let levels: Vec<u8> = (0..ROWS * COLS / 4).map(|i| if i % (COLS / 2) < 3 { 1 } else { 2 }).collect();
    let levels = Array::of(&levels, U8, 1);
    let arrays = Arrays { colours: Some(&rgb), confidences: Some(&levels), ..Arrays::of(padded) };
    let (status, image, left_out) = arrays.image(&frame);
    api().ok(status);
    assert_eq!(left_out.numbers, [766, 6 * 24 - 2, 1, 0, 0]);
    let (samples, colours) = content(image);
    for i in 0..ROWS * COLS {
        let (row, col) = (i / COLS, i % COLS);
        assert_eq!(samples[i].is_nan(), col < 6 || i == 40, "{i}");
        // A sample that lies so near is hidden by none.
        if !samples[i].is_nan() && i != 700 {
            assert_eq!(colours[i][..3], [col as u8, row as u8, 7]);
        }
    }
    // The same as four numbers a colour, and as half of the rows seen by a camera of its own.
    let rgba: Vec<[u8; 4]> =
        (0..4 * ROWS * COLS).map(|i| [(i % (2 * COLS) / 2) as u8, (i / (4 * COLS)) as u8, 7, 3]).collect();
    let rgba = Array::of(&rgba, U8, 4);
    frame.numbers[field::COLOUR_ROW_STRIDE] = 0;
    [60.0, 60.0, COLS as f64 - 0.5, ROWS as f64 - 0.5]
        .iter()
        .enumerate()
        .for_each(|(k, number)| frame.set_f64(field::COLOUR_FX + k, *number));
    let (status, image, _) = Arrays { colours: Some(&rgba), ..arrays }.image(&frame);
    api().ok(status);
    assert_eq!(content(image).1, colours);
}

/// Theorem: a pose of a camera that looks along -z with y up places the same points as that of the same camera looking along z.
#[test]
pub(super) fn both_axes_of_cameras() {
    let api = api();
    let whole = vec![2000_u16; ROWS * COLS];
    let backward = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
    let mut forward = backward;
    (forward[5], forward[10]) = (-1.0, -1.0);
    let mut frame = form(ROWS, COLS);
    let arrays = Arrays::of(Array::of(&whole, U16, 1));
    let points = |frame: &Frame, pose: &[f64; 16]| {
        let (status, image, _) = Arrays { pose: Some(pose), ..arrays }.image(frame);
        api.ok(status);
        let mut points = vec![0.0; 3 * ROWS * COLS];
        // SAFETY: as the header wants it.
        unsafe {
            api.ok((api.srf_image_world_points)(image, points.as_mut_ptr(), points.len(), std::ptr::null()));
            api.ok((api.srf_image_free)(image));
        }
        points
    };
    let expected = points(&frame, &forward);
    assert_eq!(expected[2], 5.0);
    frame.numbers[field::FLAGS] = 1 << 32;
    assert_eq!(points(&frame, &backward), expected);
}

#[test]
pub(super) fn frames_that_can_not_be_are_refused() {
    let whole = vec![2000_u16; ROWS * COLS];
    let depths = Array::of(&whole, U16, 1);
    let arrays = || Arrays::of(depths);
    let with = |index: usize, number: u64| {
        let mut frame = form(ROWS, COLS);
        frame.numbers[index] = number;
        frame
    };
    let (nan, infinite) = (f64::NAN.to_bits(), f64::INFINITY.to_bits());
    arrays().refused(&Frame::ZERO, STRUCT_SIZE, "frame.struct_size is 0");
    arrays().refused(&Frame { second: 4, ..form(ROWS, COLS) }, PARAMETER, "SRF_PROJECTION_PINHOLE_RANGE (3), got 4");
    for scale in [0, nan, infinite, (-1.0_f64).to_bits()] {
        arrays().refused(&with(field::SCALE, scale), PARAMETER, "frame.scale must be a finite number > 0, got");
    }
    arrays().refused(
        &with(field::SCALE, 1e308_f64.to_bits()),
        INPUT,
        "depths: 2e3 times frame.scale, 1e308, is more than",
    );
    arrays().refused(&with(field::REACH, nan), PARAMETER, "frame.reach must be >= 0, 0 for none, got NaN");
    arrays().refused(&with(field::LEAST, 256), PARAMETER, "frame.least_confidence must be 0 to 255, got 256");
    arrays().refused(&with(field::FLAGS, 2), PARAMETER, "frame.has_black_rim must be 0 or 1, got 2");
    arrays().refused(&with(field::FLAGS, 2 << 32), PARAMETER, "frame.looks_along_minus_z must be 0 or 1, got 2");
    arrays().refused(&with(field::ROWS, 0), PARAMETER, "the depth image has 0 rows and 32 columns");
    arrays().refused(&with(field::COLOUR_ROWS, 4), PARAMETER, "the colour image has 4 rows and 0 columns");
    arrays().refused(&with(field::CONFIDENCE_ROWS, 4), PARAMETER, "the confidence image has 4 rows and 0 columns");
    arrays().refused(&with(field::ROWS, 25), INPUT, "depths: an image of 32 x 25 pixels has not 768 elements");
    arrays().refused(&with(field::ROWS, u64::MAX), INPUT, "has not 768 elements");
    arrays().refused(
        &with(field::ROW_STRIDE, 63),
        PARAMETER,
        "a row stride must be 0 or at least the 64 bytes of a row, got 63",
    );
    arrays().refused(&with(field::ROW_STRIDE, u64::MAX), PARAMETER, "768 elements are more than there can be");
    arrays().refused(&with(field::FX, 0), PARAMETER, "frame.intrinsics: ");
    arrays().refused(&with(field::FX + 2, nan), PARAMETER, "frame.intrinsics: the camera's centre cx");
    arrays().refused(&with(field::COLOUR_FROM_DEPTH, nan), INPUT, "frame.colour_from_depth must have finite numbers");
    arrays().refused(&with(field::COLOUR_FROM_DEPTH, 2_f64.to_bits()), INPUT, "frame.colour_from_depth must be rigid");
    let signed = Array { kind: I32, ..depths };
    Arrays::of(signed).refused(
        &form(ROWS, COLS),
        PARAMETER,
        "type must be SRF_TYPE_U16, SRF_TYPE_F32 or SRF_TYPE_F64, got SRF_TYPE_I32",
    );
    let null = Array { data: std::ptr::null(), ..depths };
    Arrays::of(null).refused(&form(ROWS, COLS), NULL, "depths.data must not be NULL");
    let grey = Array { kind: U8, ..depths };
    let painted = |colours| Arrays { colours: Some(colours), ..arrays() };
    painted(&grey).refused(&form(ROWS, COLS), PARAMETER, "colours: components must be 3 or 4, got 1");
    let bytes = vec![0_u8; 3 * ROWS * COLS];
    let rgb = Array::of(&bytes, U8, 3);
    painted(&rgb).refused(&with(field::COLOUR_FX, 5_f64.to_bits()), PARAMETER, "frame.colour_intrinsics: ");
    let fewer = Array { count: 700, ..rgb };
    painted(&fewer).refused(&form(ROWS, COLS), INPUT, "colours: an image of 32 x 24 pixels has not 700 elements");
    let wide = Array { kind: U16, ..rgb };
    painted(&wide).refused(&form(ROWS, COLS), PARAMETER, "colours: type must be SRF_TYPE_U8, got SRF_TYPE_U16");
    let trusted = Arrays { confidences: Some(&depths), ..arrays() };
    trusted.refused(&form(ROWS, COLS), PARAMETER, "confidences: type must be SRF_TYPE_U8, got SRF_TYPE_U16");
    let mut mirror = [0.0; 16];
    (mirror[0], mirror[5], mirror[10], mirror[15]) = (-1.0, 1.0, 1.0, 1.0);
    let mirrored = Arrays { pose: Some(&mirror), ..arrays() };
    mirrored.refused(&form(ROWS, COLS), INPUT, "world_from_sensor must be rigid");
}

/// State of a source that is asked for the image of a scan.
struct Maker {
    /// Distance of a wavy wall, by which the scans differ.
    away: f64,
    calls: AtomicUsize,
    /// The call from which on it does as `how` says.
    from: usize,
    how: How,
}

#[derive(Clone, Copy)]
enum How {
    Fails(i32, Option<&'static CStr>),
    GivesNothing,
    GivesAMesh,
    /// Passes on what a call of the library did not do.
    PassesOn,
}

impl Maker {
    fn new(away: f64, from: usize, how: How) -> Self {
        Maker { away, calls: AtomicUsize::new(0), from, how }
    }

    fn image(&self) -> Handle {
        let values: Vec<f32> = (0..ROWS * COLS)
            .map(|i| (self.away + 0.05 * ((i % COLS) as f64 * 0.4).sin() * ((i / COLS) as f64 * 0.3).cos()) as f32)
            .collect();
        let mut frame = form(ROWS, COLS);
        frame.set_f64(field::SCALE, 1.0);
        let (status, image, _) = Arrays::of(Array::of(&values, F32, 1)).image(&frame);
        api().ok(status);
        image
    }

    fn source(&self) -> ImageSource {
        ImageSource { make: Some(make), user: std::ptr::from_ref(self).cast_mut().cast() }
    }
}

unsafe extern "C" fn make(user: *mut c_void, out: *mut Handle) -> i32 {
    let api = api();
    // SAFETY: the maker handed in, which all share; room for a handle.
    let (maker, out) = unsafe { (&*user.cast::<Maker>(), &mut *out) };
    assert!(*out == Handle::NULL);
    if maker.calls.fetch_add(1, Relaxed) < maker.from {
        *out = maker.image();
        return OK;
    }
    match maker.how {
        How::Fails(status, text) => {
            // SAFETY: as the header wants it.
            text.into_iter().for_each(|text| api.ok(unsafe { (api.srf_set_last_error)(text.as_ptr()) }));
            if status == IO {
                // Freed nevertheless, says the address sanitizer.
                *out = maker.image();
            }
            return status;
        }
        How::GivesNothing => {}
        How::GivesAMesh => *out = octahedron(),
        How::PassesOn => {
            let whole = [0_u16; 3];
            return Arrays::of(Array::of(&whole, U16, 1)).image(&form(1, 2)).0;
        }
    }
    OK
}

const MOVED: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.3, 0.1, 0.0, 1.0];

/// A merge of two makers, one of them moved.
fn merger(makers: &[Maker; 2]) -> Handle {
    let api = api();
    let mut merger = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_create)(&mut merger));
        api.ok((api.srf_merger_add_source)(merger, &makers[0].source(), std::ptr::null(), c"still".as_ptr()));
        api.ok((api.srf_merger_add_source)(merger, &makers[1].source(), &MOVED, c"moved".as_ptr()));
    }
    merger
}

const NEVER: usize = usize::MAX;

/// Theorem: scans that a function makes merge as the same images do that are there, as often as it is run, for any number of threads.
#[test]
pub(super) fn images_made_when_they_are_needed_merge_as_those_that_are_there() {
    let api = api();
    let makers = [2.0, 2.1].map(|away| Maker::new(away, NEVER, How::GivesNothing));
    let (made, mut there) = (merger(&makers), Handle::NULL);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        assert_eq!(makers[0].calls.load(Relaxed), 0, "made before it was needed");
        api.ok((api.srf_merger_create)(&mut there));
        for (maker, (name, pose)) in makers.iter().zip([(c"still", None), (c"moved", Some(&MOVED))]) {
            let image = maker.image();
            api.ok((api.srf_image_set_pose)(image, pose.map_or(std::ptr::null(), std::ptr::from_ref)));
            api.ok((api.srf_image_set_name)(image, name.as_ptr()));
            api.ok((api.srf_merger_add_image)(there, image));
            api.ok((api.srf_image_free)(image));
        }
        let expected = merged(there, &params(0.08));
        assert!(expected.len() > 10_000, "{}", expected.len());
        for threads in [1, 2, 5] {
            let mut params = params(0.08);
            params.second = threads;
            let before = makers[0].calls.load(Relaxed);
            assert!(merged(made, &params) == expected, "{threads} threads");
            assert!((1..5).contains(&(makers[0].calls.load(Relaxed) - before)), "made as often as a merge looks");
        }
        for end in [(api.srf_merger_free)(made), (api.srf_merger_free)(there)] {
            api.ok(end);
        }
        let (none, here) = (std::ptr::null(), std::ptr::null());
        let nothing = ImageSource { make: None, user: std::ptr::null_mut() };
        let (source, name) = (makers[0].source(), c"a".as_ptr());
        api.ok((api.srf_merger_create)(&mut there));
        let add = api.srf_merger_add_source;
        api.refused(add(there, none, here, name), NULL, "source must not be NULL");
        api.refused(add(there, &nothing, here, name), NULL, "source.make must not be NULL");
        api.refused(add(there, &source, here, std::ptr::null()), NULL, "name must not be NULL");
        api.refused(add(there, &source, &[f64::NAN; 16], name), INPUT, "world_from_sensor must have finite numbers");
        api.refused(
            add(Handle(std::ptr::without_provenance_mut(8)), &source, here, name),
            HANDLE,
            "merger is not a handle",
        );
        api.ok((api.srf_merger_free)(there));
    }
}

/// Theorem: whatever a source does not do, at whichever of its calls, ends the run with a text that has the scan's name and the reason.
#[test]
pub(super) fn what_a_source_does_not_do_ends_the_run_with_its_reason() {
    let api = api();
    let whys = [
        (
            How::Fails(INPUT, Some(c"the camera is gone")),
            INPUT,
            "moved: the source could not make its image: the camera is gone",
        ),
        (How::Fails(IO, None), INPUT, "moved: the source could not make its image: reading or writing failed"),
        (How::Fails(-77, None), INPUT, "moved: the source could not make its image: unknown status"),
        (How::Fails(5, Some(c"the disk is full")), 5, "moved: the source could not make its image: the disk is full"),
        (How::Fails(CANCELLED, None), CANCELLED, "cancelled"),
        (How::GivesNothing, INPUT, "moved: the source made no image and gave no reason"),
        (How::GivesAMesh, INPUT, "moved: out_image of the source must be a srf_image, got a srf_mesh"),
        (
            How::PassesOn,
            INPUT,
            "moved: the source could not make its image: depths: an image of 2 x 1 pixels has not 3",
        ),
    ];
    for (how, status, part) in whys {
        for from in 0.. {
            let makers = [Maker::new(2.0, NEVER, how), Maker::new(2.1, from, how)];
            let (merger, mut mesh) = (merger(&makers), Handle::NULL);
            // SAFETY: as the header wants it.
            let answer = unsafe {
                let null = std::ptr::null();
                // Left by another call of this thread: no reason of the source's.
                api.ok((api.srf_set_last_error)(c"an older text".as_ptr()));
                let answer = (api.srf_merger_run)(merger, &params(0.08), null, &mut mesh, std::ptr::null_mut());
                api.ok((api.srf_merger_free)(merger));
                answer
            };
            let calls = makers[1].calls.load(Relaxed);
            if calls <= from {
                api.ok(answer);
                assert!(from > 0, "it is made for a run");
                // SAFETY: as the header wants it.
                api.ok(unsafe { (api.srf_mesh_free)(mesh) });
                assert_eq!(api.message(), "an older text", "a run that went well leaves the text");
                break;
            }
            api.refused(answer, status, part);
            assert_eq!(mesh, Handle::NULL, "written in spite of the error");
        }
    }
}

#[test]
pub(super) fn sources_are_aligned_and_cancelled() {
    let api = api();
    let makers = [2.0, 2.1].map(|away| Maker::new(away, NEVER, How::GivesNothing));
    let (mut aligner, mut alignment, merger) = (Handle::NULL, Handle::NULL, merger(&makers));
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
    // SAFETY: as the header wants it.
    unsafe {
        let (none, mut mesh) = (std::ptr::null_mut(), Handle::NULL);
        let answer = (api.srf_merger_run)(merger, &params(0.08), &watch, &mut mesh, none);
        api.refused(answer, CANCELLED, "cancelled");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_aligner_create)(&mut aligner));
        let null = std::ptr::null();
        api.ok((api.srf_aligner_add_source)(aligner, &makers[0].source(), null, c"a".as_ptr()));
        api.ok((api.srf_aligner_add_source)(aligner, &makers[0].source(), &MOVED, c"b".as_ptr()));
        api.ok((api.srf_aligner_fix)(aligner, 1));
        let mut params = AlignParams::ZERO;
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_aligner_run)(aligner, &params, std::ptr::null(), &mut alignment));
        let mut scan = AlignedScan::ZERO;
        api.ok((api.srf_aligned_scan_init_sized)(&mut scan, size_of_val(&scan)));
        api.ok((api.srf_alignment_scan)(alignment, 1, &mut scan));
        // The fixed one stays where it was said to be.
        assert_eq!(
            (scan.f64(aligned_scan::WORLD_FROM_SCAN + 12), scan.f64(aligned_scan::WORLD_FROM_SCAN + 13)),
            (MOVED[12], MOVED[13])
        );
        api.ok((api.srf_alignment_free)(alignment));
        let broken = Maker::new(2.0, 0, How::Fails(INPUT, Some(c"gone")));
        api.ok((api.srf_aligner_add_source)(aligner, &broken.source(), null, c"c".as_ptr()));
        let answer = (api.srf_aligner_run)(aligner, &params, std::ptr::null(), &mut alignment);
        api.refused(answer, INPUT, "c: the source could not make its image: gone");
        api.ok((api.srf_aligner_free)(aligner));
        api.refused((api.srf_set_last_error)(c"\xff".as_ptr()), INPUT, "text is not UTF-8");
    }
}
