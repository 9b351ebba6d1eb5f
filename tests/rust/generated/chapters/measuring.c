/* Prints the largest distance of a surface from a reference. */
static srf_status compare(const srf_mesh *mesh, const srf_mesh *reference)
{
    srf_distance_report figures;
    srf_status status;
    srf_distance_report_init(&figures);
    status = srf_mesh_surface_distance(mesh, reference, 0, 0, NULL, NULL, &figures);
    if (status == SRF_OK) printf("at most %g\n", figures.bound);
    return status;
}

/* Prints how far points lie from a mesh: the mean, and what 95 of 100 do not exceed. */
static srf_status print_distances(const srf_mesh *mesh, const double *points, size_t count)
{
    const srf_array positions = {points, count, 0, SRF_TYPE_F64, 3};
    srf_distance_report figures;
    srf_status status;
    srf_distance_report_init(&figures);
    status = srf_mesh_distances(mesh, &positions, 0, 0, NULL, NULL, &figures);
    if (status == SRF_OK) printf("%g, %g\n", figures.mean, figures.p95);
    return status;
}
