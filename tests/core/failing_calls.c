/* Loaded before the C library: of the calls that change a file system, the n-th fails, or the process ends there.
 * dz_arm(n, how): how 0 counts only, 1 ENOSPC, 2 EIO, 3 SIGKILL, 4 SIGINT. dz_seen(): calls since then. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <sys/types.h>
#include <unistd.h>

static long due, seen;
static int how, armed;

void dz_arm(long n, int what) { due = n; how = what; seen = 0; armed = 1; }
long dz_seen(void) { armed = 0; return seen; }

static int fails(void)
{
    if (!armed || ++seen != due) return 0;
    if (how == 3) kill(getpid(), SIGKILL);
    if (how == 4) kill(getpid(), SIGINT);
    errno = how == 2 ? EIO : ENOSPC;
    return how == 1 || how == 2;
}

#define WRAP(type, name, parameters, arguments) \
    type name parameters \
    { \
        static type(*real) parameters; \
        if (!real) *(void **)&real = dlsym(RTLD_NEXT, #name); \
        return fails() ? -1 : real arguments; \
    }

WRAP(ssize_t, write, (int f, const void *b, size_t n), (f, b, n))
WRAP(ssize_t, sendfile64, (int o, int i, off_t *p, size_t n), (o, i, p, n))
WRAP(ssize_t, sendfile, (int o, int i, off_t *p, size_t n), (o, i, p, n))
WRAP(int, fsync, (int f), (f))
WRAP(int, rename, (const char *a, const char *b), (a, b))
WRAP(int, renameat2, (int d, const char *a, int e, const char *b, unsigned f), (d, a, e, b, f))
WRAP(int, mkdir, (const char *a, mode_t m), (a, m))
WRAP(int, chmod, (const char *a, mode_t m), (a, m))
WRAP(int, fchmodat, (int d, const char *a, mode_t m, int f), (d, a, m, f))
WRAP(int, utimensat, (int d, const char *a, const void *t, int f), (d, a, t, f))
WRAP(int, symlink, (const char *a, const char *b), (a, b))
WRAP(int, unlink, (const char *a), (a))
WRAP(int, rmdir, (const char *a), (a))
WRAP(int, unlinkat, (int d, const char *a, int f), (d, a, f))

#define OPEN(name) \
    int name(const char *path, int flags, ...) \
    { \
        static int (*real)(const char *, int, ...); \
        va_list more; \
        mode_t mode; \
        if (!real) *(void **)&real = dlsym(RTLD_NEXT, #name); \
        va_start(more, flags); \
        mode = (flags & O_CREAT) ? va_arg(more, mode_t) : 0; \
        va_end(more); \
        if ((flags & (O_WRONLY | O_RDWR | O_CREAT)) && fails()) return -1; \
        return real(path, flags, mode); \
    }

OPEN(open)
OPEN(open64)
