/* Makes a range image of depths in metres, row after row. */
static srf_status from_depths(const double *depths, size_t rows, size_t cols, srf_image **out_image)
{
    const srf_array samples = {depths, rows * cols, 0, SRF_TYPE_F64, 1};
    srf_projection camera;
    const srf_status status = srf_projection_pinhole(525, 525, 319.5, 239.5, 0, &camera);
    if (status != SRF_OK) return status;
    return srf_image_create(rows, cols, &camera, &samples, NULL, "first", out_image);
}

/* How the others see: heights half a unit apart, a scanner that turns by a milliradian, points of a grid. */
static srf_status other_projections(srf_projection projections[4])
{
    static const double down[3] = {0, 0, -1}, eye[3] = {0, 0, 1.6};
    srf_status status = srf_projection_orthographic(0, 0, 0.5, -0.5, &projections[0]);
    if (status == SRF_OK) status = srf_projection_spherical(0, 0.7, 0.001, -0.001, &projections[1]);
    if (status == SRF_OK) status = srf_projection_grid_parallel(down, &projections[2]);
    if (status == SRF_OK) status = srf_projection_grid_from(eye, &projections[3]);
    return status;
}

/* Makes a range image of a frame of a phone: 192 x 256 depths in millimetres, and a photo of 1440 x 1920 pixels. */
static srf_status from_phone(const uint16_t *depths, const uint8_t *photo, srf_image **out_image)
{
    const srf_array samples = {depths, 192 * 256, 0, SRF_TYPE_U16, 1};
    const srf_array colours = {photo, 1440 * 1920, 0, SRF_TYPE_U8, 3};
    srf_left_out_report left_out;
    srf_frame frame;
    srf_status status;
    srf_left_out_report_init(&left_out);
    srf_frame_init(&frame);
    frame.rows = 192;
    frame.cols = 256;
    frame.intrinsics[0] = frame.intrinsics[1] = 212;
    frame.intrinsics[2] = 127.5;
    frame.intrinsics[3] = 95.5;
    frame.scale = 0.001;
    frame.reach = 5;
    frame.colour_rows = 1440;
    frame.colour_cols = 1920;
    status = srf_image_from_frame(&frame, &samples, &colours, NULL, NULL, "first", NULL, out_image, &left_out);
    if (status == SRF_OK) printf("%g samples are too far\n", (double)left_out.out_of_reach);
    return status;
}

/* Names an image, places its sensor, and gives its pixels colours. */
static srf_status name_and_place(srf_image *image, const srf_pose *world_from_sensor, const uint8_t *colours)
{
    size_t rows = 0, cols = 0;
    srf_status status = srf_image_set_name(image, "front");
    if (status == SRF_OK) status = srf_image_set_pose(image, world_from_sensor);
    if (status == SRF_OK) status = srf_image_size(image, &rows, &cols, NULL);
    if (status == SRF_OK) {
        const srf_array of_pixels = {colours, rows * cols, 0, SRF_TYPE_U8, 4};
        status = srf_image_set_attributes(image, &of_pixels, NULL, NULL);
    }
    return status;
}

/* Prints what an image is, and where the ray of its first pixel leads. */
static srf_status print_image(const srf_image *image)
{
    double sensor[3], origin[3], direction[3];
    srf_array samples, colours;
    srf_projection projection;
    const char *name;
    srf_status status = srf_image_name(image, &name);
    if (status == SRF_OK) status = srf_image_camera(image, &projection, NULL);
    if (status == SRF_OK) status = srf_image_samples(image, &samples);
    if (status == SRF_OK) status = srf_image_attributes(image, &colours, NULL, NULL);
    if (status == SRF_OK) status = srf_image_sensor(image, sensor);
    if (status == SRF_OK) status = srf_image_ray(image, 0, 0, origin, direction);
    if (status != SRF_OK) return status;
    printf("%s: %u numbers a pixel of kind %u\n", name, samples.components, projection.kind);
    puts(colours.count > 0 ? "with colours" : "without colours");
    if (sensor[0] == sensor[0]) printf("seen from %g %g %g in the world\n", sensor[0], sensor[1], sensor[2]);
    printf("its first pixel looks along %g %g %g\n", direction[0], direction[1], direction[2]);
    return SRF_OK;
}

/* Copies the measured points of an image, in the world; free() releases them. */
static srf_status copy_points(const srf_image *image, double **out_points)
{
    size_t rows = 0, cols = 0;
    srf_status status = srf_image_size(image, &rows, &cols, NULL);
    if (status != SRF_OK) return status;
    *out_points = (double *)malloc(3 * rows * cols * sizeof(double));
    if (*out_points == NULL) return SRF_ERR_OUT_OF_MEMORY;
    return srf_image_world_points(image, *out_points, 3 * rows * cols, NULL);
}

/* Makes a mesh and points of an image, the mesh without what is seen at a grazing angle, and releases the image. */
static srf_status mesh_and_points(srf_image *image, srf_mesh **out_mesh, srf_cloud **out_cloud)
{
    srf_triangulate_params params;
    srf_status status;
    srf_triangulate_params_init(&params);
    params.grazing_limit = 1.4;
    status = srf_image_triangulate(image, &params, NULL, out_mesh);
    if (status == SRF_OK) {
        status = srf_image_to_cloud(image, NULL, out_cloud);
        if (status != SRF_OK) srf_mesh_free(*out_mesh);
    }
    srf_image_free(image);
    return status;
}
