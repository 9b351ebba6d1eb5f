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
}

/* Removes the table that scans show, and lays it to height 0; they were added to the aligner where they lie. */
static srf_status without_table(const srf_aligner *aligner, srf_scans *scans)
{
    srf_plane_params params;
    srf_plane table;
    srf_pose similarity;
    srf_region *region = NULL;
    srf_status status;
    srf_plane_params_init(&params);
    params.min_share = 0.2;
    srf_plane_init(&table);
    status = srf_dominant_plane(aligner, &params, NULL, &table);
    if (status == SRF_OK) status = srf_region_below(&table, &region);
    if (status == SRF_OK) status = srf_scans_select(scans, SIZE_MAX, region, 0);
    if (status == SRF_OK) status = srf_ground(&table, NULL, &similarity);
    if (status == SRF_OK) status = srf_scans_transform(scans, &similarity);
    srf_region_free(region);
    return status;
}

/* Removes what lies below three points that were picked, with the eye above, of an image, a cloud and a mesh. */
static srf_status cut_below(const double points[9], const double eye[3], srf_image *image, srf_cloud *cloud,
                            srf_mesh *mesh)
{
    srf_plane plane;
    srf_region *region = NULL;
    srf_status status;
    srf_plane_init(&plane);
    status = srf_plane_through(points, eye, &plane);
    if (status == SRF_OK) status = srf_region_below(&plane, &region);
    if (status == SRF_OK) status = srf_image_select(image, region, 0, NULL, NULL);
    if (status == SRF_OK) status = srf_cloud_select(cloud, region, 0, NULL, NULL);
    if (status == SRF_OK) status = srf_mesh_select(mesh, NULL, region, 0, NULL, NULL);
    srf_region_free(region);
    return status;
}

/* Keeps the pixels of an image that are marked; prints how many went. */
static srf_status keep_marked(srf_image *image, const uint8_t *marks, size_t rows, size_t cols)
{
    const srf_array of_pixels = {marks, rows * cols, 0, SRF_TYPE_U8, 1};
    srf_region *region = NULL;
    size_t removed = 0;
    srf_status status = srf_region_mask(&of_pixels, rows, cols, &region);
    if (status == SRF_OK) status = srf_image_select(image, region, 1, NULL, &removed);
    if (status == SRF_OK) printf("%g samples went\n", (double)removed);
    srf_region_free(region);
    return status;
}

/* Scales an image, a cloud and a mesh so that two places lie half a metre apart. */
static srf_status true_size(const double a[3], const double b[3], srf_image *image, srf_cloud *cloud,
                            srf_mesh *mesh)
{
    srf_pose similarity;
    srf_status status = srf_true_size(a, b, 0.5, &similarity);
    if (status == SRF_OK) status = srf_image_transform(image, &similarity);
    if (status == SRF_OK) status = srf_cloud_transform(cloud, &similarity);
    if (status == SRF_OK) status = srf_mesh_transform(mesh, &similarity);
    return status;
}
