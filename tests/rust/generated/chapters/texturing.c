/* A photo of 4000 x 3000 pixels of three bytes each, by a camera without distortion. */
static srf_status photographed(const char *name, const uint8_t *pixels, const srf_pose *world_from_camera, srf_photo **out_photo)
{
    srf_projection camera;
    srf_array colours;
    srf_status status = srf_projection_pinhole(3100, 3100, 1999.5, 1499.5, 0, &camera);
    if (status != SRF_OK) return status;
    colours.data = pixels;
    colours.count = (size_t)3000 * 4000;
    colours.stride = 0;
    colours.type = SRF_TYPE_U8;
    colours.components = 3;
    return srf_photo_create(3000, 4000, &camera, &colours, world_from_camera, name, 0, 0, NULL, out_photo);
}

/* Images of 2048 texels for a light mesh that stands for a detailed one. Takes hold of the colours of the first tile, and prints what was
 * taken of each photo. */
static srf_status textured(const srf_mesh *light, const srf_mesh *detail, const srf_photo *const *photos, size_t count,
                           srf_textures **out_textures, srf_array *colours)
{
    srf_texture_params params;
    srf_texture_report report;
    srf_mesh *unwrapped = NULL;
    srf_status status;
    size_t i, size, tiles;
    srf_texture_params_init(&params);
    srf_texture_report_init(&report);
    params.normal_map = 1;
    status = srf_mesh_unwrap(light, NULL, NULL, &unwrapped, NULL);
    if (status == SRF_OK) status = srf_mesh_texture(unwrapped, detail, photos, count, &params, NULL, out_textures, &report);
    srf_mesh_free(unwrapped);
    if (status != SRF_OK) return status;
    printf("photos see %.0f %% of the texels\n", 100.0 * (double)report.seen / (double)report.texels);
    for (i = 0; i < count && status == SRF_OK; ++i) {
        srf_textured_photo photo;
        srf_pose camera;
        const char *reason = "";
        srf_textured_photo_init(&photo);
        status = srf_textures_photo(*out_textures, i, &photo);
        if (status == SRF_OK) status = srf_textures_reason(*out_textures, i, &reason);
        if (status == SRF_OK) status = srf_textures_pose(*out_textures, i, &camera);
        if (status == SRF_OK) printf("photo %u: moved by %g pixels to %g %s\n", (unsigned)i, photo.moved, camera.matrix[12], reason);
    }
    if (status == SRF_OK) status = srf_textures_size(*out_textures, &size, &tiles);
    if (status == SRF_OK) status = srf_textures_image(*out_textures, 0, SRF_TEXTURE_MAP_COLOUR, colours);
    return status;
}

/* Releases both. */
static void release(srf_textures *textures, srf_photo *photo)
{
    srf_textures_free(textures);
    srf_photo_free(photo);
}
