/* A program of a stranger: the header alone says all it needs. Compiled as C99 and as C++17. */
#include <stdio.h>
#include <string.h>

#include "surfrecon.h"

int main(void)
{
    const char *text = NULL;
    char version[32];

    if (srf_abi_version() != SRF_ABI_VERSION) {
        fprintf(stderr, "header and library differ\n");
        return 1;
    }
    sprintf(version, "%d.%d.%d", SRF_VERSION_MAJOR, SRF_VERSION_MINOR, SRF_VERSION_PATCH);
    if (strcmp(version, srf_version()) != 0) {
        fprintf(stderr, "the header is of %s, the library of %s\n", version, srf_version());
        return 4;
    }
    if (srf_status_text(SRF_ERR_CANCELLED, &text) != SRF_OK || strcmp(text, "cancelled") != 0) {
        fprintf(stderr, "no text for a status: %s\n", srf_last_error_message());
        return 2;
    }
    if (srf_status_text(12345, &text) != SRF_ERR_PARAMETER || strlen(srf_last_error_message()) == 0) {
        fprintf(stderr, "an unknown status has a text\n");
        return 3;
    }
    printf("surfrecon %s\n", srf_version());
    return 0;
}
