/* Scans a mesh from where the sensor stands. */
static srf_status scan(const srf_mesh *mesh, const srf_pose *world_from_sensor, srf_image **out_image)
{
    srf_projection camera;
    const srf_status status = srf_projection_pinhole(500, 500, 319.5, 239.5, 0, &camera);
    if (status != SRF_OK) return status;
    return srf_scan_mesh(mesh, 480, 640, &camera, world_from_sensor, NULL, NULL, out_image);
}

/* The same with noise of half a unit, and a pixel of a hundred that gives no value. */
static srf_status scan_badly(const srf_mesh *mesh, const srf_projection *camera, const srf_pose *world_from_sensor,
                             srf_image **out_image)
{
    srf_scan_params params;
    srf_scan_params_init(&params);
    params.noise = 0.5;
    params.dropout = 0.01;
    return srf_scan_mesh(mesh, 480, 640, camera, world_from_sensor, &params, NULL, out_image);
}
