"""Questions of tests to the system."""

import ctypes
import os
import sys


def resident():
    """Bytes of this process in memory."""
    if sys.platform == "win32":
        # PROCESS_MEMORY_COUNTERS: two numbers of 32 bits, then eight of the pointer's size; the third is wanted.
        counters = (ctypes.c_size_t * 9)()
        kernel = ctypes.WinDLL("kernel32")
        kernel.GetCurrentProcess.restype = ctypes.c_void_p
        asked = kernel.K32GetProcessMemoryInfo
        asked.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32]
        assert asked(kernel.GetCurrentProcess(), counters, ctypes.sizeof(counters))
        return counters[2]
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
