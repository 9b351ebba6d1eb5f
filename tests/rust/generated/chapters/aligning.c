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
}

/* Aligns an image and points, which lie at most 20 off, to a mesh that stays. */
static srf_status align_to_mesh(const srf_mesh *mesh, const srf_image *image, const srf_cloud *cloud,
                                srf_alignment **out_alignment)
{
    srf_align_params params;
    srf_aligner *aligner;
    srf_status status = srf_aligner_create(&aligner);
    if (status != SRF_OK) return status;
    srf_align_params_init(&params);
    params.start = SRF_START_ROUGH;
    params.reach = 20;
    status = srf_aligner_add_mesh(aligner, mesh, NULL, "model");
    if (status == SRF_OK) status = srf_aligner_add_image(aligner, image);
    if (status == SRF_OK) status = srf_aligner_add_cloud(aligner, cloud, "points");
    if (status == SRF_OK) status = srf_aligner_fix(aligner, 0);
    if (status == SRF_OK) status = srf_aligner_run(aligner, &params, NULL, out_alignment);
    srf_aligner_free(aligner);
    return status;
}

/* Says what a person sees: a point that scans 0 and 1 show, that 1 and 2 touch, and that 0 and 2 do not. */
static srf_status say_what_is_known(srf_aligner *aligner, const double in_first[3], const double in_second[3])
{
    srf_pick pick;
    size_t axis;
    srf_status status;
    srf_pick_init(&pick);
    pick.scans[0] = 0;
    pick.scans[1] = 1;
    for (axis = 0; axis < 3; ++axis) {
        pick.points[0][axis] = in_first[axis];
        pick.points[1][axis] = in_second[axis];
    }
    status = srf_aligner_pick(aligner, &pick);
    if (status == SRF_OK) status = srf_aligner_trust(aligner, 1, 2);
    if (status == SRF_OK) status = srf_aligner_reject(aligner, 0, 2);
    return status;
}

/* Aligns scans of an object that stood on a turntable; prints by how much it was turned at each. */
static srf_status align_turned(srf_aligner *aligner, srf_alignment **out_alignment)
{
    uint32_t found = 0;
    srf_array angles;
    size_t i, count = 0;
    srf_status status = srf_aligner_turn(aligner, NULL, NULL, NULL, 0);
    if (status == SRF_OK) status = srf_aligner_count(aligner, &count);
    if (status == SRF_OK) status = srf_aligner_run(aligner, NULL, NULL, out_alignment);
    if (status != SRF_OK) return status;
    status = srf_alignment_turntable(*out_alignment, &found, NULL, NULL, &angles);
    for (i = 0; status == SRF_OK && found && i < count; ++i) printf("%g\n", ((const double *)angles.data)[i]);
    return status;
}

/* Prints what was found, line after line. */
static srf_status print_alignment(const srf_alignment *alignment)
{
    srf_align_report report;
    uint64_t i;
    srf_status status;
    srf_align_report_init(&report);
    status = srf_alignment_report(alignment, &report);
    for (i = 0; status == SRF_OK && i < 1 + report.scans_count + report.messages_count; ++i) {
        const char *line;
        status = srf_alignment_line(alignment, i, &line);
        if (status == SRF_OK) puts(line);
    }
    return status;
}

/* Prints what is not well: messages, why scans have no place, and pairs that do not fit. */
static srf_status print_problems(const srf_alignment *alignment)
{
    const char *text;
    srf_align_report report;
    uint64_t i;
    srf_status status;
    srf_align_report_init(&report);
    status = srf_alignment_report(alignment, &report);
    for (i = 0; status == SRF_OK && i < report.messages_count; ++i) {
        status = srf_alignment_message(alignment, i, &text);
        if (status == SRF_OK) puts(text);
    }
    for (i = 0; status == SRF_OK && i < report.scans_count; ++i) {
        status = srf_alignment_reason(alignment, i, &text);
        if (status == SRF_OK && *text != 0) printf("scan %u: %s\n", (unsigned)i, text);
    }
    for (i = 0; status == SRF_OK && i < report.pairs_count; ++i) {
        srf_aligned_pair pair;
        srf_aligned_pair_init(&pair);
        status = srf_alignment_pair(alignment, i, &pair);
        if (status != SRF_OK || pair.state != SRF_PAIR_STATE_MISFIT) continue;
        printf("scans %u and %u lie %g apart\n", (unsigned)pair.scans[0], (unsigned)pair.scans[1], pair.residual);
    }
    return status;
}

/* Draws a scan that was dragged to the others; takes its pose only if it fits there. */
static srf_status drop_scan(const srf_aligner *aligner, size_t scan, srf_pose *poses, size_t count)
{
    srf_snap_report snap;
    srf_status status;
    srf_snap_report_init(&snap);
    status = srf_aligner_snap(aligner, scan, poses, count, NULL, NULL, &snap, NULL);
    if (status == SRF_OK && snap.state == SRF_PAIR_STATE_FITS) poses[scan] = snap.world_from_scan;
    return status;
}

/* How far points of a scan lie outside of the others: warp, or what has moved. */
static srf_status show_warp(const srf_aligner *aligner, size_t scan, const float *points, size_t count,
                            double *out_distances)
{
    const srf_array of_scan = {points, count, 0, SRF_TYPE_F32, 3};
    return srf_aligner_misfit(aligner, scan, NULL, 0, &of_scan, NULL, out_distances);
}

/* Makes the image of a scan whenever it is needed, of 480 x 640 depths in millimetres in a file. */
static int32_t load_depths(void *path, srf_image **out_image)
{
    const size_t pixels = 480 * 640;
    uint16_t *depths = (uint16_t *)malloc(pixels * sizeof(uint16_t));
    FILE *file = fopen((const char *)path, "rb");
    srf_status status = SRF_ERR_IO;
    if (depths != NULL && file != NULL && fread(depths, sizeof(uint16_t), pixels, file) == pixels) {
        const srf_array samples = {depths, pixels, 0, SRF_TYPE_U16, 1};
        srf_frame frame;
        srf_frame_init(&frame);
        frame.rows = 480;
        frame.cols = 640;
        frame.intrinsics[0] = frame.intrinsics[1] = 525;
        frame.intrinsics[2] = 319.5;
        frame.intrinsics[3] = 239.5;
        frame.scale = 0.001;
        status = srf_image_from_frame(&frame, &samples, NULL, NULL, NULL, NULL, NULL, out_image, NULL);
    }
    if (file != NULL) fclose(file);
    free(depths);
    return status;
}

/* Adds such a scan, whose samples never all stay in memory. */
static srf_status add_depths(srf_aligner *aligner, char *path)
{
    srf_image_source source;
    source.make = load_depths;
    source.user = path;
    return srf_aligner_add_source(aligner, &source, NULL, path);
}
