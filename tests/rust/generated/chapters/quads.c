/* Writes an image as quads. */
static srf_status write_quads(const srf_image *image, const char *path)
{
    srf_quads *quads;
    srf_status status = srf_quads_create(image, NULL, NULL, &quads, NULL);
    if (status != SRF_OK) return status;
    status = srf_quads_write_obj(quads, path, NULL);
    srf_quads_free(quads);
    return status;
}

/* Makes quads that lie within an error of the samples, and hands out their vertices and corners. */
static srf_status quads_within(const srf_image *image, double error, srf_quads **out_quads,
                               srf_array *out_positions, srf_array *out_corners)
{
    srf_quads_params params;
    srf_quads_report report;
    srf_status status;
    srf_quads_params_init(&params);
    srf_quads_report_init(&report);
    params.max_error = error;
    status = srf_quads_create(image, &params, NULL, out_quads, &report);
    if (status != SRF_OK) return status;
    printf("%g quads, at most %g off\n", (double)report.quads, report.max_error);
    return srf_quads_faces(*out_quads, out_positions, NULL, out_corners, NULL);
}

/* The quads as triangles; prints the pixel of the grid's last vertex. */
static srf_status quads_as_triangles(const srf_quads *quads, srf_mesh **out_mesh)
{
    srf_array pixels;
    size_t rows = 0, cols = 0;
    srf_status status = srf_quads_grid(quads, &rows, &cols, NULL, &pixels, NULL);
    if (status != SRF_OK) return status;
    printf("%u %u\n", ((const uint32_t *)pixels.data)[2 * (rows * cols - 1)],
           ((const uint32_t *)pixels.data)[2 * (rows * cols - 1) + 1]);
    return srf_quads_triangles(quads, out_mesh);
}

/* A smooth surface of 20 x 20 control points, as a mesh of 200 x 200 vertices. */
static srf_status smooth(const srf_quads *quads, srf_mesh **out_mesh)
{
    srf_spline_params params;
    srf_array control_points;
    srf_spline *spline;
    double middle[3];
    size_t rows = 0, cols = 0;
    srf_status status;
    srf_spline_params_init(&params);
    params.rows = params.columns = 20;
    status = srf_spline_create(quads, &params, NULL, &spline, NULL, NULL);
    if (status != SRF_OK) return status;
    status = srf_spline_control(spline, &rows, &cols, &control_points);
    if (status == SRF_OK) status = srf_spline_point(spline, 0.5, 0.5, middle);
    if (status == SRF_OK) printf("its middle is at %g %g %g\n", middle[0], middle[1], middle[2]);
    if (status == SRF_OK) status = srf_spline_sample(spline, 200, 200, out_mesh);
    srf_spline_free(spline);
    return status;
}
