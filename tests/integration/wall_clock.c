/* Preloaded, adds the seconds in the file STEPPED_CLOCK to the wall clock of a process, and leaves its monotonic clock:
   what a setting of the machine's clock does. libfaketime of Debian 12 moves both in clock_nanosleep. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>

static const volatile int64_t *step;

__attribute__((constructor)) static void map_file(void) {
  int file = open(getenv("STEPPED_CLOCK"), O_RDONLY);
  step = mmap(0, sizeof *step, PROT_READ, MAP_SHARED, file, 0);
}

int clock_gettime(clockid_t clock, struct timespec *now) {
  static int (*real)(clockid_t, struct timespec *);
  if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
  int failed = real(clock, now);
  if (!failed && step && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += *step;
  return failed;
}

int gettimeofday(struct timeval *now, void *zone) {
  struct timespec read;
  clock_gettime(CLOCK_REALTIME, &read);
  now->tv_sec = read.tv_sec, now->tv_usec = read.tv_nsec / 1000;
  return 0;
}

time_t time(time_t *to) {
  struct timespec read;
  clock_gettime(CLOCK_REALTIME, &read);
  if (to) *to = read.tv_sec;
  return read.tv_sec;
}
