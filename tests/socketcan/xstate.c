/* ptrace for User-Mode Linux on processors whose register state is larger than it expects (AMX): its buffer holds the
   first bytes, and Linux takes back nothing but the whole. So the rest is read and written with them. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#define LARGEST 65536

typedef long (*Ptrace)(enum __ptrace_request, pid_t, void *, void *);

long ptrace(enum __ptrace_request request, ...)
{
	static Ptrace real;
	static char whole[LARGEST];
	va_list arguments;
	va_start(arguments, request);
	pid_t pid = va_arg(arguments, pid_t);
	void *address = va_arg(arguments, void *);
	void *data = va_arg(arguments, void *);
	va_end(arguments);
	if (real == NULL)
		real = (Ptrace)dlsym(RTLD_NEXT, "ptrace");
	if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
		struct iovec *given = data, state = {whole, LARGEST};
		if (real(PTRACE_GETREGSET, pid, address, &state) == 0 && state.iov_len > given->iov_len) {
			memcpy(whole, given->iov_base, given->iov_len);
			return real(request, pid, address, &state);
		}
	}
	return real(request, pid, address, data);
}
