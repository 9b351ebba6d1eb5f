/* A mesh of about so many vertices. */
static srf_status coarser(const srf_mesh *mesh, uint64_t vertices, srf_mesh **out_mesh)
{
    srf_cluster_params params;
    srf_cluster_params_init(&params);
    params.vertices = vertices;
    return srf_mesh_cluster(mesh, &params, NULL, out_mesh, NULL);
}

/* A mesh of even triangles through points; prints the mean of their smallest angles, in radians. */
static srf_status even_mesh(const srf_cloud *cloud, srf_mesh **out_mesh)
{
    srf_cluster_report report;
    srf_status status;
    srf_cluster_report_init(&report);
    status = srf_cloud_cluster(cloud, NULL, NULL, out_mesh, &report);
    if (status == SRF_OK) printf("%g\n", report.after_mean_smallest_angle);
    return status;
}

/* Three levels of detail of a mesh, and of points. */
static srf_status levels(const srf_mesh *mesh, const srf_cloud *cloud, srf_mesh *of_mesh[3], srf_mesh *of_cloud[3])
{
    static const uint64_t vertices[3] = {10000, 1000, 100};
    srf_status status = srf_mesh_cluster_levels(mesh, vertices, 3, NULL, NULL, of_mesh);
    if (status == SRF_OK) status = srf_cloud_cluster_levels(cloud, vertices, 3, NULL, NULL, of_cloud);
    return status;
}
