/* Opens a list of scans, a recording's folder or a single scan, and prints what is in it. */
static srf_status list_scans(const char *path, srf_scans **out_scans)
{
    size_t i, count = 0;
    srf_status status = srf_scans_open(&path, 1, NULL, NULL, out_scans);
    if (status == SRF_OK) status = srf_scans_count(*out_scans, &count, NULL);
    for (i = 0; status == SRF_OK && i < count; ++i) {
        const char *name;
        status = srf_scans_describe(*out_scans, i, &name, NULL);
        if (status == SRF_OK) puts(name);
    }
    return status;
}

/* Prints the endings of the names of files with scans. */
static srf_status list_endings(void)
{
    size_t i, count = 0;
    srf_status status = srf_format_count(&count);
    for (i = 0; status == SRF_OK && i < count; ++i) {
        const char *name, *endings;
        uint32_t is_side_file;
        status = srf_format(i, &name, &endings, &is_side_file);
        if (status == SRF_OK && !is_side_file) printf("%s: %s\n", name, endings);
    }
    return status;
}

/* Opens depth images of a camera; prints how their files were understood. */
static srf_status open_depths(const char *const *paths, size_t count, srf_scans **out_scans)
{
    srf_read_options options;
    size_t i, notes = 0;
    srf_status status;
    srf_read_options_init(&options);
    options.intrinsics[0] = options.intrinsics[1] = 525;
    options.intrinsics[2] = 319.5;
    options.intrinsics[3] = 239.5;
    status = srf_scans_open(paths, count, &options, NULL, out_scans);
    if (status != SRF_OK) return status;
    status = srf_scans_count(*out_scans, NULL, &notes);
    for (i = 0; status == SRF_OK && i < notes; ++i) {
        const char *note;
        status = srf_scans_note(*out_scans, i, &note);
        if (status == SRF_OK) puts(note);
    }
    if (status != SRF_OK) srf_scans_free(*out_scans);
    return status;
}

/* Counts the scans of a set that are frames of a recording, which nobody wants to see in a list. */
static srf_status count_frames(const srf_scans *scans, size_t *out_frames)
{
    size_t i, count = 0;
    srf_status status = srf_scans_count(scans, &count, NULL);
    for (i = *out_frames = 0; status == SRF_OK && i < count; ++i) {
        uint32_t is_frame = 0;
        status = srf_scans_is_frame(scans, i, &is_frame);
        *out_frames += is_frame;
    }
    return status;
}

/* Reads a range image, placed where it is said to be; *out_image is NULL for a scan that is a mesh or a cloud. */
static srf_status read_image(srf_scans *scans, size_t index, const srf_pose *world_from_sensor,
                             srf_image **out_image)
{
    uint32_t content;
    srf_mesh *mesh = NULL;
    srf_cloud *cloud = NULL;
    srf_status status = srf_scans_set_pose(scans, index, world_from_sensor);
    if (status == SRF_OK) status = srf_scans_read(scans, index, NULL, &content, out_image, &mesh, &cloud);
    srf_mesh_free(mesh);
    srf_cloud_free(cloud);
    return status;
}

/* Opens a scan that came as bytes, for example over a network. The set keeps what it needs of the folder. */
static srf_status open_bytes(const void *bytes, size_t count, srf_scans **out_scans)
{
    const char *path;
    srf_folder *folder;
    srf_status status = srf_folder_create(NULL, &folder);
    if (status != SRF_OK) return status;
    status = srf_folder_put(folder, "scan.ply", bytes, count);
    if (status == SRF_OK) status = srf_folder_path(folder, "scan.ply", &path);
    if (status == SRF_OK) status = srf_scans_open(&path, 1, NULL, NULL, out_scans);
    srf_folder_free(folder);
    return status;
}

/* Sends what was written into a folder, file after file, and takes it out. */
static srf_status send_all(const srf_folder *folder,
                           void (*send)(const char *name, const void *bytes, size_t count))
{
    size_t files = 0;
    srf_status status = srf_folder_count(folder, &files);
    for (; status == SRF_OK && files > 0; --files) {
        const char *name;
        const void *bytes;
        size_t count;
        status = srf_folder_name(folder, 0, &name);
        if (status == SRF_OK) status = srf_folder_bytes(folder, name, &bytes, &count);
        if (status != SRF_OK) break;
        send(name, bytes, count);
        status = srf_folder_remove(folder, name, NULL);
    }
    return status;
}

/* Reads a part of an open file, for put_file(). */
static int32_t read_part(void *user, uint64_t at, void *buffer, size_t count, size_t *out_count)
{
    FILE *file = (FILE *)user;
    if (fseek(file, (long)at, SEEK_SET) != 0) return SRF_ERR_IO;
    *out_count = fread(buffer, 1, count, file);
    return *out_count > 0 ? SRF_OK : SRF_ERR_IO;
}

/* Puts a file into a folder whose bytes are read from where they are once they are asked for. */
static srf_status put_file(const srf_folder *folder, const char *name, FILE *file, uint64_t length)
{
    srf_file_source source;
    source.length = length;
    source.read = read_part;
    source.release = NULL;
    source.user = file;
    return srf_folder_put_source(folder, name, &source);
}
