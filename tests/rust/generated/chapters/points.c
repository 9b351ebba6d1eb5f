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
}

/* The open surface through points that one sensor saw; prints how many are not on it. */
static srf_status open_through(const srf_cloud *cloud, const double sensor[3], srf_mesh **out_mesh)
{
    const srf_array seen_from = {sensor, 1, 0, SRF_TYPE_F64, 3};
    srf_reconstruct_params params;
    srf_reconstruct_report report;
    srf_reconstructor *reconstructor;
    srf_status status = srf_reconstructor_create(cloud, &seen_from, &reconstructor);
    if (status != SRF_OK) return status;
    srf_reconstruct_params_init(&params);
    srf_reconstruct_report_init(&report);
    params.closure = SRF_CLOSURE_OPEN;
    status = srf_reconstructor_surface(reconstructor, &params, NULL, out_mesh, &report, NULL);
    if (status == SRF_OK) printf("%g points are not on it\n", (double)(report.points - report.used));
    srf_reconstructor_free(reconstructor);
    return status;
}
