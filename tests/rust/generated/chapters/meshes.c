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
}

/* Makes a mesh of arrays in single precision, with a colour a vertex. */
static srf_status from_arrays(const float *positions, const uint8_t *colours, size_t vertices,
                              const uint32_t *corners, size_t triangles, srf_mesh **out_mesh)
{
    const srf_array of_positions = {positions, vertices, 0, SRF_TYPE_F32, 3};
    const srf_array of_colours = {colours, vertices, 0, SRF_TYPE_U8, 4};
    const srf_array of_corners = {corners, triangles, 0, SRF_TYPE_U32, 3};
    srf_status status = srf_mesh_create(&of_positions, &of_corners, out_mesh);
    if (status != SRF_OK) return status;
    status = srf_mesh_set_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "colour", &of_colours);
    if (status != SRF_OK) srf_mesh_free(*out_mesh);
    return status;
}

/* Prints what the vertices of a mesh have, and whether it is closed. */
static srf_status print_mesh(const srf_mesh *mesh)
{
    srf_check_report report;
    size_t i, count = 0;
    srf_status status = srf_mesh_attribute_count(mesh, SRF_DOMAIN_VERTICES, &count);
    for (i = 0; status == SRF_OK && i < count; ++i) {
        const char *name;
        srf_array view;
        status = srf_mesh_attribute_name(mesh, SRF_DOMAIN_VERTICES, i, &name);
        if (status == SRF_OK) status = srf_mesh_attribute(mesh, SRF_DOMAIN_VERTICES, name, &view);
        if (status == SRF_OK) printf("%s: %u numbers a vertex\n", name, view.components);
    }
    srf_check_report_init(&report);
    if (status == SRF_OK) status = srf_mesh_check(mesh, 0, NULL, &report);
    if (status == SRF_OK) puts(report.is_closed ? "closed" : "open");
    return status;
}

/* Copies a mesh for a graphics card, about the middle of its box; free() releases the vertices. */
static srf_status for_graphics(const srf_mesh *mesh, float **out_vertices, srf_array *out_triangles)
{
    double low[3], high[3], middle[3];
    size_t axis, count = 0;
    srf_status status = srf_mesh_size(mesh, &count, NULL);
    if (status == SRF_OK) status = srf_mesh_bounds(mesh, NULL, low, high);
    if (status != SRF_OK) return status;
    for (axis = 0; axis < 3; ++axis) middle[axis] = (low[axis] + high[axis]) / 2;
    *out_vertices = (float *)malloc(3 * count * sizeof(float));
    if (*out_vertices == NULL) return SRF_ERR_OUT_OF_MEMORY;
    status = srf_mesh_positions_f32(mesh, middle, *out_vertices, 3 * count, NULL);
    if (status == SRF_OK) status = srf_mesh_triangles(mesh, out_triangles);
    return status;
}

/* Copies the points of a cloud for a graphics card; prints whether it has normals, and its place and sensor. */
static srf_status cloud_for_graphics(const srf_cloud *cloud, float **out_points)
{
    double sensor[3];
    srf_array normals;
    srf_pose place;
    size_t count = 0;
    srf_status status = srf_cloud_size(cloud, &count);
    if (status == SRF_OK) status = srf_cloud_arrays(cloud, NULL, &normals, NULL, NULL);
    if (status == SRF_OK) status = srf_cloud_pose(cloud, &place);
    if (status == SRF_OK) status = srf_cloud_sensor(cloud, sensor);
    if (status != SRF_OK) return status;
    puts(normals.count > 0 ? "with normals" : "without normals");
    printf("stands at %g %g %g\n", place.matrix[12], place.matrix[13], place.matrix[14]);
    printf("was seen from %g %g %g in its frame\n", sensor[0], sensor[1], sensor[2]);
    *out_points = (float *)malloc(3 * count * sizeof(float));
    if (*out_points == NULL) return SRF_ERR_OUT_OF_MEMORY;
    return srf_cloud_positions_f32(cloud, NULL, *out_points, 3 * count, NULL);
}

/* Whether points lie in the box around an image, in the world. */
static srf_status lie_in_box(const double *points, size_t count, const srf_image *image, int *out_lie_in)
{
    const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
    double low[2][3], high[2][3];
    srf_cloud *cloud = NULL;
    size_t axis;
    srf_status status = srf_cloud_create(&positions, NULL, NULL, NULL, NULL, &cloud);
    if (status == SRF_OK) status = srf_cloud_bounds(cloud, NULL, low[0], high[0]);
    if (status == SRF_OK) status = srf_image_bounds(image, NULL, low[1], high[1]);
    if (status == SRF_OK) {
        *out_lie_in = 1;
        for (axis = 0; axis < 3; ++axis)
            if (low[0][axis] < low[1][axis] || high[0][axis] > high[1][axis]) *out_lie_in = 0;
    }
    srf_cloud_free(cloud);
    return status;
}

/* The data that a host keeps of a range image: vertices, which it takes times 1000, and the camera of them. */
static srf_status to_host(const srf_image *image, srf_mesh **out_mesh, srf_grid_camera *out_camera)
{
    srf_status status;
    srf_grid_camera_init(out_camera);
    status = srf_image_grid_camera(image, NULL, out_camera);
    if (status == SRF_OK) status = srf_grid_camera_scale(out_camera, 1000);
    if (status == SRF_OK) status = srf_image_to_mesh(image, 1, NULL, out_mesh);
    return status;
}

/* Makes the range image again of where the host's user has moved the vertices. */
static srf_status from_host(const srf_grid_camera *camera, const int32_t *rows, const int32_t *cols,
                            const float *positions, size_t count, srf_image **out_image)
{
    const srf_array of_rows = {rows, count, 0, SRF_TYPE_I32, 1};
    const srf_array of_cols = {cols, count, 0, SRF_TYPE_I32, 1};
    const srf_array at = {positions, count, 0, SRF_TYPE_F32, 3};
    return srf_image_from_vertices(camera, &of_rows, &of_cols, &at, NULL, NULL, NULL, NULL, NULL, NULL, out_image);
}
