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
}

/* A mesh of at most so many triangles, as near as can be found; prints its tolerance. */
static srf_status sculpt_small(const srf_image *image, size_t triangles, srf_mesh **out_mesh)
{
    srf_sculpt_params params;
    srf_sculpt_report found;
    srf_sculptor *sculptor;
    srf_status status;
    srf_sculpt_params_init(&params);
    params.effort = 2;
    status = srf_sculptor_create(image, &params, NULL, &sculptor);
    if (status != SRF_OK) return status;
    srf_sculpt_report_init(&found);
    status = srf_sculptor_at_most(sculptor, triangles, NULL, out_mesh, &found);
    if (status == SRF_OK) printf("%g\n", found.tolerance);
    srf_sculptor_free(sculptor);
    return status;
}
