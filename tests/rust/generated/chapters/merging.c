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
}

/* Adds scans of all kinds: of a set, an image, a mesh, and one whose image a function makes when it is needed. */
static srf_status add_all(srf_merger *merger, const srf_scans *scans, const srf_image *image, const srf_mesh *mesh,
                          const srf_image_source *source)
{
    srf_status status = srf_merger_add_scan(merger, scans, 0);
    if (status == SRF_OK) status = srf_merger_add_image(merger, image);
    if (status == SRF_OK) status = srf_merger_add_mesh(merger, mesh, NULL, "model");
    if (status == SRF_OK) status = srf_merger_add_source(merger, source, NULL, "made");
    return status;
}

/* Merges twice, with another image in the place of the first scan: only what it has a part in is done anew. */
static srf_status preview(srf_merger *merger, const srf_image *image, srf_mesh **out_first, srf_mesh **out_second)
{
    size_t renewed = 0, bricks = 0;
    srf_status status = srf_merger_keep(merger, 1);
    if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, out_first, NULL);
    if (status == SRF_OK) status = srf_merger_replace_by_image(merger, 0, image);
    if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, out_second, NULL);
    if (status == SRF_OK) status = srf_merger_renewed(merger, &renewed, &bricks);
    if (status == SRF_OK) printf("%g of %g bricks were new\n", (double)renewed, (double)bricks);
    return status;
}

/* Puts others in the place of the first three scans, and removes the last. */
static srf_status exchange(srf_merger *merger, const srf_scans *scans, const srf_mesh *mesh,
                           const srf_image_source *source)
{
    size_t count = 0;
    srf_status status = srf_merger_replace_by_scan(merger, 0, scans, 0);
    if (status == SRF_OK) status = srf_merger_replace_by_mesh(merger, 1, mesh, NULL, "model");
    if (status == SRF_OK) status = srf_merger_replace_by_source(merger, 2, source, NULL, "made");
    if (status == SRF_OK) status = srf_merger_count(merger, &count);
    if (status == SRF_OK) status = srf_merger_remove(merger, count - 1);
    return status;
}

/* Merges with 4 GB: into a mesh if that fits, else straight into a file, with *out_mesh NULL. */
static srf_status merge_many(const srf_merger *merger, const char *path, const char *fast_disk, srf_mesh **out_mesh)
{
    const uint64_t memory = 4000000000u;
    srf_merge_report report;
    srf_status status;
    srf_merge_report_init(&report);
    *out_mesh = NULL;
    status = srf_merger_run_in_files(merger, NULL, 1, memory, fast_disk, NULL, out_mesh, &report);
    if (status == SRF_ERR_OUT_OF_MEMORY)
        status = srf_merger_write(merger, path, NULL, memory, fast_disk, NULL, NULL, NULL, &report);
    if (status == SRF_OK) printf("cells of %g\n", report.voxel);
    return status;
}
