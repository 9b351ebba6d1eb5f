//! Chapters of the C header: what their functions are for, with an example each, and the index of them.

use crate::root;

/// Functions that belong together.
pub struct Chapter {
    pub title: &'static str,
    /// The files of the C library that it is made of, in the order they have in the header.
    pub files: &'static [&'static str],
    /// The gain for its reader.
    text: &'static str,
    /// A function of C that uses it, which a test compiles.
    example: &'static str,
}

/// The chapters in the order they have in the header.
pub const CHAPTERS: &[Chapter] = &[
    Chapter {
        title: "The library: errors, threads, memory, progress",
        files: &["version", "status", "last_error", "settings", "context", "allocator", "cancel", "progress"],
        text: "A call that failed says why. Threads, memory and the log are set for the process, or for a context.",
        example: r#"
/* Ends a program whose call failed. */
static void must(srf_status status)
{
    if (status == SRF_OK) return;
    fprintf(stderr, "%s\n", srf_last_error_message());
    exit(1);
}"#,
    },
    Chapter {
        title: "Range images",
        files: &["array", "pose", "params/triangulate", "projection", "image", "frame", "image_source"],
        text: "A range image is made of samples, of how its pixels see and of where its sensor stood.",
        example: r#"
/* Makes a range image of depths in metres, row after row. */
static srf_status from_depths(const double *depths, size_t rows, size_t cols, srf_image **out_image)
{
    const srf_array samples = {depths, rows * cols, 0, SRF_TYPE_F64, 1};
    srf_projection camera;
    const srf_status status = srf_projection_pinhole(525, 525, 319.5, 239.5, 0, &camera);
    if (status != SRF_OK) return status;
    return srf_image_create(rows, cols, &camera, &samples, NULL, "first", out_image);
}"#,
    },
    Chapter {
        title: "Point clouds and meshes",
        files: &["cloud", "reports/check", "mesh", "bounds", "vertices"],
        text: "Both hand out views that copy nothing, and are made of arrays of any stride.",
        example: r#"
/* Prints the vertices of a mesh. */
static srf_status print_vertices(const srf_mesh *mesh)
{
    srf_array view;
    size_t i;
    const srf_status status = srf_mesh_positions(mesh, &view);
    if (status != SRF_OK) return status;
    for (i = 0; i < view.count; ++i) {
        const double *at = (const double *)view.data + 3 * i;
        printf("%g %g %g\n", at[0], at[1], at[2]);
    }
    return SRF_OK;
}"#,
    },
    Chapter {
        title: "Reading files",
        files: &["formats", "folder", "params/open", "files"],
        text: "Files are opened as a set of scans. Their samples stay on the disk until a scan is read, merged or aligned.",
        example: r#"
/* Opens a list of scans, a recording's folder or a single scan, and prints what is in it. */
static srf_status list_scans(const char *path, srf_scans **out_scans)
{
    size_t i, count = 0;
    srf_status status = srf_scans_open(&path, 1, NULL, NULL, out_scans);
    if (status == SRF_OK) status = srf_scans_count(*out_scans, &count, NULL);
    for (i = 0; status == SRF_OK && i < count; ++i) {
        const char *name;
        status = srf_scans_describe(*out_scans, i, &name, NULL);
        if (status == SRF_OK) puts(name);
    }
    return status;
}"#,
    },
    Chapter {
        title: "Writing files",
        files: &["params/write", "write", "crs", "provenance"],
        text: "Take srf_mesh_write() for a mesh: the ending of the name chooses the format. srf_mesh_write_from() does the same, and \
               the file says where it is from. srf_mesh_write_ply() and those for GLB, OBJ and STL write one format whatever the name is. \
               srf_merger_write() merges into a file what memory does not hold.",
        example: r#"
/* Writes a mesh of millimetres whose z points up, for viewers of glTF. */
static srf_status write_for_viewers(const srf_mesh *mesh, const char *path)
{
    srf_write_options options;
    srf_write_options_init(&options);
    options.metres_per_unit = 0.001;
    options.up = SRF_UP_Z;
    return srf_mesh_write(mesh, path, &options, NULL);
}"#,
    },
    Chapter {
        title: "Aligning",
        files: &["params/align", "align", "alignment", "snap"],
        text: "Scans without poses come into one frame. srf_scans_set_pose() places the scans of a set by it, which then merge from \
               the disk.",
        example: r#"
/* Aligns the scans of a set and adds those that found a place to a merge, without keeping one of them in memory. */
static srf_status align_and_add(srf_scans *scans, size_t count, srf_merger *merger)
{
    srf_aligner *aligner = NULL;
    srf_alignment *alignment = NULL;
    size_t i;
    srf_status status = srf_aligner_create(&aligner);
    if (status == SRF_OK) status = srf_aligner_add_scans(aligner, scans);
    if (status == SRF_OK) status = srf_aligner_run(aligner, NULL, NULL, &alignment);
    for (i = 0; status == SRF_OK && i < count; ++i) {
        srf_aligned_scan found;
        srf_aligned_scan_init(&found);
        status = srf_alignment_scan(alignment, i, &found);
        if (found.state != SRF_SCAN_STATE_PLACED && found.state != SRF_SCAN_STATE_KEPT) continue;
        if (status == SRF_OK) status = srf_scans_set_pose(scans, i, &found.world_from_scan);
        if (status == SRF_OK) status = srf_merger_add_scan(merger, scans, i);
    }
    srf_alignment_free(alignment);
    srf_aligner_free(aligner);
    return status;
}"#,
    },
    Chapter {
        title: "What to keep, true size and ground",
        files: &["params/plane", "region", "select"],
        text: "Boxes, planes and masks keep or remove samples. Two picked points give the true size, a plane the ground.",
        example: r#"
/* Removes from all scans of a set what lies outside of a box of 2 x 2 x 2 about the origin, whenever they are read. */
static srf_status crop(srf_scans *scans)
{
    const srf_pose cube = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    srf_region *region;
    srf_status status = srf_region_box(&cube, &region);
    if (status != SRF_OK) return status;
    status = srf_scans_select(scans, SIZE_MAX, region, 1);
    srf_region_free(region);
    return status;
}"#,
    },
    Chapter {
        title: "Merging",
        files: &["params/merge", "reports/merge", "merger", "merge"],
        text: "Registered scans become one surface. A merger takes scans of all kinds and is run as often as wanted.",
        example: r#"
/* Merges all scans of a set with cells of 2 units. */
static srf_status merge(const srf_scans *scans, srf_mesh **out_mesh)
{
    srf_merge_params params;
    srf_merger *merger;
    srf_status status = srf_merger_create(&merger);
    if (status != SRF_OK) return status;
    srf_merge_params_init(&params);
    params.voxel = 2;
    status = srf_merger_add_scans(merger, scans);
    if (status == SRF_OK) status = srf_merger_run(merger, &params, NULL, out_mesh, NULL);
    srf_merger_free(merger);
    return status;
}"#,
    },
    Chapter {
        title: "Sculpting one scan",
        files: &["params/sculpt", "reports/sculpt", "sculpt"],
        text: "One range image becomes few triangles within a tolerance, with a certificate of how far they lie from the samples.",
        example: r#"
/* The coarsest mesh within a tolerance; prints how far STL and GLB lie from the samples. */
static srf_status sculpt(const srf_image *image, double tolerance, srf_mesh **out_mesh)
{
    srf_sculpt_report certificate;
    srf_sculptor *sculptor;
    srf_status status = srf_sculptor_create(image, NULL, NULL, &sculptor);
    if (status != SRF_OK) return status;
    srf_sculpt_report_init(&certificate);
    status = srf_sculptor_refine(sculptor, tolerance, NULL, out_mesh, &certificate);
    if (status == SRF_OK) printf("%g\n", certificate.max_error_single);
    srf_sculptor_free(sculptor);
    return status;
}"#,
    },
    Chapter {
        title: "Quad grids and splines",
        files: &["params/quads", "reports/quads", "quads", "params/spline", "spline"],
        text: "One range image becomes a regular grid of quads, dense where the surface bends, and a smooth surface through it.",
        example: r#"
/* Writes an image as quads. */
static srf_status write_quads(const srf_image *image, const char *path)
{
    srf_quads *quads;
    srf_status status = srf_quads_create(image, NULL, NULL, &quads, NULL);
    if (status != SRF_OK) return status;
    status = srf_quads_write_obj(quads, path, NULL);
    srf_quads_free(quads);
    return status;
}"#,
    },
    Chapter {
        title: "Surfaces through points",
        files: &["params/reconstruct", "reports/reconstruct", "reconstruct"],
        text: "Scattered points become a surface, closed or open. Their noise is measured and smoothed out.",
        example: r#"
/* The surface through points in double precision. */
static srf_status through(const double *points, size_t count, srf_mesh **out_mesh)
{
    const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
    srf_reconstructor *reconstructor = NULL;
    srf_cloud *cloud = NULL;
    srf_status status = srf_cloud_create(&positions, NULL, NULL, NULL, NULL, &cloud);
    if (status == SRF_OK) status = srf_reconstructor_create(cloud, NULL, &reconstructor);
    if (status == SRF_OK) status = srf_reconstructor_surface(reconstructor, NULL, NULL, out_mesh, NULL, NULL);
    srf_reconstructor_free(reconstructor);
    srf_cloud_free(cloud);
    return status;
}"#,
    },
    Chapter {
        title: "Coarse meshes",
        files: &["params/cluster", "reports/cluster", "cluster"],
        text: "A dense mesh, or points, become a mesh of few well-shaped triangles.",
        example: r#"
/* A mesh of about so many vertices. */
static srf_status coarser(const srf_mesh *mesh, uint64_t vertices, srf_mesh **out_mesh)
{
    srf_cluster_params params;
    srf_cluster_params_init(&params);
    params.vertices = vertices;
    return srf_mesh_cluster(mesh, &params, NULL, out_mesh, NULL);
}"#,
    },
    Chapter {
        title: "The virtual scanner",
        files: &["params/scan", "scan"],
        text: "Range images of any mesh, with the errors that a scanner makes: for tests that know the truth.",
        example: r#"
/* Scans a mesh from where the sensor stands. */
static srf_status scan(const srf_mesh *mesh, const srf_pose *world_from_sensor, srf_image **out_image)
{
    srf_projection camera;
    const srf_status status = srf_projection_pinhole(500, 500, 319.5, 239.5, 0, &camera);
    if (status != SRF_OK) return status;
    return srf_scan_mesh(mesh, 480, 640, &camera, world_from_sensor, NULL, NULL, out_image);
}"#,
    },
    Chapter {
        title: "Measuring",
        files: &["measure"],
        text: "How far points or a surface lie from a mesh.",
        example: r#"
/* Prints the largest distance of a surface from a reference. */
static srf_status compare(const srf_mesh *mesh, const srf_mesh *reference)
{
    double bound;
    const srf_status status = srf_mesh_surface_distance(mesh, reference, 0, 0, NULL, NULL, NULL, NULL, &bound);
    if (status == SRF_OK) printf("at most %g\n", bound);
    return status;
}"#,
    },
];

