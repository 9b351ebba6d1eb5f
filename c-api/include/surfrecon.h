/*
 * surfrecon: surfaces from range scans.
 *
 * Conventions
 *   Names begin with srf_. A call that can fail returns srf_status; srf_last_error_message() then has the text.
 *   Results are written through the last arguments, and only on SRF_OK.
 *   Pointers are borrowed for the call unless the comment says otherwise; const means not modified.
 *   Every call may be made from any thread, and no call ends the program.
 *
 * Generated from c-api/src by `make generate`; a test compares. Do not edit.
 */

#ifndef SURFRECON_H
#define SURFRECON_H

#include <stdint.h>

// Number of the binary interface this header describes. It grows when a program built against an older header would no
// longer work; compare it with srf_abi_version().
#define SRF_ABI_VERSION 1

// Outcome of a call. Numbers are never reused.
typedef enum {
  // All went well.
  SRF_OK = 0,
  // A parameter is out of its range; the text has the value, the range and the unit.
  SRF_ERR_PARAMETER = 1,
  // The data handed in can't be used; the text names the element.
  SRF_ERR_INPUT = 2,
  // A file does not hold what its format promises; the text names the place.
  SRF_ERR_FORMAT = 3,
  // Reading or writing a file failed.
  SRF_ERR_IO = 4,
  // There is not enough memory.
  SRF_ERR_OUT_OF_MEMORY = 5,
  // The caller cancelled; nothing was left behind.
  SRF_ERR_CANCELLED = 6,
  // A pointer is NULL that must not be.
  SRF_ERR_NULL = 7,
  // A mistake of the library itself: please report it with the text.
  SRF_ERR_INTERNAL = 8,
} srf_status;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Version of the loaded library, for example "0.1.0". Static text, never NULL. Since 0.1.
const char *srf_version(void);

// Number of the binary interface of the loaded library; it must equal SRF_ABI_VERSION of the header the program was
// built with. Since 0.1.
uint32_t srf_abi_version(void);

// Text of the last error of this thread: what is wrong and, where there is one, the remedy. Empty if no call has failed,
// never NULL; valid until the next call that fails on this thread. UTF-8. Since 0.1.
const char *srf_last_error_message(void);

// Short text of a status, for example "cancelled".
// out_text   receives a static text on SRF_OK only; not NULL
// returns    SRF_OK, SRF_ERR_PARAMETER if there is no such status, SRF_ERR_NULL. Since 0.1.
srf_status srf_status_text(int32_t status, const char **out_text);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SURFRECON_H */
