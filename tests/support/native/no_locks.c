// SPDX-License-Identifier: LGPL-2.1-or-later
// A disk without file locks, as some network disks are: below NO_LOCKS_BELOW each lock is refused (ENOLCK).
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <stdlib.h>
#include <unistd.h>
static int refused(int fd, int cmd) {
    char link[64], path[4096]; const char *home = getenv("NO_LOCKS_BELOW"); ssize_t n;
    if (!home || !(cmd == F_SETLK || cmd == F_SETLKW || cmd == F_GETLK || cmd == F_OFD_SETLK || cmd == F_OFD_SETLKW)) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    n = readlink(link, path, sizeof path - 1);
    if (n < 0) return 0;
    path[n] = 0;
    return strncmp(path, home, strlen(home)) == 0;
}
#define BODY(name) \
int name(int fd, int cmd, ...) { \
    static int (*real)(int, int, ...); va_list a; va_start(a, cmd); void *arg = va_arg(a, void *); va_end(a); \
    if (!real) real = dlsym(RTLD_NEXT, #name); \
    if (refused(fd, cmd)) { errno = ENOLCK; return -1; } \
    return real(fd, cmd, arg); }
BODY(fcntl)
BODY(fcntl64)