/// Widest line of a banner, the mark of a comment included.
const WIDTH: usize = 110;

impl Chapter {
    /// The functions that its files declare, in their order.
    fn functions(&self) -> Vec<String> {
        let sources = self.files.iter().map(|file| {
            let path = root().join("c-api/src").join(file).with_extension("rs");
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        });
        let names = |source: String| -> Vec<String> {
            let after = source.split("extern \"C\" fn srf_").skip(1);
            after.map(|rest| format!("srf_{}", rest.split('(').next().unwrap_or_default())).collect()
        };
        sources.flat_map(names).collect()
    }

    /// The text before its first function.
    fn banner(&self, number: usize) -> String {
        let head = format!("// ==== {number}. {} ", self.title);
        let mut banner = format!("{head:=<WIDTH$}\n");
        for line in wrapped(self.text, WIDTH - 3) {
            banner += &format!("// {line}\n");
        }
        banner += "//\n";
        for line in self.example.trim().lines() {
            banner += format!("//     {line}").trim_end();
            banner += "\n";
        }
        banner + "\n"
    }
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.len() + 1 + word.len() <= width => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The mark in the header's first comment that the index takes the place of.
const INDEX: &str = " * (index)\n";

/// The header with the index, and each chapter's banner before its first function.
pub fn with_chapters(header: &str) -> String {
    let mut header = header.to_owned();
    let mut index = String::new();
    for (number, chapter) in (1..).zip(CHAPTERS) {
        let functions = chapter.functions();
        let first = functions.first().expect("a chapter has functions");
        let lines: Vec<&str> = header.split_inclusive('\n').collect();
        let declares = |line: &&str| !line.starts_with([' ', '/']) && line.contains(&format!("{first}("));
        let declared = lines.iter().position(declares).unwrap_or_else(|| panic!("{first} is not declared"));
        let begin = (0..declared).rev().take_while(|&line| lines[line].starts_with("//")).last().unwrap_or(declared);
        // Structs are prepared first, which says least of a chapter.
        let named = functions.iter().find(|name| !name.ends_with("_init_sized")).unwrap_or(first);
        index += &format!(" *   {number:>2}. {:<48}{named}()\n", chapter.title);
        let banner = chapter.banner(number);
        header = [&lines[..begin], &[banner.as_str()], &lines[begin..]].concat().concat();
    }
    assert!(header.contains(INDEX), "the header's first comment has no place for the index");
    header.replace(INDEX, &index)
}
