/* Writes a mesh of millimetres whose z points up, for viewers of glTF. */
static srf_status write_for_viewers(const srf_mesh *mesh, const char *path)
{
    srf_write_options options;
    srf_write_options_init(&options);
    options.metres_per_unit = 0.001;
    options.up = SRF_UP_Z;
    return srf_mesh_write(mesh, path, &options, NULL);
}

/* Merges into a file that says where it is from, unless its name is none that can be written. */
static srf_status merge_into(const srf_merger *merger, const char *path)
{
    srf_mesh *mesh = NULL;
    srf_status status = srf_check_mesh_file(path, NULL);
    if (status == SRF_OK) status = srf_merger_run(merger, NULL, NULL, &mesh, NULL);
    if (status == SRF_OK) status = srf_mesh_write_from(mesh, path, NULL, "{\"found in\": \"trench 4\"}", NULL);
    srf_mesh_free(mesh);
    return status;
}

/* The provenance in a file. free() releases the text. */
static srf_status provenance_of(const char *path, char **out_text)
{
    size_t length = 0;
    srf_status status = srf_file_provenance(path, NULL, 0, &length);
    if (status != SRF_OK) return status;
    *out_text = (char *)malloc(length + 1);
    if (*out_text == NULL) return SRF_ERR_OUT_OF_MEMORY;
    return srf_file_provenance(path, *out_text, length + 1, &length);
}

/* Writes a mesh of millimetres in each format, and a cloud. */
static srf_status write_each(const srf_mesh *mesh, const srf_cloud *cloud)
{
    srf_status status = srf_mesh_write_ply(mesh, "mesh.ply", SRF_ENCODING_BINARY, NULL);
    if (status == SRF_OK) status = srf_mesh_write_glb(mesh, "mesh.glb", "part 7", 0.001, 1, NULL);
    if (status == SRF_OK) status = srf_mesh_write_obj(mesh, "mesh.obj", NULL);
    if (status == SRF_OK) status = srf_mesh_write_stl(mesh, "mesh.stl", NULL);
    if (status == SRF_OK) status = srf_cloud_write_ply(cloud, "cloud.ply", SRF_ENCODING_BINARY, NULL);
    return status;
}

/* Writes a mesh with a coarser one, which viewers show from afar. */
static srf_status write_levels(const srf_mesh *fine, const srf_mesh *coarse, const char *path)
{
    const srf_mesh *levels[2];
    levels[0] = fine;
    levels[1] = coarse;
    return srf_meshes_write_glb_levels(levels, 2, path, NULL, 0.001, 1, NULL);
}

/* Writes images with their poses: as files that open as one set, and as those of surveyors. */
static srf_status write_images(const srf_image *const *images, size_t count)
{
    srf_status status = srf_images_write_conf(images, count, "scans.conf", SRF_ENCODING_BINARY, NULL);
    if (status == SRF_OK) status = srf_images_write_ptx(images, count, "scans.ptx", NULL);
    if (status == SRF_OK) status = srf_images_write_e57(images, count, "scans.e57", NULL);
    if (status == SRF_OK) status = srf_images_write_e57_from(images, count, "mill.e57", "{\"at\": \"mill\"}", NULL);
    return status;
}

/* Says which coordinate reference system everything lies in. */
static srf_status set_systems(srf_scans *scans, srf_image *image, srf_cloud *cloud, srf_mesh *mesh,
                              const char *system)
{
    srf_status status = srf_scans_set_crs(scans, SIZE_MAX, system);
    if (status == SRF_OK) status = srf_image_set_crs(image, system);
    if (status == SRF_OK) status = srf_cloud_set_crs(cloud, system);
    if (status == SRF_OK) status = srf_mesh_set_crs(mesh, system);
    return status;
}

/* Prints which one a mesh lies in, and how long the texts of the others are. */
static srf_status print_systems(const srf_scans *scans, const srf_image *image, const srf_cloud *cloud,
                                const srf_mesh *mesh)
{
    char text[4096];
    size_t of_scans = 0, of_image = 0, of_cloud = 0, length = 0;
    srf_status status = srf_scans_crs(scans, SIZE_MAX, NULL, 0, &of_scans);
    if (status == SRF_OK) status = srf_image_crs(image, NULL, 0, &of_image);
    if (status == SRF_OK) status = srf_cloud_crs(cloud, NULL, 0, &of_cloud);
    if (status == SRF_OK) status = srf_mesh_crs(mesh, text, sizeof(text), &length);
    if (status != SRF_OK) return status;
    printf("%s; %u, %u, %u\n", text, (unsigned)of_scans, (unsigned)of_image, (unsigned)of_cloud);
    return SRF_OK;
}
