// Preloaded by `guest` into the guest kernel on processors with more state than that kernel hands on.
//
// User-Mode Linux hands 2696 bytes of a process's extended state (XSAVE) to Linux, which reads out as much as it is asked for
// but takes back nothing less than the whole (EFAULT), and with AMX that is 11008 bytes: the guest's first process would end in
// fatal_sigsegv. What the guest does not know of is filled up with the process's own state of it, which XSTATE_BV, in the part
// that the guest does know, says not to be in use.

#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

// Not on the stack: the guest kernel calls on its own small ones, from one thread.
static unsigned char whole[1 << 16];

long ptrace(enum __ptrace_request request, ...) {
  va_list arguments;
  va_start(arguments, request);
  const pid_t pid = va_arg(arguments, pid_t);
  void* const address = va_arg(arguments, void*);
  void* const data = va_arg(arguments, void*);
  va_end(arguments);
  if (request == PTRACE_PEEKTEXT || request == PTRACE_PEEKDATA || request == PTRACE_PEEKUSER) {
    // The C library returns the word, the system call stores it.
    long word = 0;
    if (syscall(SYS_ptrace, request, pid, address, &word) < 0) return -1;
    errno = 0;
    return word;
  }
  if (request == PTRACE_SETREGSET && (uintptr_t)address == NT_X86_XSTATE) {
    const struct iovec* const given = data;
    struct iovec all = {whole, sizeof whole};
    if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, address, &all) < 0) return -1;
    if (given->iov_len < all.iov_len) {
      memcpy(whole, given->iov_base, given->iov_len);
      return syscall(SYS_ptrace, request, pid, address, &all);
    }
  }
  return syscall(SYS_ptrace, request, pid, address, data);
}
