/* Preloaded into the guest's kernel on processors with AMX. There the host takes a process's
 * extended registers back only as a whole, 11 008 bytes, and Linux 6.1 hands over what it knows,
 * 2 696 ("ptrace set fp regs failed, errno = 14"): this fills up the rest, which the guest never
 * uses, as AMX is granted on request only. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

enum { MOST_BYTES = 1 << 16, IN_USE = 512 }; /* which parts are in use: Intel SDM 1, 13.4.2 */
static const uint64_t KNOWN = (1 << 10) - 1; /* x87 to PKRU */

long ptrace(enum __ptrace_request request, ...)
{
    static long (*real)(enum __ptrace_request, pid_t, void *, void *);
    static _Alignas(64) char whole[MOST_BYTES];
    static size_t size;
    va_list arguments;
    va_start(arguments, request);
    pid_t process = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);
    if (!real)
        real = (long (*)(enum __ptrace_request, pid_t, void *, void *))dlsym(RTLD_NEXT, "ptrace");
    if (request != PTRACE_SETREGSET || (uintptr_t)address != NT_X86_XSTATE)
        return real(request, process, address, data);

    const struct iovec *given = data;
    struct iovec filled = {whole, sizeof whole};
    if (!size) {
        if (real(PTRACE_GETREGSET, process, address, &filled))
            return -1;
        size = filled.iov_len;
    }
    if (given->iov_len >= size)
        return real(request, process, address, data);
    memset(whole, 0, size);
    memcpy(whole, given->iov_base, given->iov_len);
    *(uint64_t *)(whole + IN_USE) &= KNOWN;
    filled.iov_len = size;
    return real(request, process, address, &filled);
}
