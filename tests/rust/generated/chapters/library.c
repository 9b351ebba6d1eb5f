/* Ends a program whose call failed. */
static void must(srf_status status)
{
    if (status == SRF_OK) return;
    fprintf(stderr, "%s\n", srf_last_error_message());
    exit(1);
}

/* Whether the library that was loaded does what the program was built for. */
static int fits(void)
{
    printf("surfrecon %s\n", srf_version());
    return srf_abi_version() == SRF_ABI_VERSION && srf_version_number() >= SRF_VERSION;
}

/* Prints a message of the log, behind the name that the log was set with. */
static void print_message(int32_t level, const char *text, void *user)
{
    fprintf(stderr, "%s: %s%s\n", (const char *)user, level == SRF_LOG_LEVEL_WARNING ? "warning: " : "", text);
}

/* Sets up a program: 4 threads, 8 GB, and a log. */
static void set_up(char *name)
{
    must(srf_set_threads(4));
    must(srf_set_memory_limit(8000000000u));
    must(srf_set_log(print_message, name));
    printf("%u threads, %g bytes\n", srf_threads(), (double)srf_memory_limit());
}

/* Merges with settings of its own, as one of several plugins of a program does. */
static srf_status merge_apart(const srf_merger *merger, char *name, srf_mesh **out_mesh)
{
    srf_context *context, *former;
    uint32_t threads;
    uint64_t held;
    srf_status status;
    must(srf_context_create(&context));
    must(srf_context_set_threads(context, 2));
    must(srf_context_set_memory_limit(context, 2000000000u));
    must(srf_context_set_log(context, print_message, name));
    must(srf_context_use(context, &former));
    status = srf_merger_run(merger, NULL, NULL, out_mesh, NULL);
    must(srf_context_use(former, NULL));
    must(srf_context_threads(context, &threads));
    must(srf_context_memory(context, NULL, &held));
    printf("%u threads; what was made holds %g bytes\n", threads, (double)held);
    must(srf_context_free(context));
    return status;
}

/* Shows the progress of a call, which goes on. */
static int32_t show_progress(const char *stage, double fraction, const char *message, void *user)
{
    (void)stage, (void)fraction, (void)user;
    fprintf(stderr, "\r%s", message);
    return 0;
}

/* Merges with progress, until what is handed to a button for stopping is set. */
static srf_status merge_until_stopped(const srf_merger *merger, void (*set_button)(srf_cancel *),
                                      srf_mesh **out_mesh)
{
    srf_progress progress;
    srf_cancel *cancel;
    srf_status status;
    must(srf_cancel_create(&cancel));
    set_button(cancel);
    progress.report = show_progress;
    progress.user = NULL;
    progress.cancel = cancel;
    status = srf_merger_run(merger, NULL, &progress, out_mesh, NULL);
    set_button(NULL);
    must(srf_cancel_free(cancel));
    return status;
}

/* Stops calls on whatever thread, and lets later ones run once it is pressed again. */
static void press_button(srf_cancel *cancel)
{
    uint32_t is_set;
    must(srf_cancel_is_set(cancel, &is_set));
    must(is_set ? srf_cancel_reset(cancel) : srf_cancel_set(cancel));
}

/* Fails as a function of the program's does that the library calls: with a text. */
static int32_t fail(void)
{
    const char *text;
    must(srf_status_text(SRF_ERR_IO, &text));
    fprintf(stderr, "%s\n", text);
    must(srf_set_last_error("the camera is not plugged in"));
    return SRF_ERR_IO;
}

/* Has the library's memory come from functions of the program's, before any other call. */
static void use_memory_of(srf_allocate_fn allocate, srf_deallocate_fn deallocate)
{
    const srf_allocator allocator = {allocate, NULL, deallocate, NULL};
    must(srf_set_allocator(&allocator));
}
