/* confined SECONDS FILE_BYTES MEMORY_BYTES FOLDER PROGRAM ...: becomes the program, within limits and with fewer rights.
 *
 * It does so before anything of the program runs, constructors too. A limit of 0 is none, but for files: then nothing
 * may be written. On Linux with Landlock the program changes no file outside of FOLDER, "" of all, opens no connection
 * of TCP and sends no signal to another process. Elsewhere there are the limits alone. */
#define _GNU_SOURCE
#define _DARWIN_C_SOURCE
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

/* Sets a limit, which sends its signal, and the one above, which ends a program that has not heard. */
static int limit(int which, rlim_t most, rlim_t last)
{
    struct rlimit limits;

    if (getrlimit(which, &limits) != 0) {
        return -1;
    }
    if (limits.rlim_max == RLIM_INFINITY || limits.rlim_max > last) {
        limits.rlim_max = last;
    }
    limits.rlim_cur = most < limits.rlim_max ? most : limits.rlim_max;
    return setrlimit(which, &limits);
}

#if defined(__linux__)
#include <sys/prctl.h>
#include <sys/syscall.h>

enum { CREATE_RULESET = 444, ADD_RULE = 445, RESTRICT_SELF = 446, VERSION = 1, PATH_BENEATH = 1 };

/* Of linux/landlock.h, which a compiler need not have: what is written, removed, made, moved and cut. */
#define WRITES UINT64_C(0x7FF2)
#define BEFORE_MOVES UINT64_C(0x1FF2)
#define BEFORE_CUTS UINT64_C(0x3FF2)

struct ruleset
{
    uint64_t files;
    uint64_t net;
    uint64_t scoped;
};

struct beneath
{
    uint64_t allowed;
    int32_t folder;
} __attribute__((packed));

static int confine(const char *folder)
{
    const long version = syscall(CREATE_RULESET, NULL, 0, VERSION);
    struct ruleset rules = {WRITES, 3u, 3u};
    size_t size = sizeof rules;
    int made;

    if (version < 1) {
        return 0; /* a kernel without it */
    }
    rules.files = version < 2 ? BEFORE_MOVES : version < 3 ? BEFORE_CUTS : WRITES;
    size -= version < 4 ? 16u : version < 6 ? 8u : 0u;
    made = (int)syscall(CREATE_RULESET, &rules, size, 0);
    if (made < 0) {
        return -1;
    }
    if (folder[0] != '\0') {
        struct beneath rule = {rules.files, open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC)};

        if (rule.folder < 0 || syscall(ADD_RULE, made, PATH_BENEATH, &rule, 0) != 0) {
            return -1;
        }
        close(rule.folder);
    }
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || syscall(RESTRICT_SELF, made, 0) != 0) {
        return -1;
    }
    close(made);
    return 0;
}
#else
static int confine(const char *folder)
{
    (void)folder;
    return 0;
}
#endif

int main(int count, char **arguments)
{
    if (count < 6) {
        return 126;
    }
    const rlim_t seconds = strtoul(arguments[1], NULL, 10), bytes = strtoull(arguments[2], NULL, 10);
    const rlim_t memory = strtoull(arguments[3], NULL, 10);

    if (limit(RLIMIT_CORE, 0, 0) != 0 || limit(RLIMIT_FSIZE, bytes, bytes) != 0
        || limit(RLIMIT_CPU, seconds, seconds + 1) != 0 || confine(arguments[4]) != 0) {
        perror("the limits of a program");
        return 126;
    }
    if (memory > 0) {
        (void)limit(RLIMIT_AS, memory, memory); /* macOS knows it and refuses it */
    }
    execvp(arguments[5], arguments + 5);
    perror(arguments[5]);
    return 127;
}
